// TIFF, BMP and WebP: what OpenImageIO reads wrong, or paints black without a word.

#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <string_view>
#include <vector>

#include "formats/files/deflate.hpp"
#include "formats/images/codec_module.hpp"
#include "formats/images/exif.hpp"
#include "formats/images/images.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

void append(Bytes& to, std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) to.push_back(static_cast<std::byte>(value >> (8 * i)));
}

struct Tag {
    std::uint32_t tag, value;
    int type = 3;
};

constexpr std::uint32_t kWidth = 40, kHeight = 30;

/// A little-endian TIFF of one strip, which lies at byte 8.
Bytes tiffOf(const Bytes& strip, std::vector<Tag> tags) {
    Bytes file;
    append(file, 0x2a4949, 4);
    append(file, static_cast<std::uint32_t>(8 + strip.size()), 4);
    file.insert(file.end(), strip.begin(), strip.end());
    append(file, static_cast<std::uint32_t>(tags.size()), 2);
    for (const auto& tag : tags) {
        append(file, tag.tag, 2);
        append(file, static_cast<std::uint32_t>(tag.type), 2);
        append(file, 1, 4);
        append(file, tag.value, 4);
    }
    append(file, 0, 4);
    return file;
}

Bytes greyTiff(const Bytes& strip, std::uint32_t compression, std::uint32_t offset = 8) {
    return tiffOf(strip, {{256, kWidth},
                          {257, kHeight},
                          {258, 8},
                          {259, compression},
                          {262, 1},
                          {273, offset, 4},
                          {277, 1},
                          {278, kHeight},
                          {279, static_cast<std::uint32_t>(strip.size()), 4}});
}

Bytes noise(std::size_t size) {
    std::mt19937 random(5);
    Bytes bytes(size);
    for (auto& b : bytes) b = static_cast<std::byte>(random());
    return bytes;
}

void expectDamaged(const Bytes& bytes, const char* what) {
    const auto image = decodeImage(bytes, "a.tif", Limits());
    ASSERT_FALSE(image) << what;
    EXPECT_EQ(image.error().code, ErrorCode::invalidInput) << what;
}

TEST(Tiff, PixelsThatAreNotThereAreErrors) {
    const Bytes pixels = noise(kWidth * kHeight);
    const auto whole = decodeImage(greyTiff(pixels, 1), "a.tif", Limits());
    ASSERT_TRUE(whole) << whole.error().text();
    EXPECT_EQ(std::get<0>(whole->values)[77], std::to_integer<std::uint8_t>(pixels[77]));
    expectDamaged(greyTiff(pixels, 1, 0xffffffff), "strip past the end");
    expectDamaged(greyTiff({pixels.begin(), pixels.begin() + 500}, 1), "half a strip");
    expectDamaged(greyTiff(pixels, 5), "garbage under LZW");
    expectDamaged(greyTiff(pixels, 7), "garbage under JPEG");
    expectDamaged(greyTiff(pixels, 8), "garbage under deflate");
    Bytes packed(zlibBound(pixels.size()));
    packed.resize(compressZlib(pixels, 6, packed));
    const auto deflated = decodeImage(greyTiff(packed, 8), "a.tif", Limits());
    ASSERT_TRUE(deflated) << deflated.error().text();
    EXPECT_EQ(deflated->values, whole->values);
    // Its checksum alone tells that a pixel is another one.
    packed.back() ^= std::byte{1};
    expectDamaged(greyTiff(packed, 8), "another checksum");
}

TEST(Tiff, PackBitsThatDoesNotEndWithItsPixelsIsDamaged) {
    constexpr std::uint32_t kPackBits = 32773;
    Bytes packed;
    for (std::uint32_t y = 0; y < kHeight; ++y) {  // 20 bytes as they are, one 20 times
        packed.push_back(std::byte{19});
        for (int i = 0; i < 20; ++i) packed.push_back(static_cast<std::byte>(y + i));
        packed.insert(packed.end(), {static_cast<std::byte>(257 - 20), std::byte{7}});
    }
    const auto whole = decodeImage(greyTiff(packed, kPackBits), "a.tif", Limits());
    ASSERT_TRUE(whole) << whole.error().text();
    EXPECT_EQ(std::get<0>(whole->values)[41], 2);
    EXPECT_EQ(std::get<0>(whole->values)[79], 7);
    Bytes padded = packed;
    padded.push_back(std::byte{0});
    EXPECT_TRUE(decodeImage(greyTiff(padded, kPackBits), "a.tif", Limits()));
    Bytes longer = packed;
    longer.insert(longer.end(), 10, std::byte{3});
    expectDamaged(greyTiff(longer, kPackBits), "bytes left over");
    Bytes other = packed;
    other[0] = std::byte{17};
    expectDamaged(greyTiff(other, kPackBits), "two bytes taken for a run");
    expectDamaged(greyTiff({packed.begin(), packed.end() - 30}, kPackBits), "cut");
    expectDamaged(greyTiff(noise(kWidth * kHeight), kPackBits), "garbage");
}

/// Without BitsPerSample it is 1, as Pillow writes masks.
TEST(Tiff, OneBitIsWhatATiffHasWithoutATag) {
    Bytes strip(kWidth / 8 * kHeight);
    for (std::size_t i = 0; i < strip.size(); ++i) strip[i] = std::byte{0xa7};
    for (const std::uint32_t zeroIs : {0u, 1u}) {  // white, black
        const auto image =
            decodeImage(tiffOf(strip, {{256, kWidth},
                                       {257, kHeight},
                                       {259, 1},
                                       {262, zeroIs},
                                       {273, 8, 4},
                                       {278, kHeight},
                                       {279, static_cast<std::uint32_t>(strip.size()), 4}}),
                        "mask.tif", Limits());
        ASSERT_TRUE(image) << image.error().text();
        ASSERT_EQ(image->channels, 1);
        const auto& values = std::get<0>(image->values);
        for (std::size_t i = 0; i < values.size(); ++i) {
            const bool bit = 0xa7u >> (7 - i % 8) & 1u;
            ASSERT_EQ(values[i], bit == (zeroIs == 1) ? 255 : 0) << i;
        }
    }
}

/// PhotometricInterpretation 0 (TIFF 6.0, section 4): grey is stored as white less what it is, of
/// any number of bits, and what is beside it (ExtraSamples) is not.
TEST(Tiff, WhiteIsZeroIsTurnedOfAnyBits) {
    const auto decoded = [](std::uint32_t bits, std::uint32_t zeroIs, std::uint32_t samples) {
        const Bytes strip = noise(std::size_t{kWidth} * kHeight * bits * samples / 8);
        std::vector<Tag> tags = {
            {256, kWidth},  {257, kHeight}, {258, samples == 1 ? bits : bits << 16 | bits},
            {259, 1},       {262, zeroIs},  {273, 8, 4},
            {277, samples}, {278, kHeight}, {279, static_cast<std::uint32_t>(strip.size()), 4}};
        if (samples == 2) tags.push_back({338, 2});  // alpha that colours do not hold
        Bytes file = tiffOf(strip, tags);
        // Two values of 16 bits lie in the entry of BitsPerSample.
        if (samples == 2) file[8 + strip.size() + 2 + 2 * 12 + 4] = std::byte{2};
        return decodeImage(file, "grey.tif", Limits());
    };
    for (const std::uint32_t samples : {1u, 2u})
        for (const std::uint32_t bits : {8u, 12u, 16u, 32u}) {
            SCOPED_TRACE(testing::Message() << bits << " bits, " << samples << " samples");
            const auto white = decoded(bits, 0, samples), black = decoded(bits, 1, samples);
            ASSERT_TRUE(white) << white.error().text();
            ASSERT_TRUE(black) << black.error().text();
            ASSERT_EQ(white->channels, static_cast<int>(samples));
            ASSERT_EQ(white->bits(), bits == 12 ? 16 : static_cast<int>(bits));
            std::visit(
                [&]<class Values>(const Values& values) {
                    const auto& of = std::get<Values>(black->values);
                    constexpr bool kFloat = std::is_same_v<Values, std::vector<float>>;
                    const double all = kFloat ? 1.0 : bits == 8 ? 255.0 : 65535.0;
                    ASSERT_EQ(values.size(), of.size());
                    for (std::size_t i = 0; i < values.size(); ++i)
                        ASSERT_NEAR(values[i], i % samples == 0 ? all - of[i] : of[i],
                                    kFloat ? 1e-7 : 0)
                            << i;
                },
                white->values);
        }
}

/// Its directory, which is written anew behind the file, is not read as pixels.
TEST(Tiff, OneBitThatIsCutOffIsDamaged) {
    const Bytes strip(kWidth / 8 * kHeight, std::byte{0xa7});
    const auto file = [&](std::uint32_t at) {
        Bytes bytes = tiffOf({}, {{256, kWidth},
                                  {257, kHeight},
                                  {259, 1},
                                  {262, 1},
                                  {273, at, 4},
                                  {278, kHeight},
                                  {279, static_cast<std::uint32_t>(strip.size()), 4}});
        bytes.insert(bytes.end(), strip.begin(), strip.end());
        return bytes;
    };
    const auto at = static_cast<std::uint32_t>(file(0).size() - strip.size());
    ASSERT_TRUE(decodeImage(file(at), "mask.tif", Limits()));
    Bytes cut = file(at);
    cut.resize(cut.size() - 20);
    expectDamaged(cut, "20 bytes are missing");
}

/// Writers multiply eight bits by 256 or by 257.
TEST(Tiff, ColoursOfAPaletteAreTheirUpperBits) {
    constexpr std::uint32_t kColours = 256;
    const Bytes pixels = noise(kWidth * kHeight);
    for (const std::uint32_t factor : {256u, 257u}) {
        Bytes strip = pixels;
        for (std::uint32_t i = 0; i < 3 * kColours; ++i) append(strip, (255 - i % 256) * factor, 2);
        Bytes file = tiffOf(strip, {{256, kWidth},
                                    {257, kHeight},
                                    {258, 8},
                                    {259, 1},
                                    {262, 3},
                                    {273, 8, 4},
                                    {277, 1},
                                    {278, kHeight},
                                    {279, kWidth * kHeight, 4},
                                    {320, 8 + kWidth * kHeight}});
        file[8 + strip.size() + 2 + 9 * 12 + 5] = std::byte{3};  // 768 colours
        file[8 + strip.size() + 2 + 9 * 12 + 4] = std::byte{0};
        const auto image = decodeImage(file, "palette.tif", Limits());
        ASSERT_TRUE(image) << image.error().text();
        ASSERT_EQ(image->channels, 3);
        EXPECT_EQ(image->storedLargest, 0);
        for (std::size_t i = 0; i < pixels.size(); ++i)
            ASSERT_EQ(std::get<0>(image->values)[3 * i],
                      255 - std::to_integer<std::uint8_t>(pixels[i]))
                << i;
    }
}

/// Depth counts in the file's own steps, whatever they become as colours.
TEST(Tiff, TellsTheLargestIntegerThatItCanHave) {
    constexpr std::uint32_t kSigned = 2;
    struct Kind {
        std::uint32_t bits, sampleFormat;
        double largest;
    };
    for (const auto& [bits, sampleFormat, largest] :
         {Kind{8, 1, 0}, Kind{16, 1, 0}, Kind{12, 1, 4095}, Kind{16, kSigned, 32767},
          Kind{32, kSigned, 2147483647}, Kind{32, 1, 4294967295}, Kind{32, 3, 0}}) {
        SCOPED_TRACE(testing::Message() << bits << ' ' << sampleFormat);
        const Bytes strip(std::size_t{kWidth} * kHeight * bits / 8, std::byte{0});
        const auto image =
            decodeImage(tiffOf(strip, {{256, kWidth},
                                       {257, kHeight},
                                       {258, bits},
                                       {259, 1},
                                       {262, 1},
                                       {273, 8, 4},
                                       {277, 1},
                                       {278, kHeight},
                                       {279, static_cast<std::uint32_t>(strip.size()), 4},
                                       {339, sampleFormat}}),
                        "depth.tif", Limits());
        ASSERT_TRUE(image) << image.error().text();
        EXPECT_EQ(image->storedLargest, largest);
    }
}

/// A DDS of one row of 32-bit pixels, with these flags of the pixels' format.
Bytes ddsOf(std::uint32_t flags, std::uint32_t bits, const Bytes& pixels) {
    Bytes file;
    append(file, 0x20534444, 4);  // "DDS "
    append(file, 124, 4);
    append(file, 0x100f, 4);
    append(file, 1, 4);
    append(file, static_cast<std::uint32_t>(pixels.size()) * 8 / bits, 4);
    file.resize(76);
    append(file, 32, 4);
    append(file, flags, 4);
    append(file, 0, 4);
    append(file, bits, 4);
    for (const std::uint32_t mask : {0xffu, 0xff00u, 0xff0000u, 0xff000000u}) append(file, mask, 4);
    append(file, 0x1000, 4);
    file.resize(128);
    file.insert(file.end(), pixels.begin(), pixels.end());
    return file;
}

TEST(Dds, AlphaIsStraightAndWhatIsMissingIsNotBlack) {
    constexpr std::uint32_t kColourAndAlpha = 0x41, kGrey = 0x20000;
    const Bytes pixels = noise(kWidth * 4);
    const Bytes file = ddsOf(kColourAndAlpha, 32, pixels);
    const auto image = decodeImage(file, "a.dds", Limits());
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_FALSE(image->premultiplied);
    ASSERT_EQ(image->channels, 4);
    for (std::size_t i = 0; i < pixels.size(); ++i)
        ASSERT_EQ(std::get<0>(image->values)[i], std::to_integer<std::uint8_t>(pixels[i])) << i;
    const auto cut = decodeImage(ByteSpan(file).first(file.size() - 8), "a.dds", Limits());
    ASSERT_FALSE(cut);
    EXPECT_EQ(cut.error().code, ErrorCode::invalidInput);
    const auto grey = decodeImage(ddsOf(kGrey, 8, noise(kWidth)), "a.dds", Limits());
    ASSERT_FALSE(grey);
    EXPECT_EQ(grey.error().code, ErrorCode::unsupported);
}

/// Two rows of pixels whose bytes are 1, 2, 3, 4, 5, ...; `masks` of a BITMAPV4HEADER.
Bytes bmpOf(const std::vector<std::uint32_t>& masks) {
    const bool v4 = masks.size() == 4;
    const std::uint32_t header = v4 ? 108 : 40;
    const auto start = 14 + header + (masks.size() == 3 ? 12u : 0u);
    Bytes file = {std::byte{'B'}, std::byte{'M'}};
    append(file, start + 32, 4);
    append(file, 0, 4);
    append(file, start, 4);
    append(file, header, 4);
    append(file, 4, 4);
    append(file, static_cast<std::uint32_t>(-2), 4);  // the first row is on top
    append(file, 1, 2);
    append(file, 32, 2);
    append(file, masks.empty() ? 0 : 3, 4);
    append(file, 32, 4);
    for (int i = 0; i < 4; ++i) append(file, 0, 4);
    for (const auto mask : masks) append(file, mask, 4);
    file.resize(start);
    for (std::uint32_t i = 1; i <= 32; ++i) append(file, i, 1);
    return file;
}

std::vector<std::uint8_t> firstPixelOf(const Bytes& bytes) {
    const auto image = decodeImage(bytes, "a.bmp", Limits());
    EXPECT_TRUE(image) << image.error().text();
    if (!image) return {};
    EXPECT_FALSE(image->premultiplied);
    const auto& values = std::get<0>(image->values);
    EXPECT_EQ(values[static_cast<std::size_t>(image->channels)], values[0] + 4);
    return {values.begin(), values.begin() + image->channels};
}

TEST(Bmp, FourBytesAreWhatTheMasksSay) {
    using Values = std::vector<std::uint8_t>;
    EXPECT_EQ(firstPixelOf(bmpOf({})), (Values{3, 2, 1}));  // the fourth is padding
    EXPECT_EQ(firstPixelOf(bmpOf({0xff0000, 0xff00, 0xff})), (Values{3, 2, 1}));
    EXPECT_EQ(firstPixelOf(bmpOf({0xff, 0xff00, 0xff0000})), (Values{1, 2, 3}));
    EXPECT_EQ(firstPixelOf(bmpOf({0xff0000, 0xff00, 0xff, 0xff000000})), (Values{3, 2, 1, 4}));
    EXPECT_EQ(firstPixelOf(bmpOf({0xff000000, 0xff0000, 0xff00, 0xff})), (Values{4, 3, 2, 1}));
    EXPECT_EQ(firstPixelOf(bmpOf({0xff0000, 0xff00, 0xff, 0})), (Values{3, 2, 1}));
    const auto odd = decodeImage(bmpOf({0x3ff00000, 0xffc00, 0x3ff, 0}), "a.bmp", Limits());
    ASSERT_FALSE(odd);
    EXPECT_EQ(odd.error().code, ErrorCode::unsupported);
}

/// Its chunk begins with a TIFF, or with the header that a JPEG's has.
TEST(Webp, IsTurnedAsItsExifSays) {
    Bytes exif = tiffOf({}, {{0x112, 6}});
    for (const bool header : {false, true}) {
        if (header) {
            const auto before = std::as_bytes(std::span("Exif\0", 6));
            exif.insert(exif.begin(), before.begin(), before.end());
        }
        Bytes file;
        append(file, 0x46464952, 4);  // "RIFF"
        append(file, 0, 4);
        append(file, 0x50424557, 4);  // "WEBP"
        append(file, 0x4c385056, 4);  // "VP8L", of an odd length
        append(file, 3, 4);
        append(file, 0, 4);
        append(file, 0x46495845, 4);  // "EXIF"
        append(file, static_cast<std::uint32_t>(exif.size()), 4);
        file.insert(file.end(), exif.begin(), exif.end());
        EXPECT_EQ(readExif(file).orientation, 6) << header;
        file.resize(file.size() - 1);
        EXPECT_EQ(readExif(file).orientation, 1) << "cut off";
    }
}

/// Whatever their number of bits, integers code sRGB.
TEST(Tiff, IntegersOf32BitsAreNoLinearLight) {
    Bytes strip;
    for (std::uint32_t i = 0; i < kWidth * kHeight; ++i) append(strip, 0x80808080, 4);
    const auto image = decodeImage(tiffOf(strip, {{256, kWidth},
                                                  {257, kHeight},
                                                  {258, 32},
                                                  {259, 1},
                                                  {262, 1},
                                                  {273, 8, 4},
                                                  {277, 1},
                                                  {278, kHeight},
                                                  {279, kWidth * kHeight * 4, 4}}),
                                   "a.tif", Limits());
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(image->bits(), 32);
    EXPECT_FALSE(image->linear);
    Rgba8Loss loss;
    EXPECT_EQ(rgba8From(*image, &loss).at(3, 3), glm::u8vec4(128, 128, 128, 255));
    EXPECT_EQ(loss.bits, 32);
    EXPECT_FALSE(loss.linear);
}

/// Colours under thin alpha, and under none, come back as they are.
TEST(Webp, AlphaCostsNoColour) {
    Bytes pixels = noise(std::size_t{kWidth} * kHeight * 4);
    for (std::size_t i = 3; i < pixels.size(); i += 12) pixels[i] = std::byte{0};
    const TemporaryFolder folder;
    const auto path = (folder / "a.webp").string();
    const auto table = loadCodecs();
    ASSERT_TRUE(table) << table.error().text();
    codecs::EncodeRequest request;
    request.path = path.c_str();
    request.format = "webp";
    request.width = kWidth;
    request.height = kHeight;
    request.channels = 4;
    request.values = reinterpret_cast<const std::uint8_t*>(pixels.data());
    codecs::Failure failure;
    ASSERT_TRUE((*table)->encode(request, failure)) << failure.message;
    const auto bytes = readFile(path, Limits());
    ASSERT_TRUE(bytes);
    const auto image = decodeImage(*bytes, "a.webp", Limits());
    ASSERT_TRUE(image) << image.error().text();
    ASSERT_EQ(image->channels, 4);
    EXPECT_FALSE(image->premultiplied);
    const auto& values = std::get<0>(image->values);
    ASSERT_EQ(values.size(), pixels.size());
    for (std::size_t i = 0; i < values.size(); ++i)
        ASSERT_EQ(values[i], std::to_integer<std::uint8_t>(pixels[i])) << i;
    EXPECT_FALSE(decodeImage(ByteSpan(*bytes).first(bytes->size() / 2), "a.webp", Limits()));
}

}  // namespace
}  // namespace stx
