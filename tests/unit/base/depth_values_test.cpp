#include "lib/model/depth_values.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <random>
#include <vector>

#include "lib/model/reference_view.hpp"
#include "tests/every_target.hpp"

namespace stx {
namespace {

/// Distances of 2 to 9 with holes.
std::vector<float> someDistances(std::size_t count, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> distance(2.0f, 9.0f);
    std::vector<float> values(count);
    for (float& v : values) v = random() % 5 == 0 ? kNoDepth : distance(random);
    return values;
}

TEST(DepthValues, ASummaryCountsPointsAndFindsTheirRange) {
    onEveryTarget([] {
        for (const std::size_t count : {0, 1, 7, 64, 129}) {
            const auto values = someDistances(count, 1);
            DepthSummary expected;
            for (const float v : values) {
                if (!hasPoint(v)) continue;
                ++expected.points;
                expected.nearest = std::min(expected.nearest, v);
                expected.farthest = std::max(expected.farthest, v);
            }
            const DepthSummary found = summariseDepth(values);
            EXPECT_EQ(found.points, expected.points);
            EXPECT_EQ(found.nearest, expected.nearest);
            EXPECT_EQ(found.farthest, expected.farthest);
            EXPECT_FALSE(found.wrong);
        }
    });
}

TEST(DepthValues, ASummaryTellsWhatIsNoDistance) {
    onEveryTarget([] {
        for (const float wrong : {NAN, -1.0f}) {
            for (std::size_t at = 0; at < 70; ++at) {
                std::vector<float> values(70, 3.0f);
                values[at] = wrong;
                EXPECT_TRUE(summariseDepth(values).wrong) << at;
            }
        }
    });
}

TEST(DepthValues, PointsAreRoundedToTheirCodeBitForBit) {
    onEveryTarget([] {
        for (const unsigned dmax : {255u, 65535u}) {
            const DepthCode code{2.5, 7.75, dmax};
            auto values = someDistances(1003, 3);
            // Half way between two codes.
            for (std::uint32_t d = 1; d < 200; ++d)
                values[d] = static_cast<float>(0.5 * (code.decode(d) + code.decode(d + 1)));
            auto rounded = values;
            roundToCode(rounded, code);
            for (std::size_t i = 0; i < values.size(); ++i) {
                const auto expected = static_cast<float>(code.decode(code.encode(values[i])));
                EXPECT_EQ(std::bit_cast<std::uint32_t>(rounded[i]),
                          std::bit_cast<std::uint32_t>(expected))
                    << i << ": " << values[i];
            }
        }
    });
}

TEST(DepthValues, BoundsAreThoseOfAllPointsBitForBit) {
    onEveryTarget([] {
        for (const bool orthographic : {false, true}) {
            ReferenceView view;
            view.camera = Camera::fromFieldOfView({0.3, -2.7, 11.1},
                                                  glm::normalize(glm::dquat(0.9, 0.1, -0.3, 0.25)),
                                                  {1.1, 0.7}, orthographic, 37, 21);
            view.depth = Image<float>(37, 21);
            const auto values = someDistances(view.depth.count(), 4);
            std::copy(values.begin(), values.end(), view.depth.data());
            Bounds expected;
            for (int y = 0; y < 21; ++y)
                for (int x = 0; x < 37; ++x)
                    if (hasPoint(view.depth.at(x, y))) expected.add(view.worldPoint(x, y));
            EXPECT_EQ(boundsOfPoints(view.depth, view.camera), expected);
        }
        EXPECT_TRUE(boundsOfPoints(Image<float>(9, 9, kNoDepth), {}).empty());
    });
}

}  // namespace
}  // namespace stx
