#include <gtest/gtest.h>

#include <random>

#include "formats/images/images.hpp"
#include "tests/unit/images/png_builder.hpp"

namespace stx {
namespace {

ByteSpan span(const std::string& text) {
    return std::as_bytes(std::span(text));
}

Result<DecodedImage> decode(const std::string& png) {
    return decodeImage(span(png), "a.png", Limits());
}

std::string messageOf(const std::string& png) {
    const auto image = decode(png);
    if (image) return "decoded";
    EXPECT_EQ(image.error().code, ErrorCode::invalidInput);
    EXPECT_EQ(image.error().where, "'a.png'");
    // The same by the other way.
    const auto rgba = decodeRgba8(span(png), "a.png", Limits());
    EXPECT_TRUE(!rgba && rgba.error().text() == image.error().text());
    return image.error().message;
}

png::Picture picture(int colourType, int bits, bool interlaced, bool transparent) {
    png::Picture p;
    p.width = 21;
    p.height = 13;
    p.colourType = colourType;
    p.bits = bits;
    p.interlaced = interlaced;
    std::mt19937 random(bits * 8 + colourType);
    const unsigned codes = colourType == 3 ? std::min(1u << bits, 200u) : 1u << bits;
    for (int i = 0; i < p.width * p.height * p.channels(); ++i)
        p.samples.push_back(static_cast<std::uint16_t>(random() % codes));
    if (colourType == 3) {
        for (unsigned i = 0; i < codes * 3; ++i) p.palette += static_cast<char>(random());
        if (transparent) p.transparency = std::string("\x80\x07", 2);
    } else if (transparent) {  // the colour of the first pixel
        for (int c = 0; c < p.channels(); ++c) p.transparency += png::bigEndian(p.samples[c], 2);
    }
    return p;
}

/// ISO/IEC 15948: palettes spread, grey of 1, 2 and 4 bits scaled to 8, a transparent colour as
/// alpha.
std::vector<std::uint16_t> expected(const png::Picture& p) {
    std::vector<std::uint16_t> out;
    const int channels = p.channels();
    const auto top = static_cast<std::uint16_t>(p.bits == 16 ? 65535 : 255);
    for (std::size_t i = 0; i < p.samples.size(); i += channels) {
        if (p.colourType == 3) {
            const std::size_t code = p.samples[i];
            for (int c = 0; c < 3; ++c)
                out.push_back(static_cast<unsigned char>(p.palette[code * 3 + c]));
            if (!p.transparency.empty())
                out.push_back(code < p.transparency.size()
                                  ? static_cast<unsigned char>(p.transparency[code])
                                  : 255);
            continue;
        }
        const int scale = p.bits < 8 ? 255 / ((1 << p.bits) - 1) : 1;
        bool matches = true;
        for (int c = 0; c < channels; ++c) {
            out.push_back(static_cast<std::uint16_t>(p.samples[i + c] * scale));
            matches &= p.samples[i + c] == p.samples[c];
        }
        if (!p.transparency.empty()) out.push_back(matches ? 0 : top);
    }
    return out;
}

TEST(PngReader, EveryKindIsDecodedExactly) {
    const std::pair<int, int> kinds[] = {{0, 1}, {0, 2},  {0, 4},  {0, 8}, {0, 16},
                                         {2, 8}, {2, 16}, {3, 1},  {3, 2}, {3, 4},
                                         {3, 8}, {4, 8},  {4, 16}, {6, 8}, {6, 16}};
    for (const auto& [colourType, bits] : kinds) {
        for (const bool interlaced : {false, true}) {
            for (const bool transparent : {false, true}) {
                if (transparent && colourType > 3) continue;
                SCOPED_TRACE(fmt::format("type {}, {} bits, interlaced {}, transparent {}",
                                         colourType, bits, interlaced, transparent));
                const auto p = picture(colourType, bits, interlaced, transparent);
                const auto file = png::build(p);
                const auto image = decode(file);
                ASSERT_TRUE(image) << image.error().text();
                const auto wanted = expected(p);
                EXPECT_EQ(image->width, p.width);
                EXPECT_EQ(image->height, p.height);
                EXPECT_EQ(image->displayWidth, p.width);
                EXPECT_EQ(image->displayHeight, p.height);
                EXPECT_EQ(image->bits(), bits == 16 ? 16 : 8);
                EXPECT_FALSE(image->linear);
                EXPECT_FALSE(image->premultiplied);
                const std::vector<std::string> names[] = {
                    {"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
                EXPECT_EQ(image->channelNames, names[image->channels - 1]);
                std::visit(
                    [&](const auto& values) {
                        EXPECT_TRUE(
                            std::equal(values.begin(), values.end(), wanted.begin(), wanted.end()));
                    },
                    image->values);
                const auto info = probeImage(span(file));
                ASSERT_TRUE(info);
                EXPECT_EQ(info->channels, image->channels);
                EXPECT_EQ(info->bits, image->bits());
                const auto rgba = decodeRgba8(span(file), "a.png", Limits());
                ASSERT_TRUE(rgba) << rgba.error().text();
                EXPECT_EQ(*rgba, rgba8From(*image));
            }
        }
    }
}

/// The bytes of a row less what its filter guesses (clause 9.2), as its definition says it.
std::string filtered(int filter, const std::string& row, const std::string& above,
                     std::size_t step) {
    std::string out(1, static_cast<char>(filter));
    for (std::size_t i = 0; i < row.size(); ++i) {
        const auto byte = [&](const std::string& from, bool before) {
            if (before && i < step) return 0;
            return static_cast<int>(static_cast<unsigned char>(from[before ? i - step : i]));
        };
        const int a = byte(row, true), b = byte(above, false), c = byte(above, true);
        const int p = a + b - c, pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
        const int paeth = pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
        const int guess[] = {0, a, b, (a + b) / 2, paeth};
        out += static_cast<char>(byte(row, false) - guess[filter]);
    }
    return out;
}

TEST(PngReader, EveryFilterIsUndone) {
    for (const auto& [type, bits] :
         {std::pair{0, 8}, {0, 16}, {2, 8}, {2, 16}, {4, 8}, {4, 16}, {6, 8}, {6, 16}}) {
        const auto p = picture(type, bits, false, false);
        const auto step = static_cast<std::size_t>(p.channels() * bits / 8);
        std::string rows, above(step * static_cast<std::size_t>(p.width), '\0');
        for (int y = 0; y < p.height; ++y) {
            std::string row;
            for (int i = 0; i < p.width * p.channels(); ++i)
                row += png::bigEndian(
                    p.samples[static_cast<std::size_t>(y * p.width * p.channels() + i)], bits / 8);
            rows += filtered(y % 5, row, above, step);
            above = row;
        }
        // In two chunks, as most programs write large pictures.
        const auto file = [&](const std::string& bytes) {
            const auto packed = png::zlibStored(bytes);
            return png::header(p) + png::chunk("IDAT", packed.substr(0, 100)) +
                   png::chunk("IDAT", packed.substr(100)) + png::chunk("IEND", "");
        };
        const auto image = decode(file(rows));
        ASSERT_TRUE(image) << image.error().text();
        const auto plain = decode(png::build(p));
        ASSERT_TRUE(plain);
        EXPECT_EQ(image->values, plain->values) << type << " " << bits;
        const auto rgba = decodeRgba8(span(file(rows)), "a.png", Limits());
        ASSERT_TRUE(rgba);
        EXPECT_EQ(*rgba, rgba8From(*plain));
        rows[0] = 5;
        EXPECT_NE(messageOf(file(rows)), "decoded");
    }
}

/// Found by fuzzing: bits of the transparent colour beyond the image's depth do not count
/// (ISO/IEC 15948, 11.3.2.1).
TEST(PngReader, HighBitsOfTheTransparentColourDoNotCount) {
    for (const auto& [type, bits] : {std::pair{0, 1}, {0, 4}, {0, 8}, {2, 8}}) {
        auto p = picture(type, bits, false, true);
        const auto plain = decode(png::build(p));
        for (std::size_t i = 0; i < p.transparency.size(); i += 2) p.transparency[i] = '\x3b';
        const auto file = png::build(p);
        const auto image = decode(file);
        ASSERT_TRUE(plain && image);
        EXPECT_EQ(image->values, plain->values) << type << " " << bits;
        EXPECT_EQ(*decodeRgba8(span(file), "a.png", Limits()), rgba8From(*plain));
    }
}

TEST(PngReader, MetadataIsNotRead) {
    auto p = picture(2, 8, false, false);
    const auto plain = decode(png::build(p));
    // Bytes that no reader of these chunks accepts, and a checksum that is wrong.
    for (const char* kind : {"tEXt", "zTXt", "iTXt", "iCCP", "eXIf", "oFFs", "pHYs", "sBIT", "bKGD",
                             "sRGB", "gAMA", "cHRM", "PLTE"}) {
        p.before = png::chunk(kind, std::string(5000, '\1'));
        if (kind != std::string("PLTE")) p.before.back() ^= 1;
        const auto image = decode(png::build(p));
        ASSERT_TRUE(image) << kind << ": " << image.error().text();
        EXPECT_EQ(image->values, plain->values) << kind;
    }
}

TEST(PngReader, TransparencyOfAWrongLengthIsLeftOut) {
    for (const int type : {0, 2, 3, 4, 6}) {
        auto p = picture(type, 8, false, false);
        const auto plain = decode(png::build(p));
        p.transparency = std::string(700, 'x');
        const auto image = decode(png::build(p));
        ASSERT_TRUE(image) << image.error().text();
        EXPECT_EQ(image->channels, plain->channels);
        EXPECT_EQ(image->values, plain->values);
    }
}

TEST(PngReader, DamagedFilesGiveOneError) {
    const auto p = picture(2, 8, false, false);
    const auto good = png::build(p);
    for (std::size_t size = 1; size < good.size(); ++size)
        EXPECT_FALSE(decode(good.substr(0, size))) << size;
    EXPECT_EQ(messageOf(good.substr(0, good.size() - 12)),
              fmt::format("the PNG ends at byte {} without an IEND chunk; it is cut off",
                          good.size() - 12));

    auto changed = good;
    changed[good.size() - 13] ^= 1;  // the checksum of IDAT
    EXPECT_EQ(messageOf(changed),
              "the PNG is damaged in the chunk at byte 33: invalid chunk checksum");
    changed = good;
    changed[29] ^= 1;
    EXPECT_NE(messageOf(changed).find("in the chunk at byte 8"), std::string::npos);
    EXPECT_EQ(messageOf(png::header(p) + png::chunk("ABCD", "") + good.substr(33)),
              "the PNG has an unknown critical chunk at byte 33");
    // Sound chunks with what no deflate stream holds, and with too few rows.
    EXPECT_NE(
        messageOf(png::header(p) + png::chunk("IDAT", "not deflate") + png::chunk("IEND", "")),
        "decoded");
    auto taller = p;
    taller.height = 14;
    EXPECT_NE(messageOf(png::header(taller) + good.substr(33)), "decoded");
    auto palette = picture(3, 8, false, false);
    palette.palette.clear();
    EXPECT_NE(messageOf(png::build(palette)), "decoded");
    for (const auto& [type, bits] : {std::pair{0, 3}, {2, 4}, {3, 16}, {4, 4}, {5, 8}, {6, 2}}) {
        auto wrong = p;
        wrong.colourType = type;
        wrong.bits = bits;
        EXPECT_NE(messageOf(png::header(wrong) + good.substr(33)), "decoded") << type << bits;
    }
}

}  // namespace
}  // namespace stx
