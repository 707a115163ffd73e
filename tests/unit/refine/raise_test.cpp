#include "lib/refine/raise.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

constexpr int kWide = 240, kHigh = 160, kFactor = 8;

/// A slanted wall behind a slanted board with a wavy edge, which is of another colour.
bool inFront(double x, double y) {
    return x < 110.3 + 14 * std::sin(y / 17);
}
double distance(double x, double y) {
    return inFront(x, y) ? 1 / (0.9 + 0.0006 * y) : 1 / (0.3 + 0.0004 * x);
}

struct RaisedScene {
    Texture picture;
    Image<float> depth, truth;
};

RaisedScene scene(bool wallIsThere) {
    Rgba8Image picture(kWide, kHigh);
    Image<float> truth(kWide, kHigh, kNoDepth), depth(kWide / kFactor, kHigh / kFactor, kNoDepth);
    for (int y = 0; y < kHigh; ++y)
        for (int x = 0; x < kWide; ++x) {
            const bool front = inFront(x + 0.5, y + 0.5);
            // Some texture on both, less than between them.
            const auto light = static_cast<std::uint8_t>(10 * ((x / 5 + y / 7) % 3));
            picture.at(x, y) = front ? glm::u8vec4(190 + light, 120, 60, 255)
                                     : glm::u8vec4(60, 110 + light, 170, 255);
            if (front || wallIsThere)
                truth.at(x, y) = static_cast<float>(distance(x + 0.5, y + 0.5));
        }
    for (int y = 0; y < depth.height(); ++y)
        for (int x = 0; x < depth.width(); ++x) {
            const double px = (x + 0.5) * kFactor, py = (y + 0.5) * kFactor;
            if (inFront(px, py) || wallIsThere)
                depth.at(x, y) = static_cast<float>(distance(px, py));
        }
    return {Texture(std::move(picture)), std::move(depth), std::move(truth)};
}

bool nearlySame(float a, float b) {
    return hasPoint(a) == hasPoint(b) && (!hasPoint(a) || std::abs(a / b - 1) < 0.02f);
}

/// The depth on the pixels of the picture, whose size is a multiple of the depth's.
Image<float> raisedTo(const Texture& picture, const Image<float>& depth) {
    const int width = depth.width(), factor = picture.width() / width;
    RgbaFloatImage coarse(width, depth.height(), glm::vec4(0));
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x)
            coarse.at(x / factor, y / factor) +=
                picture.at(x, y) / static_cast<float>(factor * factor);
    return raiseDepth(depth, picture, Texture(std::move(coarse)));
}

TEST(RaiseDepth, PutsEdgesWhereThePictureHasThem) {
    for (const bool wall : {true, false}) {
        const RaisedScene s = scene(wall);
        const Image<float> raised = raisedTo(s.picture, s.depth);
        ASSERT_EQ(raised.width(), kWide);
        int wrong = 0, wrongOfNearest = 0;
        for (int y = 0; y < kHigh; ++y)
            for (int x = 0; x < kWide; ++x) {
                wrong += !nearlySame(raised.at(x, y), s.truth.at(x, y));
                wrongOfNearest +=
                    !nearlySame(s.depth.at(x / kFactor, y / kFactor), s.truth.at(x, y));
            }
        EXPECT_GT(wrongOfNearest, 300);
        EXPECT_LT(wrong, wrongOfNearest / 10);
    }
}

TEST(RaiseDepth, MakesNoPointBetweenSurfaces) {
    const RaisedScene s = scene(true);
    const Image<float> raised = raisedTo(s.picture, s.depth);
    for (int y = 0; y < kHigh; ++y)
        for (int x = 0; x < kWide; ++x) {
            const float d = raised.at(x, y);
            const double front = 1 / (0.9 + 0.0006 * y), wall = 1 / (0.3 + 0.0004 * x);
            EXPECT_TRUE(std::abs(d - front) < 0.02 || std::abs(d - wall) < 0.05) << d;
        }
}

TEST(RaiseDepth, IsExactOnPlanes) {
    Image<float> depth(30, 20);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 30; ++x)
            depth.at(x, y) = static_cast<float>(1 / (0.5 + 0.002 * (x + 0.5) + 0.001 * (y + 0.5)));
    const Image<float> raised = raisedTo(Texture(Rgba8Image(90, 60, {9, 9, 9, 255})), depth);
    for (int y = 3; y < 57; ++y)
        for (int x = 3; x < 87; ++x)
            EXPECT_NEAR(raised.at(x, y), 1 / (0.5 + 0.002 * (x + 0.5) / 3 + 0.001 * (y + 0.5) / 3),
                        1e-5);
}

}  // namespace
}  // namespace stx
