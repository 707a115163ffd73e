#include "lib/refine/raise.hpp"

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "lib/base/parallel.hpp"
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

TEST(RaiseDepth, PutsEdgesWhereThePictureHasThem) {
    for (const bool wall : {true, false}) {
        const RaisedScene s = scene(wall);
        const Image<float> raised = raiseDepth(s.depth, s.picture);
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
    const Image<float> raised = raiseDepth(s.depth, s.picture);
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
    const Image<float> raised = raiseDepth(depth, Texture(Rgba8Image(90, 60, {9, 9, 9, 255})));
    for (int y = 3; y < 57; ++y)
        for (int x = 3; x < 87; ++x)
            EXPECT_NEAR(raised.at(x, y), 1 / (0.5 + 0.002 * (x + 0.5) / 3 + 0.001 * (y + 0.5) / 3),
                        1e-5);
}

/// A board of any outline before a wall.
struct Board {
    glm::dvec2 middle;
    std::vector<double> reach;  ///< from the middle to the outline, in equal steps of the angle
    double front, wall;         ///< 1/z

    [[nodiscard]] bool has(glm::dvec2 at) const {
        const glm::dvec2 off = at - middle;
        const double turn = std::atan2(off.y, off.x) / (2 * std::numbers::pi) + 0.5,
                     at01 = turn * static_cast<double>(reach.size());
        const auto k = static_cast<std::size_t>(at01) % reach.size();
        return glm::length(off) <
               glm::mix(reach[k], reach[(k + 1) % reach.size()], at01 - std::floor(at01));
    }
};

Board randomBoard(std::mt19937& random) {
    std::uniform_real_distribution<double> one(0, 1);
    Board board;
    board.middle = {kWide * (0.4 + 0.2 * one(random)), kHigh * (0.4 + 0.2 * one(random))};
    board.reach.resize(5 + random() % 12);
    const double rough = 0.5 * one(random);
    for (double& r : board.reach) r = 55 * (1 - rough * one(random));
    board.wall = 0.3 + 0.2 * one(random);
    board.front = board.wall * (1.1 + one(random));
    return board;
}

/// Pixels that are off with raised depth, with a matte of half the picture's size, too, and with
/// the nearest sample. Depth is reduced by the mean of 1/z.
struct WrongPixels {
    int raised = 0, withMatte = 0, nearest = 0;

    WrongPixels& operator+=(const WrongPixels& other) {
        raised += other.raised;
        withMatte += other.withMatte;
        nearest += other.nearest;
        return *this;
    }
};
WrongPixels wrongPixels(const Board& board, glm::vec3 front, glm::vec3 wall, float noise,
                        std::mt19937& random) {
    std::normal_distribution<float> grain(0, noise);
    Rgba8Image picture(kWide, kHigh);
    Image<float> inverse(kWide / kFactor, kHigh / kFactor, 0);
    Image<std::uint8_t> matte(kWide / 2, kHigh / 2, 0);
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            const bool has = board.has({x + 0.5, y + 0.5});
            inverse.at(x / kFactor, y / kFactor) +=
                static_cast<float>((has ? board.front : board.wall) / (kFactor * kFactor));
            matte.at(x / 2, y / 2) = static_cast<std::uint8_t>(matte.at(x / 2, y / 2) + 63 * has);
            const glm::vec3 c = (has ? front : wall) + grain(random);
            picture.at(x, y) = glm::u8vec4(glm::clamp(c, 0.0f, 255.0f), 255);
        }
    }
    Image<float> depth = inverse;
    for (float& d : depth.pixels()) d = 1 / d;
    const Texture texture(std::move(picture));
    const Image<float> raised = raiseDepth(depth, texture),
                       withMatte = raiseDepth(depth, texture, &matte);
    WrongPixels wrong;
    const double limit = 0.1 * (board.front - board.wall);
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x) {
            const double truth = board.has({x + 0.5, y + 0.5}) ? board.front : board.wall;
            const auto off = [&](float d) {
                return std::abs(1.0 / static_cast<double>(d) - truth) > limit;
            };
            wrong.raised += off(raised.at(x, y));
            wrong.withMatte += off(withMatte.at(x, y));
            wrong.nearest += off(depth.at(x / kFactor, y / kFactor));
        }
    }
    return wrong;
}

TEST(RaiseDepth, IsNeverWorseThanTheNearestSample) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> value(20, 235);
    const auto colour = [&] { return glm::vec3(value(random), value(random), value(random)); };
    WrongPixels unlike, same;
    for (int k = 0; k < 30; ++k) {
        const Board board = randomBoard(random);
        const glm::vec3 front = colour();
        glm::vec3 wall = colour();
        while (glm::distance(front, wall) < 60) wall = colour();
        const WrongPixels sharp = wrongPixels(board, front, wall, 12, random);
        EXPECT_LT(sharp.raised, 0.3 * sharp.nearest) << k;
        EXPECT_LE(sharp.withMatte, sharp.raised + 0.01 * sharp.nearest) << k;
        unlike += sharp;
        // Of one colour: only the depth tells where the edge is.
        const WrongPixels hidden = wrongPixels(board, front, front, 12, random);
        EXPECT_LT(hidden.raised, hidden.nearest) << k;
        // What is left are tips that no sample shows.
        EXPECT_LT(hidden.withMatte, 0.2 * hidden.nearest) << k;
        same += hidden;
    }
    std::printf("  of 100 wrong pixels %.1f stay, with a matte %.1f; of one colour %.1f, %.1f\n",
                100.0 * unlike.raised / unlike.nearest, 100.0 * unlike.withMatte / unlike.nearest,
                100.0 * same.raised / same.nearest, 100.0 * same.withMatte / same.nearest);
    EXPECT_LT(unlike.raised, 0.1 * unlike.nearest);
    EXPECT_LT(same.raised, 0.3 * same.nearest);
    EXPECT_LT(same.withMatte, 0.5 * same.raised);
}

TEST(RaiseDepth, AnyNumberOfThreadsGivesTheSameBytes) {
    // More rows than are done at a time.
    Rgba8Image picture(64, 600);
    Image<float> depth(16, 150);
    std::mt19937 random(5);
    for (auto& c : picture.pixels()) c = glm::u8vec4(random() % 256, random() % 256, 9, 255);
    for (float& d : depth.pixels()) d = random() % 3 == 0 ? 1.0f : 2.0f;
    const auto with = [&](int threads) {
        const ThreadLimit limit(threads);
        return raiseDepth(depth, Texture(picture));
    };
    EXPECT_EQ(with(1), with(4));
}

// Cut open, the cheek behind a nose showed the wall behind the head from the side.
TEST(RaiseDepth, SmallStepsStaySlopes) {
    Image<float> depth(10, 10);
    for (int y = 0; y < 10; ++y)
        for (int x = 0; x < 10; ++x) depth.at(x, y) = 1 / (x < 5 ? 1.0f : x == 5 ? 0.975f : 0.95f);
    const Image<float> raised =
        raiseDepth(depth, Texture(Rgba8Image(80, 80, glm::u8vec4(180, 140, 120, 255))));
    for (int y = 0; y < 80; ++y)
        for (int x = 1; x < 80; ++x)
            EXPECT_LT(std::abs(1 / raised.at(x, y) - 1 / raised.at(x - 1, y)), 0.03f)
                << x << " " << y;
}

// Beside an edge some pixels of a wall lie between samples and others on a plane; where they met
// there were steps, at which renderers cut the wall.
TEST(RaiseDepth, OneSurfaceHasNoSmallSteps) {
    Image<float> depth(30, 20);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 30; ++x) {
            const double bend = 0.016 * std::sin(0.9 * x + 0.5 * y);
            depth.at(x, y) = x < 12 + y % 3 ? 1.0f : static_cast<float>(2 / (1 + bend + 0.003 * y));
        }
    Rgba8Image picture(150, 100);
    for (int y = 0; y < 100; ++y)
        for (int x = 0; x < 150; ++x)
            picture.at(x, y) =
                x < 62 ? glm::u8vec4(180, 140, 120, 255) : glm::u8vec4(90, 90, 90, 255);
    const Image<float> raised = raiseDepth(depth, Texture(std::move(picture)));
    int edges = 0, small = 0;
    const auto count = [&](float a, float b) {
        const float step = std::abs(a - b) / std::max(a, b);
        edges += step > 0.3f;
        small += step > 0.005f && step < 0.02f;
    };
    for (int y = 1; y < 100; ++y)
        for (int x = 1; x < 150; ++x) {
            count(raised.at(x, y), raised.at(x - 1, y));
            count(raised.at(x, y), raised.at(x, y - 1));
        }
    EXPECT_GT(edges, 90);
    EXPECT_EQ(small, 0);
}

}  // namespace
}  // namespace stx
