// Depth of a picture whose lens is undone.

#include "formats/imagesets/resample.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "lib/geometry/depth_code.hpp"

using namespace stx;
using namespace stx::imagesets;

namespace {

constexpr int kSkewedSide = 48;

Camera coarseCamera() {
    Camera camera;
    camera.width = camera.height = kSkewedSide;
    camera.fx = camera.fy = 20;
    camera.cx = camera.cy = kSkewedSide * 0.5;
    return camera;
}

/// A lens that moves each row of pixels by another fraction of a pixel, so that the real picture of
/// a plane is linear in 1 / distance, too.
Lens skewed() {
    Lens lens;
    lens.skew = 1.5 / coarseCamera().fx;
    return lens;
}

/// Depth of the ideal picture, from that of the real one: inverse(x, y) of its pixel centres.
template <class Inverse>
Image<float> undistorted(const Inverse& inverse) {
    Image<float> depth(kSkewedSide, kSkewedSide);
    for (int y = 0; y < kSkewedSide; ++y)
        for (int x = 0; x < kSkewedSide; ++x)
            depth.at(x, y) = static_cast<float>(1.0 / inverse(x + 0.5, y + 0.5));
    const Texture texture(Rgba8Image(kSkewedSide, kSkewedSide, {9, 9, 9, 255}));
    return undistort(texture, depth, coarseCamera(), skewed(), {0, 0, kSkewedSide, kSkewedSide})
        .second;
}

}  // namespace

/// Steps of a wall that goes away are more than 2 % of the distance in a wide or coarse picture.
TEST(Undistort, SteepWallsAreNoStairs) {
    const auto inverse = [](double x, double y) { return 0.15 + 0.02 * x + 0.004 * y; };
    const Image<float> depth = undistorted(inverse);
    int seen = 0;
    for (int y = 2; y < kSkewedSide - 2; ++y)
        for (int x = 2; x < kSkewedSide - 2; ++x) {
            const glm::dvec2 real = skewed().realFromIdeal(coarseCamera(), {x + 0.5, y + 0.5});
            if (real.x < 1 || real.x > kSkewedSide - 1) continue;
            ++seen;
            EXPECT_NEAR(depth.at(x, y) * inverse(real.x, real.y), 1, 1e-5) << x << ", " << y;
        }
    EXPECT_GT(seen, kSkewedSide * kSkewedSide * 3 / 4);
}

/// No depth between two surfaces, flat or steep ones; up to their last pixel each goes on.
TEST(Undistort, NoDepthIsBetweenTwoSurfaces) {
    for (const double slope : {0.0, 0.004, 0.01}) {
        const auto far = [slope](double x) { return 0.1 + slope * x; };
        const auto near = [slope](double x) { return 1 + 3 * slope * x; };
        const Image<float> depth =
            undistorted([&](double x, double) { return x < 24 ? far(x) : near(x); });
        for (int y = 2; y < kSkewedSide - 2; ++y)
            for (int x = 4; x < kSkewedSide - 4; ++x) {
                const double real = skewed().realFromIdeal(coarseCamera(), {x + 0.5, y + 0.5}).x;
                const double q = 1.0 / depth.at(x, y);
                const double error = std::min(std::abs(q - far(real)), std::abs(q - near(real)));
                EXPECT_LT(error, 0.51 * 3 * slope + 1e-5) << slope << ": " << x << ", " << y;
            }
    }
}

/// A pixel that mixes two surfaces makes their edge two steps, which are no slope.
TEST(Undistort, AMixedPixelIsNoSlope) {
    const Image<float> depth = undistorted([](double x, double) {
        return x < 24 ? 0.1 : x < 25 ? 0.55 : 1.0;
    });
    for (int y = 2; y < kSkewedSide - 2; ++y)
        for (int x = 4; x < kSkewedSide - 4; ++x) {
            const double q = 1.0 / depth.at(x, y);
            EXPECT_LT(std::min({std::abs(q - 0.1), std::abs(q - 0.55), std::abs(q - 1)}), 1e-5);
        }
}

/// What a pinhole sees around the picture is left out, and nothing else: all of the part is shown,
/// and no side could be a pixel farther out with most of it shown.
TEST(ShownPart, IsTheRectangleThatThePictureShows) {
    Camera camera;
    camera.width = 120;
    camera.height = 80;
    camera.fx = camera.fy = 75;
    camera.cx = 57;
    camera.cy = 42;
    for (const double k1 : {0.25, 0.05, -0.1}) {
        SCOPED_TRACE(k1);
        Lens lens;
        lens.k1 = k1;
        const PixelRectangle part = lens.shownPart(camera);
        for (int y = part.y; y < part.y + part.height; ++y)
            for (int x = part.x; x < part.x + part.width; ++x)
                ASSERT_TRUE(lens.isShown(camera, {x + 0.5, y + 0.5})) << x << ", " << y;
        EXPECT_EQ(part.width % 2, 0);
        EXPECT_EQ(part.height % 2, 0);
        if (k1 < 0) {
            EXPECT_EQ(part.width, camera.width);
            EXPECT_EQ(part.height, camera.height);
            EXPECT_GT(lens.cutShare(camera, part), 0.02);
            continue;
        }
        EXPECT_LT(part.width, camera.width);
        int shown = 0;
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x)
                shown += lens.isShown(camera, {x + 0.5, y + 0.5}) ? 1 : 0;
        // The shown part bulges: a rectangle inside it is somewhat smaller.
        EXPECT_GT(part.width * part.height, 0.85 * shown);
        EXPECT_LT(lens.cutShare(camera, part), 0.2);
    }
}
