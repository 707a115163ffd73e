#include "formats/images/npy.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace stx {
namespace {

/// What numpy.save() writes.
Bytes array(const std::string& type, const std::string& shape, const std::string& values,
            const char* order = "False") {
    std::string head =
        "{'descr': '" + type + "', 'fortran_order': " + order + ", 'shape': " + shape + ", }\n";
    const std::string text =
        std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(head.size()) + '\0' + head + values;
    Bytes bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
}

template <class Value>
std::string bytesOf(std::initializer_list<Value> values) {
    return {reinterpret_cast<const char*>(values.begin()), values.size() * sizeof(Value)};
}

template <class Value>
std::vector<Value> decoded(const Bytes& bytes) {
    const auto image = decodeImage(bytes, "a.npy", Limits());
    EXPECT_TRUE(image) << image.error().text();
    return image ? std::get<std::vector<Value>>(image->values) : std::vector<Value>();
}

std::string messageOf(const Bytes& bytes, const Limits& limits = Limits()) {
    const auto image = decodeImage(bytes, "a.npy", limits);
    EXPECT_FALSE(image);
    return image ? "" : image.error().text();
}

TEST(Numpy, TypesComeAsTheyAre) {
    EXPECT_EQ(decoded<float>(array("<f4", "(1, 2)", bytesOf<float>({1.5f, -2}))),
              (std::vector<float>{1.5f, -2}));
    EXPECT_EQ(decoded<float>(array("<f8", "(2, 1)", bytesOf<double>({0.25, 1e9}))),
              (std::vector<float>{0.25f, 1e9f}));
    EXPECT_EQ(decoded<float>(array("<f2", "(1, 3)", bytesOf<std::uint16_t>({0x3c00, 0xc100, 1}))),
              (std::vector<float>{1, -2.5f, std::ldexp(1.0f, -24)}));
    EXPECT_EQ(decoded<std::uint8_t>(array("|u1", "(1, 1, 3)", "\x01\x02\x03")),
              (std::vector<std::uint8_t>{1, 2, 3}));
    EXPECT_EQ(decoded<std::uint8_t>(array("|b1", "(1, 2)", bytesOf<char>({0, 1}))),
              (std::vector<std::uint8_t>{0, 255}));
    EXPECT_EQ(decoded<std::uint16_t>(array(">u2", "(1, 1)", "\x12\x34")),
              (std::vector<std::uint16_t>{0x1234}));
    EXPECT_EQ(decoded<std::uint16_t>(array("<i8", "(1, 2)", bytesOf<std::int64_t>({7, 65535}))),
              (std::vector<std::uint16_t>{7, 65535}));
}

TEST(Numpy, ColumnsFirstIsTurned) {
    EXPECT_EQ(decoded<float>(array("<f4", "(2, 3)", bytesOf<float>({1, 4, 2, 5, 3, 6}), "True")),
              (std::vector<float>{1, 2, 3, 4, 5, 6}));
}

TEST(Numpy, SaysWhatIsWrong) {
    EXPECT_NE(messageOf(array("<f4", "(2, 3)", "abcd")).find("(2, 3) needs 24"), std::string::npos);
    EXPECT_NE(messageOf(array("<f4", "(2, 3, 7)", "")).find("shape (2, 3, 7)"), std::string::npos);
    EXPECT_NE(messageOf(array("<c8", "(1, 1)", "abcdefgh")).find("'<c8'"), std::string::npos);
    EXPECT_NE(messageOf(array("<i4", "(1, 1)", bytesOf<int>({-3}))).find("-3"), std::string::npos);
    EXPECT_NE(messageOf(array("<f4", "(99999999, 99999999)", "")).find("a side"),
              std::string::npos);
    Limits small;
    small.maxMemoryBytes = 64;
    EXPECT_FALSE(decodeImage(array("<f4", "(8, 8)", std::string(256, 'a')), "a.npy", small));
}

TEST(Numpy, WhatIsWrittenIsRead) {
    Image<float> values(3, 2, 0.5f);
    values.at(2, 1) = INFINITY;
    const auto bytes = encodeNumpy(values);
    EXPECT_EQ(bytes.size() % 64, 24u);  // the values begin at a multiple of 64
    const auto image = decodeNumpy(bytes, Limits());
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(image->width, 3);
    EXPECT_EQ(std::get<2>(image->values).back(), INFINITY);
}

}  // namespace
}  // namespace stx
