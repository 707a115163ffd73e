#include "lib/render/surface/prepare/source_rows.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/every_target.hpp"

namespace stx::surface {
namespace {

/// Whether b and c are one surface, as SurfaceScene has it.
bool linked(const DepthAxis& axis, float codeStep, float a, float b, float c, float d) {
    if (!(b > 0 && c > 0)) return false;
    const float step = c - b, size = std::abs(step), nearer = std::max(b, c);
    const float scale = axis.relativeScale(nearer);
    if (size < 0.005f * scale + 1.5f * codeStep * axis.qPerUnit(nearer)) return true;
    if (size >= std::max(0.03f, 8 * axis.pixelShare()) * scale) return false;
    return (a > 0 && std::abs(step - (b - a)) < 0.5f * size) ||
           (d > 0 && std::abs(step - (d - c)) < 0.5f * size);
}

/// Rows of q with small and large steps, background and pruned pixels.
std::vector<float> someRow(int width, std::mt19937& random) {
    std::vector<float> row(static_cast<std::size_t>(width));
    float q = 1.0f, slope = 0.0f;
    for (float& value : row) {
        if (random() % 9 == 0) slope = 0.002f * static_cast<float>(random() % 20) - 0.02f;
        if (random() % 17 == 0) q *= 1.02f;
        q = std::clamp(q + slope * q, 0.5f, 2.0f);
        value = random() % 13 == 0 ? 0.0f : random() % 29 == 0 ? -1.0f : q;
    }
    return row;
}

TEST(SourceRows, LinksAreThoseOfTheDefinitionAtAnyWidth) {
    onEveryTarget([] {
        std::mt19937 random(5);
        for (int width = 1; width < 70; ++width) {
            for (const bool inverse : {true, false}) {
                DepthAxis axis{inverse, 0.0, 2.0};
                axis.pixel = width % 3 == 0 ? 0.01 : 0.0;
                const float step = width % 2 ? 0.001f : 0.0f;
                const auto above = someRow(width, random), here = someRow(width, random),
                           below = someRow(width, random), second = someRow(width, random);
                const bool first = width % 3 == 0, last = width % 5 == 0;
                std::vector<std::uint8_t> info(static_cast<std::size_t>(width) + 1, 0xee);
                linkRow({above.data(), here.data(), below.data(), second.data(), first, last},
                        width, axis, step, info.data());
                EXPECT_EQ(info.back(), 0xee);
                const auto at = [&](int x) {
                    return x >= 0 && x < width ? here[static_cast<std::size_t>(x)] : -1.0f;
                };
                for (int x = 0; x < width; ++x) {
                    const auto i = static_cast<std::size_t>(x);
                    int expected = 0;
                    if (linked(axis, step, at(x - 1), at(x), at(x + 1), at(x + 2)))
                        expected |= Info::kLinkRight;
                    if (linked(axis, step, above[i], here[i], below[i], second[i]))
                        expected |= Info::kLinkDown;
                    if (here[i] > 0 && (at(x - 1) == 0 || at(x + 1) == 0 ||
                                        (!first && above[i] == 0) || (!last && below[i] == 0)))
                        expected |= Info::kBesideBackground;
                    ASSERT_EQ(info[i], expected) << x << " of " << width;
                }
            }
        }
    });
}

TEST(SourceRows, DistancesAreInvertedAndPixelsCounted) {
    onEveryTarget([] {
        std::mt19937 random(6);
        for (const std::size_t count : {0, 1, 15, 16, 67}) {
            std::vector<float> distances(count), q(count);
            std::vector<std::uint8_t> covered(count);
            DraftCounts expected;
            for (std::size_t i = 0; i < count; ++i) {
                distances[i] = random() % 3 == 0 ? kNoDepth
                               : random() % 9 == 0
                                   ? 0.0f
                                   : 0.1f + 0.001f * static_cast<float>(random() % 9999);
                covered[i] = random() % 2;
            }
            invertDistances(distances.data(), covered.data(), count, -1.0f, q.data());
            for (std::size_t i = 0; i < count; ++i) {
                const bool point = hasPoint(distances[i]) && distances[i] > 0;
                EXPECT_EQ(q[i], point        ? static_cast<float>(1.0 / distances[i])
                                : covered[i] ? -1.0f
                                             : 0.0f);
                expected.points += point;
                expected.covered += covered[i];
                expected.object += point || covered[i];
            }
            const DraftCounts found = countPixels(q.data(), covered.data(), count);
            EXPECT_EQ(found.points, expected.points);
            EXPECT_EQ(found.object, expected.object);
            EXPECT_EQ(found.covered, expected.covered);
        }
    });
}

TEST(SourceRows, ColoursOfOneSurfaceAreSharpened) {
    constexpr int kWidth = 70, kShare = 11, kFromEdge = 2;
    onEveryTarget([] {
        std::mt19937 random(7);
        std::vector<glm::u8vec4> from(3 * kWidth);
        std::vector<std::uint8_t> info(from.size());
        for (auto& p : from) p = glm::u8vec4(random(), random(), random(), random());
        for (auto& i : info)
            i = static_cast<std::uint8_t>((random() % 7 ? 3 : random() % 4) | (random() % 5) << 4);
        auto to = from;
        const std::size_t first = kWidth + 1, count = kWidth - 2;
        const std::size_t done = sharpenRow(from.data() + first, info.data() + first, kWidth, count,
                                            kFromEdge, kShare, to.data() + first);
        EXPECT_LE(done, count);
        for (std::size_t i = 0; i < from.size(); ++i) {
            glm::u8vec4 expected = from[i];
            if (i >= first && i < first + done && info[i] >> 4 >= kFromEdge && (info[i] & 3) == 3 &&
                (info[i - 1] & 1) && (info[i - kWidth] & 2)) {
                for (int k = 0; k < 3; ++k) {
                    const int beside =
                        from[i - 1][k] + from[i + 1][k] + from[i - kWidth][k] + from[i + kWidth][k];
                    const int more = ((4 * from[i][k] - beside) * kShare + 128) >> 8;
                    expected[k] = static_cast<std::uint8_t>(std::clamp(from[i][k] + more, 0, 255));
                }
            }
            ASSERT_EQ(to[i], expected) << i;
        }
    });
}

}  // namespace
}  // namespace stx::surface
