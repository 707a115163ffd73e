// Pictures of netpbm: as text and as bytes, with comments, of any largest value.

#include <gtest/gtest.h>

#include <string>

#include "formats/images/images.hpp"

namespace stx {
namespace {

Result<DecodedImage> decoded(const std::string& text) {
    return decodeImage(std::as_bytes(std::span(text)), "a.pgm", Limits());
}

template <class Value>
void expectValues(const std::string& text, int channels, double storedLargest,
                  const std::vector<Value>& values) {
    const auto image = decoded(text);
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(image->channels, channels);
    EXPECT_EQ(image->storedLargest, storedLargest);
    EXPECT_EQ(std::get<std::vector<Value>>(image->values), values);
}

TEST(Pnm, AllKindsAreReadExactly) {
    using Bytes8 = std::vector<std::uint8_t>;
    using Words = std::vector<std::uint16_t>;
    expectValues("P1\n# ink\n3 2\n101\n0 1 0", 1, 1, Bytes8{0, 255, 0, 255, 0, 255});
    expectValues(std::string("P4 3 2\n\xa0\x40", 9), 1, 1, Bytes8{0, 255, 0, 255, 0, 255});
    expectValues("P2 2 1 # wide\n255 7 255", 1, 0, Bytes8{7, 255});
    expectValues("P2 3 1 100 0 50 100\n", 1, 100, Bytes8{0, 128, 255});
    expectValues("P3 1 1 65535 1 32768 65535", 3, 0, Words{1, 32768, 65535});
    expectValues("P6 1 1 255\nabc", 3, 0, Bytes8{'a', 'b', 'c'});
    expectValues(std::string("P5 3 1 65535\n\x80\x00\xff\xff\x00\x01", 19), 1, 0,
                 Words{32768, 65535, 1});
    expectValues(std::string("P5 2 1 30000\n\x75\x30\x3a\x98", 17), 1, 30000, Words{65535, 32768});
}

TEST(Pnm, WhatIsMissingOrTooLargeIsASentence) {
    const auto expectError = [](const std::string& text, const char* message) {
        const auto image = decoded(text);
        ASSERT_FALSE(image) << text;
        EXPECT_EQ(image.error().code, ErrorCode::invalidInput);
        EXPECT_EQ(image.error().text(), std::string("'a.pgm': ") + message);
    };
    expectError("P5 2 2 255\nabc", "3 bytes of pixels; 2x2 need 4 (is the file cut short?)");
    expectError("P2 2 2 255\n1 2 3", "3 of 4 values are there (is the file cut short?)");
    expectError("P2 2 1 9\n1 10",
                "the value at column 1, row 0 is 10; the header names 9 as the "
                "largest");
    for (const char* header : {"P5 2", "P5 2 2 0\n", "P5 2 2 70000\n", "P5 2 -2 255\n"})
        expectError(header,
                    "the header is not that of a PNM: 'P5', width, height and the largest "
                    "value, 1 to 65535, are expected");
    expectError("P4 2", "the header is not that of a PNM: 'P4', width, height are expected");
    EXPECT_FALSE(decoded("P5 0 2 255\n"));
    EXPECT_FALSE(decoded("P5 60000 60000 255\nabc"));
}

}  // namespace
}  // namespace stx
