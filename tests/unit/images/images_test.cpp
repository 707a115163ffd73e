#include "formats/images/images.hpp"

#include <gtest/gtest.h>

#include <random>

#include "lib/base/parallel.hpp"
#include "tests/shared_data.hpp"

namespace stx {
namespace {

template <class T>
std::vector<T> randomValues(std::size_t count) {
    std::mt19937 random(7);
    std::vector<T> values(count);
    for (auto& v : values) v = static_cast<T>(random());
    return values;
}

Bytes bytesOf(std::initializer_list<int> list) {
    Bytes bytes;
    for (const int b : list) bytes.push_back(static_cast<std::byte>(b));
    return bytes;
}

bool holds(const Bytes& bytes, std::string_view text) {
    const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return all.find(text) != std::string_view::npos;
}

class PngOfEachKind : public testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(PngOfEachKind, ComesBackExactly) {
    const auto [channels, bits] = GetParam();
    const int width = 37, height = 23;
    const auto count = static_cast<std::size_t>(width) * height * channels;
    const auto values8 = randomValues<std::uint8_t>(count);
    const auto values16 = randomValues<std::uint16_t>(count);
    const void* values = bits == 8 ? static_cast<const void*>(values8.data()) : values16.data();
    const auto png = encodePng(width, height, channels, bits, values, true);
    ASSERT_TRUE(png) << png.error().text();

    const auto info = probeImage(*png);
    ASSERT_TRUE(info) << info.error().text();
    EXPECT_EQ(info->format, "png");
    EXPECT_EQ(info->width, width);
    EXPECT_EQ(info->height, height);
    EXPECT_EQ(info->channels, channels);
    EXPECT_EQ(info->bits, bits);

    const auto image = decodeImage(*png, "a.png", Limits());
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(image->width, width);
    EXPECT_EQ(image->height, height);
    EXPECT_EQ(image->channels, channels);
    ASSERT_EQ(image->bits(), bits);
    EXPECT_FALSE(image->linear);
    EXPECT_FALSE(image->premultiplied);
    // Random alpha beside random colour: any multiplying or dividing on the way would show.
    const bool same =
        bits == 8 ? std::get<0>(image->values) == values8 : std::get<1>(image->values) == values16;
    EXPECT_TRUE(same);
}

INSTANTIATE_TEST_SUITE_P(All, PngOfEachKind,
                         testing::Combine(testing::Values(1, 2, 3, 4), testing::Values(8, 16)));

TEST(Png, IsTaggedAndHoldsNoDate) {
    const auto values = randomValues<std::uint8_t>(16 * 16 * 4);
    const auto tagged = encodePng(16, 16, 4, 8, values.data(), true);
    const auto untagged = encodePng(16, 16, 4, 8, values.data(), false);
    ASSERT_TRUE(tagged && untagged);
    EXPECT_TRUE(holds(*tagged, "sRGB"));
    EXPECT_FALSE(holds(*untagged, "sRGB"));
    for (const auto* png : {&*tagged, &*untagged}) {
        EXPECT_FALSE(holds(*png, "tIME"));
        EXPECT_FALSE(holds(*png, "tEXt"));
        EXPECT_FALSE(holds(*png, "iTXt"));
    }
    EXPECT_EQ(*tagged, *encodePng(16, 16, 4, 8, values.data(), true));
}

TEST(Png, LevelsDifferInSizeOnly) {
    std::vector<std::uint8_t> values(256 * 256);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::uint8_t>(i / 91 * 7);
    const auto fast = encodePng(256, 256, 1, 8, values.data(), false, 0);
    const auto small = encodePng(256, 256, 1, 8, values.data(), false, 9);
    ASSERT_TRUE(fast && small);
    EXPECT_LT(small->size(), fast->size() / 4);
    EXPECT_EQ(std::get<0>(decodeImage(*small, "x", Limits())->values), values);
    EXPECT_EQ(std::get<0>(decodeImage(*fast, "x", Limits())->values), values);
}

TEST(Jpeg, IsNearAndSubsampledOnlyBelow90) {
    const int size = 64;
    std::vector<std::uint8_t> values(size * size * 3);
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            auto* p = &values[(y * size + x) * 3];
            p[0] = static_cast<std::uint8_t>(x * 4);
            p[1] = static_cast<std::uint8_t>(y * 4);
            p[2] = static_cast<std::uint8_t>(128);
        }
    }
    const auto jpeg = encodeJpeg(size, size, 3, values.data(), 95);
    ASSERT_TRUE(jpeg) << jpeg.error().text();
    const auto info = probeImage(*jpeg);
    ASSERT_TRUE(info);
    EXPECT_EQ(info->format, "jpeg");
    EXPECT_EQ(info->width, size);
    EXPECT_EQ(info->channels, 3);
    EXPECT_EQ(info->bits, 8);
    const auto image = decodeImage(*jpeg, "a.jpg", Limits());
    ASSERT_TRUE(image) << image.error().text();
    const auto& back = std::get<0>(image->values);
    ASSERT_EQ(back.size(), values.size());
    for (std::size_t i = 0; i < back.size(); ++i) EXPECT_NEAR(back[i], values[i], 5);

    // SOF0: the first component's sampling factors stand 11 bytes behind the marker.
    const auto sampling = [](const Bytes& bytes) {
        for (std::size_t i = 0; i + 12 < bytes.size(); ++i) {
            if (bytes[i] == std::byte{0xff} && bytes[i + 1] == std::byte{0xc0})
                return std::to_integer<int>(bytes[i + 11]);
        }
        return 0;
    };
    EXPECT_EQ(sampling(*jpeg), 0x11);
    EXPECT_EQ(sampling(*encodeJpeg(size, size, 3, values.data(), 60)), 0x22);
    EXPECT_FALSE(holds(*jpeg, "Exif"));
}

TEST(Decode, GoesByContentAndNotByName) {
    const auto values = randomValues<std::uint8_t>(8 * 8 * 3);
    const auto png = encodePng(8, 8, 3, 8, values.data(), true);
    ASSERT_TRUE(png);
    const auto image = decodeImage(*png, "photo.jpg", Limits());
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(std::get<0>(image->values), values);
}

TEST(Decode, ErrorsNameTheFile) {
    const auto empty = decodeImage({}, "none.png", Limits());
    ASSERT_FALSE(empty);
    EXPECT_EQ(empty.error().text(), "'none.png': the image file is empty");
    const auto noise = decodeImage(bytesOf({1, 2, 3, 4}), "noise", Limits());
    ASSERT_FALSE(noise);
    EXPECT_EQ(noise.error().code, ErrorCode::invalidInput);
    EXPECT_EQ(noise.error().where, "'noise'");
}

TEST(Decode, RefusesWhatTheLimitsForbid) {
    const auto values = randomValues<std::uint8_t>(64 * 64);
    const auto png = encodePng(64, 64, 1, 8, values.data(), false);
    ASSERT_TRUE(png);
    Limits small;
    small.maxMemoryBytes = 64 * 64 - 1;
    const auto memory = decodeImage(*png, "a.png", small);
    ASSERT_FALSE(memory);
    EXPECT_NE(memory.error().message.find("--max-memory"), std::string::npos);
    Limits side;
    side.maxImageSide = 63;
    EXPECT_FALSE(decodeImage(*png, "a.png", side));
    EXPECT_TRUE(decodeImage(*png, "a.png", Limits()));
}

TEST(Decode, RefusesWhatTheFileCannotHold) {
    // A PNG of 60000 x 60000 pixels in 100 bytes, with all the memory in the world allowed.
    Bytes png =
        bytesOf({0x89, 'P', 'N', 'G',  '\r', '\n', 0x1a, '\n', 0,    0, 0, 13, 'I', 'H', 'D',
                 'R',  0,   0,   0xea, 0x60, 0,    0,    0xea, 0x60, 8, 6, 0,  0,   0});
    png.resize(100);
    Limits vast;
    vast.maxMemoryBytes = 1ull << 50;
    const auto image = decodeImage(png, "bomb.png", vast);
    ASSERT_FALSE(image);
    EXPECT_NE(image.error().message.find("more than a file of 100 bytes can hold"),
              std::string::npos)
        << image.error().text();
}

TEST(Decode, TruncatedFileIsAnError) {
    const auto values = randomValues<std::uint8_t>(64 * 64 * 3);
    const auto png = encodePng(64, 64, 3, 8, values.data(), false);
    ASSERT_TRUE(png);
    const auto image = decodeImage(ByteSpan(*png).first(png->size() / 2), "half.png", Limits());
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().code, ErrorCode::invalidInput);
}

TEST(Decode, MalformedFilesEndInResultsOrErrors) {
    REQUIRE_SHARED(folder, "data/malformed/images");
    int files = 0;
    Limits limits;
    limits.maxMemoryBytes = 1ull << 30;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (!entry.is_regular_file()) continue;
        SCOPED_TRACE(entry.path().string());
        ++files;
        const auto bytes = readFile(entry.path(), limits);
        ASSERT_TRUE(bytes) << bytes.error().text();
        const auto image = decodeImage(*bytes, entry.path().filename().string(), limits);
        if (image) {
            EXPECT_GT(image->width, 0);
            (void)rgba8From(*image);
        } else {
            EXPECT_FALSE(image.error().message.empty());
        }
    }
    EXPECT_GT(files, 50);
}

TEST(Decode, IsSafeFromManyThreads) {
    std::vector<int> good(64, 0);
    parallelFor(0, 64, [&](std::int64_t i) {
        std::vector<std::uint8_t> values(32 * 32 * 4, static_cast<std::uint8_t>(i));
        const auto png = encodePng(32, 32, 4, 8, values.data(), true);
        if (!png) return;
        const auto image = decodeImage(*png, "t.png", Limits());
        good[i] = image && std::get<0>(image->values) == values;
    });
    for (const int ok : good) EXPECT_EQ(ok, 1);
}

TEST(Rgba8From, SpreadsGreyAndRounds16Bits) {
    DecodedImage grey;
    grey.width = 2;
    grey.height = 1;
    grey.channels = 1;
    grey.channelNames = {"Y"};
    grey.values = std::vector<std::uint16_t>{65535, 257 * 100 + 128};
    const auto image = rgba8From(grey);
    EXPECT_EQ(image.at(0, 0), glm::u8vec4(255, 255, 255, 255));
    EXPECT_EQ(image.at(1, 0), glm::u8vec4(100, 100, 100, 255));
}

TEST(Rgba8From, FindsChannelsByNameAndDividesPremultipliedFloats) {
    DecodedImage image;
    image.width = 1;
    image.height = 1;
    image.channels = 5;
    image.channelNames = {"Z", "A", "B", "G", "R"};
    image.linear = true;
    image.premultiplied = true;
    image.values = std::vector<float>{7.0f, 0.5f, 0.0f, 0.25f, 0.5f};
    EXPECT_EQ(rgba8From(image).at(0, 0), glm::u8vec4(255, 188, 0, 128));
}

TEST(Rgba8From, DividesPremultipliedColours) {
    // As TIFF has them with associated alpha; colours above the alpha are damage and stay in range.
    DecodedImage image;
    image.width = 3;
    image.height = 1;
    image.channels = 4;
    image.channelNames = {"R", "G", "B", "A"};
    image.premultiplied = true;
    image.values = std::vector<std::uint8_t>{100, 50, 0, 128, 9, 9, 9, 0, 200, 7, 0, 100};
    const auto bytes = rgba8From(image);
    EXPECT_EQ(bytes.at(0, 0), glm::u8vec4(199, 100, 0, 128));
    EXPECT_EQ(bytes.at(1, 0), glm::u8vec4(9, 9, 9, 0));
    EXPECT_EQ(bytes.at(2, 0), glm::u8vec4(255, 18, 0, 100));
    image.values = std::vector<std::uint16_t>{25700, 12850, 0, 32896, 0, 0, 0, 0, 0, 0, 0, 65535};
    EXPECT_EQ(rgba8From(image).at(0, 0), glm::u8vec4(199, 100, 0, 128));
}

TEST(Probe, FindsTransparencyAndPalettes) {
    Bytes png =
        bytesOf({0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n', 0,   0, 0, 13, 'I', 'H', 'D', 'R',
                 0,    0,   0,   3,   0,    0,    0,    2,    4,   3, 0, 0,  0,   0,   0,   0,
                 0,    0,   0,   0,   1,    't',  'R',  'N',  'S', 0, 0, 0,  0,   0});
    const auto info = probeImage(png);
    ASSERT_TRUE(info) << info.error().text();
    EXPECT_EQ(info->channels, 4);
    EXPECT_EQ(info->bits, 8);
    EXPECT_EQ(info->width, 3);
    EXPECT_EQ(info->height, 2);
}

TEST(Probe, OtherKindsAreUnsupported) {
    const auto info = probeImage(bytesOf({'B', 'M', 0, 0}));
    ASSERT_FALSE(info);
    EXPECT_EQ(info.error().code, ErrorCode::unsupported);
    EXPECT_FALSE(probeImage({}));
    EXPECT_FALSE(probeImage(bytesOf({0xff, 0xd8})));
    EXPECT_FALSE(probeImage(bytesOf({0xff, 0xd8, 0xff, 0xc0, 0, 17, 8})));
}

}  // namespace
TEST(Masks, GreyAndAlphaCountAndOneValueIsWhite) {
    const auto codes = [](std::initializer_list<glm::u8vec4> pixels) {
        Image<glm::u8vec4> picture(static_cast<int>(pixels.size()), 1);
        std::copy(pixels.begin(), pixels.end(), picture.data());
        std::string note;
        const auto mask = maskFrom(picture, note);
        return std::vector<int>(mask.pixels().begin(), mask.pixels().end());
    };
    using Codes = std::vector<int>;
    EXPECT_EQ(codes({{7, 7, 7, 255}, {99, 99, 99, 255}, {0, 0, 0, 255}}), (Codes{7, 99, 0}));
    EXPECT_EQ(codes({{255, 255, 255, 128}, {255, 255, 255, 255}}), (Codes{128, 255}));
    EXPECT_EQ(codes({{255, 0, 0, 255}, {0, 255, 0, 255}, {0, 0, 255, 255}}), (Codes{54, 182, 18}));
    EXPECT_EQ(codes({{0, 0, 1, 255}, {0, 0, 9, 255}, {0, 0, 0, 255}}), (Codes{0, 255, 0}));
    EXPECT_EQ(codes({{0, 0, 255, 255}, {255, 255, 255, 0}}), (Codes{255, 0}));
    EXPECT_EQ(codes({{0, 0, 0, 255}}), (Codes{0}));
}

TEST(Masks, LabelsOfEightAndSixteenBitsAreInside) {
    using Codes = std::vector<int>;
    const auto codes = [](std::initializer_list<int> greys, int largest, std::string& note) {
        Image<glm::vec4> fine(static_cast<int>(greys.size()), 1);
        Image<glm::u8vec4> coarse(fine.width(), 1);
        int x = 0;
        for (const int grey : greys) {
            const float code = static_cast<float>(grey) / static_cast<float>(largest);
            fine.at(x, 0) = glm::vec4(code, code, code, 1);
            coarse.at(x++, 0) = glm::u8vec4(grey, grey, grey, 255);
        }
        const auto mask = largest == 255 ? maskFrom(coarse, note) : maskFrom(fine, note);
        return Codes(mask.pixels().begin(), mask.pixels().end());
    };
    std::string note;
    EXPECT_EQ(codes({0, 1, 1}, 65535, note), (Codes{0, 255, 255}));
    EXPECT_EQ(note, "the one value of the mask beside 0, 1 of 65535, is taken for inside");
    EXPECT_EQ(codes({0, 1, 1}, 255, note), (Codes{0, 255, 255}));
    EXPECT_EQ(note, "the one value of the mask beside 0, 1 of 255, is taken for inside");
    note.clear();
    EXPECT_EQ(codes({0, 32768, 65535}, 65535, note), (Codes{0, 128, 255}));
    EXPECT_EQ(codes({0, 65535}, 65535, note), (Codes{0, 255}));
    EXPECT_EQ(codes({0, 255}, 255, note), (Codes{0, 255}));
    EXPECT_EQ(note, "");
}

}  // namespace stx
