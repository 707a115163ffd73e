// Which libraries a process loads.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "formats/images/images.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

bool isLoaded(std::string_view library) {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
        if (line.find(library) != std::string::npos) return true;
    }
    return false;
}

/// In ctest each test is a process; run together, another test may have loaded the module before.
TEST(Codecs, PngAndJpegNeedNoModule) {
    if (isLoaded("stx_codecs")) GTEST_SKIP() << "another test has loaded the module";
    const TemporaryFolder folder;
    ::setenv("STX_CODECS", "/dev/null", 1);
    std::vector<std::uint8_t> values(64 * 64 * 4);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint8_t>(i * 7);
    const auto png = encodePng(64, 64, 4, 8, values.data(), true);
    const auto jpeg = encodeJpeg(64, 64, 3, values.data(), 92);
    ASSERT_TRUE(png && jpeg);
    ASSERT_TRUE(writeFile(folder / "a.png", *png));
    preloadCodecs(folder / "a.png");
    preloadCodecs(folder.path());
    EXPECT_TRUE(decodeImage(*png, "a.png", Limits()));
    EXPECT_TRUE(decodeImage(*jpeg, "a.jpg", Limits()));
    EXPECT_TRUE(decodeRgba8(*png, "a.png", Limits()));
    EXPECT_FALSE(isLoaded("libOpenImageIO"));
    EXPECT_FALSE(isLoaded("stx_codecs"));
    // What does need it says so here.
    const std::string bitmap = "BM";
    const auto other = decodeImage(std::as_bytes(std::span(bitmap)), "a.bmp", Limits());
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().code, ErrorCode::unsupported);
    ::unsetenv("STX_CODECS");
}

}  // namespace
}  // namespace stx
