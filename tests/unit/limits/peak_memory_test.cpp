#include "lib/model/peak_memory.hpp"

#include <gtest/gtest.h>

namespace stx {
namespace {

ReferenceView viewOf(int side, int rowsWithPoints) {
    ReferenceView view;
    view.camera.width = view.camera.height = side;
    view.depth = Image<float>(side, side, kNoDepth);
    view.texture = Rgba8Image(side, side);
    for (int y = 0; y < rowsWithPoints; ++y)
        for (int x = 0; x < side; ++x) view.depth.at(x, y) = 1;
    return view;
}

std::vector<ReferenceView> oneView(int side, int rowsWithPoints) {
    std::vector<ReferenceView> views;
    views.push_back(viewOf(side, rowsWithPoints));
    return views;
}

// A photograph with what is behind it was refused as a model: most of the background is empty.
TEST(PeakMemory, PixelsWithoutPointsTakeLessWhereAStepSaysSo) {
    constexpr std::uint64_t kPixels = 100 * 100, kHeld = 8 * kPixels;
    const auto views = oneView(100, 25);
    const auto fits = [&](const PeakMemory& step, std::uint64_t bytes) {
        Limits limits;
        limits.maxMemoryBytes = bytes;
        return checkPeak(step, views, limits).has_value();
    };
    const PeakMemory all{"work", 40, 8}, points{"work", 40, 8, 4};
    EXPECT_TRUE(fits(all, kHeld + 48 * kPixels));
    EXPECT_FALSE(fits(all, kHeld + 48 * kPixels - 1));
    EXPECT_TRUE(fits(points, kHeld + 48 * kPixels / 4 + 4 * kPixels * 3 / 4));
    EXPECT_FALSE(fits(points, kHeld + 48 * kPixels / 4 + 4 * kPixels * 3 / 4 - 1));
}

TEST(PeakMemory, ARefusalNamesWhatIsEnoughForAllThatFollows) {
    const auto views = oneView(1024, 1024);
    Limits limits;
    limits.maxMemoryBytes = 1 << 20;
    const auto refused = checkPeak(PeakMemory{"work", 2, 0, 2, 100}, views, limits);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().text().find("--max-memory 108 "), std::string::npos)
        << refused.error().text();
    EXPECT_FALSE(checkPeakOfTriangles(1 << 20, views, limits));
    limits.maxMemoryBytes = std::uint64_t{1} << 30;
    EXPECT_TRUE(checkPeakOfTriangles(1 << 20, views, limits));
}

}  // namespace
}  // namespace stx
