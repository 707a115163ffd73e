#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "formats/images/images.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// A small file of tests/fuzz/corpus; baseline, progressive, arithmetic and restarts hold the same
/// coefficients.
Bytes sample(const std::string& name) {
    const auto bytes =
        readFile(fs::path(STX_SOURCE_DIR) / "tests/fuzz/corpus/pictures" / name, Limits());
    EXPECT_TRUE(bytes) << bytes.error().text();
    return bytes.value_or(Bytes());
}

std::vector<std::uint8_t> pixelsOf(ByteSpan bytes) {
    const auto image = decodeImage(bytes, "a.jpg", Limits());
    EXPECT_TRUE(image) << image.error().text();
    if (!image) return {};
    const auto rgba = decodeRgba8(bytes, "a.jpg", Limits());
    EXPECT_TRUE(rgba && *rgba == rgba8From(*image));
    return std::get<0>(image->values);
}

std::size_t find(const Bytes& bytes, int marker, std::size_t from = 2) {
    for (std::size_t at = from; at + 1 < bytes.size(); ++at) {
        if (bytes[at] == std::byte{0xff} && bytes[at + 1] == static_cast<std::byte>(marker))
            return at;
    }
    return bytes.size();
}

TEST(JpegReader, AllCodingsOfAPictureGiveTheSamePixels) {
    const auto baseline = pixelsOf(sample("baseline.jpg"));
    EXPECT_EQ(baseline.size(), 20u * 12 * 3);
    EXPECT_EQ(pixelsOf(sample("progressive.jpg")), baseline);
    EXPECT_EQ(pixelsOf(sample("arithmetic.jpg")), baseline);
    EXPECT_EQ(pixelsOf(sample("restarts.jpg")), baseline);
}

TEST(JpegReader, InksBecomeRgb) {
    // Inverted inks: 200, 100, 50 of 255, and a black of 128 over them.
    for (const char* name : {"cmyk.jpg", "ycck.jpg"}) {
        const auto pixels = pixelsOf(sample(name));
        ASSERT_EQ(pixels.size(), 8u * 8 * 3) << name;
        EXPECT_NEAR(pixels[0], 200 * 128 / 255.0, 1.5) << name;
        EXPECT_NEAR(pixels[1], 100 * 128 / 255.0, 1.5) << name;
        EXPECT_NEAR(pixels[2], 50 * 128 / 255.0, 1.5) << name;
    }
}

TEST(JpegReader, TwoComponentsStayTwo) {
    const auto image = decodeImage(sample("two_components.jpg"), "a.jpg", Limits());
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(image->channels, 2);
    EXPECT_EQ(image->channelNames, (std::vector<std::string>{"R", "G"}));
}

TEST(JpegReader, CutOffFilesAreErrors) {
    for (const char* name : {"baseline.jpg", "arithmetic.jpg", "restarts.jpg"}) {
        const auto whole = sample(name);
        const auto pixels = pixelsOf(whole);
        // Only the end marker lacks: nothing is lost, but arithmetic codes do not show it.
        if (name != std::string_view("arithmetic.jpg")) {
            EXPECT_EQ(pixelsOf(ByteSpan(whole).first(whole.size() - 2)), pixels) << name;
        }
        const std::size_t scan = find(whole, 0xda);
        for (std::size_t size = 1; size < scan + 20; ++size)
            EXPECT_FALSE(decodeImage(ByteSpan(whole).first(size), "a", Limits())) << name << size;
    }
    const auto baseline = sample("baseline.jpg");
    const auto half = decodeImage(ByteSpan(baseline).first(baseline.size() - 100), "a", Limits());
    ASSERT_FALSE(half);
    EXPECT_EQ(half.error().message,
              fmt::format("the JPEG ends at byte {} before its last pixels; it is cut off",
                          baseline.size() - 100));
}

/// A baseline file of noise, 200x120.
Bytes noisyJpeg() {
    std::mt19937 random(3);
    std::vector<std::uint8_t> values(200 * 120 * 3);
    for (auto& v : values) v = static_cast<std::uint8_t>(random());
    return encodeJpeg(200, 120, 3, values.data(), 80).value();
}

/// Files whose middle lacks or says nothing. The library paints over it, and only warns.
std::vector<std::pair<std::string, Bytes>> damagedJpegs() {
    std::vector<std::pair<std::string, Bytes>> damaged;
    const auto with = [&](const std::string& name, const Bytes& whole) {
        const auto at = [&](std::size_t part) {
            return static_cast<std::ptrdiff_t>(whole.size() * part / 8);
        };
        Bytes zeroed = whole, cut = whole, ended = whole;
        std::fill(zeroed.begin() + at(4), zeroed.begin() + at(7), std::byte{0});
        cut.erase(cut.begin() + at(4), cut.begin() + at(7));
        ended[static_cast<std::size_t>(at(5))] = std::byte{0xff};
        ended[static_cast<std::size_t>(at(5)) + 1] = std::byte{0xd9};
        damaged.emplace_back(name + " zeroed", zeroed);
        damaged.emplace_back(name + " cut", cut);
        damaged.emplace_back(name + " ended", ended);
    };
    with("noise", noisyJpeg());
    // The first scans alone, with an end marker.
    const auto progressive = sample("progressive.jpg");
    std::size_t scan = find(progressive, 0xda);
    for (int i = 0; i < 2; ++i) scan = find(progressive, 0xda, scan + 2);
    Bytes first(progressive.begin(), progressive.begin() + static_cast<std::ptrdiff_t>(scan));
    first.insert(first.end(), {std::byte{0xff}, std::byte{0xd9}});
    damaged.emplace_back("first scans", first);
    return damaged;
}

TEST(JpegReader, DamagedFilesAreErrors) {
    EXPECT_TRUE(decodeImage(noisyJpeg(), "a.jpg", Limits()));
    for (const auto& [name, bytes] : damagedJpegs()) {
        const auto image = decodeImage(bytes, "a.jpg", Limits());
        ASSERT_FALSE(image) << name;
        EXPECT_EQ(image.error().code, ErrorCode::invalidInput) << name;
        EXPECT_NE(image.error().text().find("damaged: "), std::string::npos)
            << image.error().text();
        EXPECT_FALSE(decodeRgba8(bytes, "a.jpg", Limits())) << name;
    }
}

TEST(JpegReader, DamagedFilesAreKeptOnRequestAndNoted) {
    for (const auto& [name, bytes] : damagedJpegs()) {
        std::vector<std::string> notes;
        Limits keep;
        keep.keepDamaged = [&](std::string note) { notes.push_back(std::move(note)); };
        const auto image = decodeImage(bytes, "a.jpg", keep);
        ASSERT_TRUE(image) << name << ": " << image.error().text();
        EXPECT_FALSE(decodeImage(bytes, "a.jpg", Limits())) << "another's limits";
        ASSERT_EQ(notes.size(), 1u) << name;
        EXPECT_TRUE(notes[0].starts_with("'a.jpg': the JPEG is damaged (")) << notes[0];
        EXPECT_TRUE(decodeRgba8(bytes, "a.jpg", keep));
        EXPECT_FALSE(decodeImage(ByteSpan(bytes).first(40), "a.jpg", keep));  // no pixel yet
        (void)decodeImage(sample("baseline.jpg"), "b.jpg", keep);
        EXPECT_EQ(notes.size(), 2u) << "of whole files nothing is said";
    }
}

/// "1 extraneous bytes before marker 0xd9", as some cameras write.
TEST(JpegReader, AByteOfPaddingBeforeTheEndIsNoDamage) {
    auto bytes = noisyJpeg();
    bytes.insert(bytes.end() - 2, std::byte{0});
    EXPECT_TRUE(decodeImage(bytes, "a.jpg", Limits()));
}

TEST(JpegReader, TwelveBitsAreRefused) {
    auto bytes = sample("baseline.jpg");
    bytes[find(bytes, 0xc0) + 4] = std::byte{12};
    const auto image = decodeImage(bytes, "a.jpg", Limits());
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().text(),
              "'a.jpg': the JPEG's header is damaged: Unsupported JPEG data precision 12");
}

TEST(JpegReader, ThousandsOfScansAreRefused) {
    auto bytes = sample("grey_progressive.jpg");
    const std::size_t first = find(bytes, 0xda), second = find(bytes, 0xda, first + 2);
    ASSERT_LT(second, bytes.size());
    const std::size_t end = std::min(second, find(bytes, 0xc4, first));
    const Bytes scan(bytes.begin() + first, bytes.begin() + end);
    for (int i = 0; i < 2000; ++i) bytes.insert(bytes.begin() + first, scan.begin(), scan.end());
    const auto image = decodeImage(bytes, "a.jpg", Limits());
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().message, "the JPEG has more than 100 scans");
}

TEST(JpegReader, CoefficientsCountAgainstTheLimit) {
    Limits limits;
    limits.maxMemoryBytes = 20 * 12 * 3;
    EXPECT_TRUE(decodeImage(sample("baseline.jpg"), "a.jpg", limits));
    const auto image = decodeImage(sample("progressive.jpg"), "a.jpg", limits);
    ASSERT_FALSE(image);
    EXPECT_NE(image.error().message.find("--max-memory"), std::string::npos)
        << image.error().text();
}

TEST(JpegReader, WrongBytesNeverStopTheProcess) {
    for (const char* name : {"baseline.jpg", "progressive.jpg", "cmyk.jpg", "arithmetic.jpg"}) {
        const auto whole = sample(name);
        for (std::size_t i = 2; i < whole.size(); ++i) {
            for (const int value : {0x00, 0xff, 0xd8, 0x7f}) {
                auto changed = whole;
                changed[i] = static_cast<std::byte>(value);
                const auto image = decodeImage(changed, "a.jpg", Limits());
                EXPECT_TRUE(image || !image.error().message.empty());
            }
        }
    }
}

}  // namespace
}  // namespace stx
