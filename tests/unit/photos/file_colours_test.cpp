// What the file of a picture says of its colours, and the sRGB that is made of it.
#include "formats/photos/file_colours.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/unit/images/png_builder.hpp"

namespace stx::photos {
namespace {

using png::bigEndian;
using png::chunk;

constexpr std::string_view kMade =
    "its colours are made sRGB from its colour profile; what sRGB does not have is clipped";

Bytes bytesOf(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}
std::string textOf(const Bytes& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string cicp(int primaries, int transfer, char matrix = 0, char fullRange = 1) {
    const char body[] = {static_cast<char>(primaries), static_cast<char>(transfer), matrix,
                         fullRange};
    return chunk("cICP", std::string(body, 4));
}
std::string gamma(int value) {
    return chunk("gAMA", bigEndian(static_cast<std::uint64_t>(value), 4));
}
/// White, red, green and blue of Display P3.
std::string chrmOfP3() {
    std::string body;
    for (const int value : {31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000})
        body += bigEndian(static_cast<std::uint64_t>(value), 4);
    return chunk("cHRM", body);
}

/// 2x1 pixels of one colour, of codes of 8 bits (spread to 16).
Bytes pngOf(const std::string& before, int bits, const std::vector<int>& colour) {
    png::Picture p;
    p.width = 2;
    p.height = 1;
    p.bits = bits;
    p.colourType = colour.size() == 1 ? 0 : 2;
    p.before = before;
    for (int i = 0; i < 2; ++i)
        for (const int c : colour)
            p.samples.push_back(static_cast<std::uint16_t>(bits == 8 ? c : c * 257));
    return bytesOf(png::build(p));
}

Bytes profileOfP3() {
    return coloursOf(pngOf(cicp(12, 13), 8, {1, 2, 3})).profile;
}

/// The colour of a picture as 8 bits, and the note of that.
glm::ivec3 colourOf(const Bytes& file, std::string& note) {
    const auto image = decodeImage(file, "a.png", Limits());
    EXPECT_TRUE(image) << image.error().text();
    if (!image) return {};
    const glm::u8vec4 p = srgb8From(*image, file, note).at(1, 0);
    EXPECT_EQ(p.a, 255);
    std::string again;
    const glm::vec4 f = srgbFloatFrom(*image, file, again).at(1, 0) * 255.0f;
    EXPECT_EQ(again, note);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(f[k], p[k], 1.1);
    return glm::ivec3(p);
}

TEST(FileColours, OfPngBecomeSrgb) {
    const std::string iccp =
        chunk("iCCP", std::string("x\0\0", 3) + png::zlibStored(textOf(profileOfP3())));
    const glm::ivec3 given(120, 90, 60), asP3(126, 88, 55), asLinear(182, 160, 133);
    struct Case {
        const char* name;
        std::string chunks;
        glm::ivec3 expected;
        std::string_view note;
    };
    constexpr std::string_view kNotFullRgb =
        "its cICP says that its colours are of narrow range or not RGB, which is not converted: "
        "they are taken for sRGB of full range";
    const Case cases[] = {
        {"nothing", "", given, ""},
        {"sRGB", chunk("sRGB", std::string(1, '\0')) + gamma(100000), given, ""},
        {"gAMA for sRGB", gamma(45455), given, ""},
        {"cICP sRGB", cicp(1, 13), given, ""},
        {"cICP P3", cicp(12, 13), asP3, kMade},
        {"iCCP P3", iccp, asP3, kMade},
        {"cHRM P3", gamma(45455) + chrmOfP3(), asP3, kMade},
        {"linear", gamma(100000), asLinear, kMade},
        {"cICP before iCCP", cicp(1, 8) + iccp, asLinear, kMade},
        {"PQ", cicp(9, 16), given,
         "its colours are coded by the primaries 9 and the transfer function 16 of ITU-T H.273, "
         "which are not converted: they are taken for sRGB"},
        {"narrow range", cicp(12, 13, 0, 0), given, kNotFullRgb},
        {"Y'CbCr", cicp(1, 13, 1), given, kNotFullRgb},
        {"no gamma", gamma(0), given,
         "what it says of its colours (gAMA, cHRM) is of none: they are taken for sRGB"},
        {"no primaries", chunk("cHRM", std::string(32, '\0')), given,
         "what it says of its colours (gAMA, cHRM) is of none: they are taken for sRGB"},
        {"a profile that is none", chunk("iCCP", std::string("x\0\0", 3) + png::zlibStored("no")),
         given, "its colour profile is not one of three primaries: its colours are taken for sRGB"},
    };
    for (const Case& c : cases)
        for (const int bits : {8, 16}) {
            SCOPED_TRACE(testing::Message() << c.name << ", " << bits << " bits");
            std::string note;
            const glm::ivec3 is = colourOf(pngOf(c.chunks, bits, {120, 90, 60}), note);
            EXPECT_EQ(note, c.note);
            for (int k = 0; k < 3; ++k)
                EXPECT_NEAR(is[k], c.expected[k], c.expected == given ? 0 : 1);
        }
    std::string note;
    const glm::ivec3 grey = colourOf(pngOf(gamma(100000), 8, {60}), note);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(grey[k], asLinear.b, 1);
}

/// 16 bits are rounded behind the curve: a step of 8 bits of dark linear light is 13 of sRGB.
TEST(FileColours, Of16BitsAreFineInTheDark) {
    png::Picture p;
    p.width = 2;
    p.height = 1;
    p.bits = 16;
    p.colourType = 0;
    p.before = gamma(100000);
    p.samples = {100, 100};
    std::string note;
    const glm::ivec3 is = colourOf(bytesOf(png::build(p)), note);
    EXPECT_NEAR(is.r, 255 * 12.92 * 100 / 65535, 0.6);
}

TEST(FileColours, OfJpegTiffAndWebpAreTheirProfile) {
    const std::string profile = textOf(profileOfP3());
    ASSERT_GT(profile.size(), 128u);
    const std::uint8_t pixels[3] = {120, 90, 60};
    const auto plain = encodeJpeg(1, 1, 3, pixels, 95);
    ASSERT_TRUE(plain);
    EXPECT_TRUE(coloursOf(*plain).profile.empty());
    const std::string segment = std::string("ICC_PROFILE\0\1\1", 14) + profile;
    const std::string jpeg = textOf(*plain).substr(0, 2) + "\xff\xe2" +
                             bigEndian(segment.size() + 2, 2) + segment + textOf(*plain).substr(2);
    EXPECT_EQ(textOf(coloursOf(bytesOf(jpeg)).profile), profile);
    for (const bool big : {false, true}) {
        const auto number = [big](std::uint64_t value, int bytes) {
            std::string text = bigEndian(value, bytes);
            if (!big) std::reverse(text.begin(), text.end());
            return text;
        };
        const std::string tiff = std::string(big ? "MM" : "II") + number(42, 2) + number(8, 4) +
                                 number(2, 2) + number(256, 2) + number(3, 2) + number(1, 4) +
                                 number(1, 4) + number(34675, 2) + number(7, 2) +
                                 number(profile.size(), 4) + number(38, 4) + number(0, 4) + profile;
        EXPECT_EQ(textOf(coloursOf(bytesOf(tiff)).profile), profile);
        for (std::size_t size = 0; size < tiff.size(); ++size)
            EXPECT_TRUE(coloursOf(bytesOf(tiff.substr(0, size))).profile.empty()) << size;
    }
    const auto little = [](std::uint64_t value) {
        const std::string text = bigEndian(value, 4);
        return std::string(text.rbegin(), text.rend());
    };
    const std::string webp = "RIFF" + little(profile.size() + 34) + "WEBPVP8X" + little(10) +
                             std::string(10, '\0') + "ICCP" + little(profile.size()) + profile;
    EXPECT_EQ(textOf(coloursOf(bytesOf(webp)).profile), profile);
    EXPECT_TRUE(coloursOf(bytesOf(webp.substr(0, 60))).profile.empty());
}

}  // namespace
}  // namespace stx::photos
