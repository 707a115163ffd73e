#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "lib/panorama/kernels.hpp"
#include "lib/panorama/panorama.hpp"

namespace stx::panorama {
namespace {

/// Bytes that are alike here and there, as descriptors are.
std::vector<Descriptor> someDescriptors(std::size_t count, std::mt19937& random) {
    std::vector<Descriptor> out(count);
    for (Descriptor& d : out) {
        const unsigned most = random() % 8 == 0 ? 256 : 40;
        for (auto& byte : d) byte = static_cast<std::uint8_t>(random() % most);
    }
    out[0].fill(0);
    out[count - 1].fill(255);
    return out;
}

}  // namespace

TEST(PanoramaKernels, DescriptorsAreComparedAsByAPlainLoop) {
    std::mt19937 random(3);
    for (const std::size_t count : {1u, 2u, 5u, 31u, 64u, 127u, 128u}) {
        const auto all = someDescriptors(count + 2, random);
        const Descriptor own = all[count % 2 == 0 ? count + 1 : 0];
        const auto sumOf = [](const Descriptor& d) {
            int sum = 0;
            for (const auto byte : d) sum += byte;
            return static_cast<std::int16_t>(sum);
        };
        std::vector<std::int16_t> sums, limits;
        for (std::size_t k = 0; k < count; ++k) {
            sums.push_back(sumOf(all[k]));
            limits.push_back(static_cast<std::int16_t>(random() % 32768));
        }
        const std::int16_t most = count == 31 ? kFarDescriptors : 3000;
        std::array<std::int16_t, kDescriptorBlock> distances{};
        std::array<std::uint8_t, kDescriptorBlock> indices{};
        const std::size_t found =
            nearDescriptors(own, sumOf(own), all.data(), sums.data(), limits.data(), count, most,
                            distances.data(), indices.data());
        std::vector<int> expected;
        for (std::size_t k = 0; k < count; ++k) {
            int distance = 0;
            for (std::size_t i = 0; i < own.size(); ++i)
                distance += std::abs(int{own[i]} - int{all[k][i]});
            EXPECT_EQ(distances[k], distance) << k << " of " << count;
            if (distance < std::max(most, limits[k])) expected.push_back(static_cast<int>(k));
        }
        EXPECT_EQ(std::vector<int>(indices.begin(), indices.begin() + static_cast<long>(found)),
                  expected);
    }
}

TEST(PanoramaKernels, AgreeingRaysAreCountedAsByAPlainLoop) {
    std::mt19937 random(5);
    const auto uniform = [&] { return static_cast<double>(random()) / 2147483648.0 - 1; };
    const glm::dmat3 turn = glm::mat3_cast(quatOf({0.1, -0.3, 0.2}));
    for (const std::size_t count : {1u, 7u, 8u, 61u}) {
        std::vector<double> columns(5 * count);
        std::size_t expected = 0;
        for (std::size_t k = 0; k < count; ++k) {
            // Some look backwards.
            const glm::dvec3 ray =
                glm::normalize(glm::dvec3(uniform(), uniform(), 0.3 * uniform() - 0.5));
            const glm::dvec3 there = turn * ray;
            const glm::dvec2 seen = 1.3 * glm::dvec2(there) / -there.z + 0.02 * uniform();
            for (int i = 0; i < 3; ++i) columns[static_cast<std::size_t>(i) * count + k] = ray[i];
            columns[3 * count + k] = seen.x;
            columns[4 * count + k] = seen.y;
            const glm::dvec2 off = 1.3 * glm::dvec2(there) / -there.z - seen;
            expected += there.z <= -0.02 && glm::length(off) < 0.01;
        }
        const double* c = columns.data();
        const RayMatches rays{c, c + count, c + 2 * count, c + 3 * count, c + 4 * count, count};
        EXPECT_EQ(countAgreeing(rays, turn, 1.3, 0.01, 0), expected);
        EXPECT_LE(countAgreeing(rays, turn, 1.3, 0.01, count), expected);
    }
}

TEST(PanoramaKernels, PositionsAreThoseOfTheLens) {
    constexpr int kWidth = 64;
    const glm::dquat worldFromCamera = quatOf({0.4, 0.9, -0.2});
    for (const double k1 : {0.0, -0.08, 0.05}) {
        const TurnLens lens{1.4, k1};
        for (const std::size_t count : {1u, 3u, 8u, 64u}) {
            for (int y = 0; y < kWidth / 2; ++y) {
                std::vector<double> sines, cosines, px(count), py(count);
                for (std::size_t x = 0; x < count; ++x) {
                    const double longitude =
                        M_PI * (1 - 2 * (static_cast<double>(x) + 0.5) / kWidth);
                    sines.push_back(std::sin(longitude));
                    cosines.push_back(std::cos(longitude));
                }
                const double latitude = M_PI * (0.5 - 2 * (y + 0.5) / kWidth);
                positionsOf({std::sin(latitude),
                             std::cos(latitude),
                             sines.data(),
                             cosines.data(),
                             count,
                             glm::mat3_cast(worldFromCamera),
                             lens,
                             {0.6, 0.8},
                             {300, 400}},
                            px.data(), py.data());
                for (std::size_t x = 0; x < count; ++x) {
                    const glm::dvec3 ray =
                        PanoramaImage::direction({static_cast<double>(x) + 0.5, y + 0.5}, kWidth);
                    const auto seen = lens.position(glm::inverse(worldFromCamera) * ray);
                    if (!seen) {
                        EXPECT_EQ(px[x], kNowhere);
                        continue;
                    }
                    const glm::dvec2 pixel((0.5 + seen->x / 1.2) * 300,
                                           (0.5 - seen->y / 1.6) * 400);
                    EXPECT_NEAR(px[x], pixel.x, 1e-9 * (1 + std::abs(pixel.x)));
                    EXPECT_NEAR(py[x], pixel.y, 1e-9 * (1 + std::abs(pixel.y)));
                }
            }
        }
    }
}

TEST(PanoramaKernels, ColoursBetweenPixelsFollowARampAndKeepThePixels) {
    Image<glm::u8vec4> ramp(9, 7);
    for (int y = 0; y < 7; ++y)
        for (int x = 0; x < 9; ++x)
            ramp.at(x, y) = glm::u8vec4(20 * x + 10, 30 * y + 20, 10 * x + 15 * y, 255);
    const std::vector<double> x = {0.5, 4.5, 8.5, 3.25, 5.0, -0.4, 9.3};
    const std::vector<double> y = {0.5, 2.5, 6.5, 2.75, 4.1, -0.4, 3.5};
    std::vector<glm::vec4> found(x.size());
    cubicColours(ramp, x.data(), y.data(), x.size(), found.data());
    for (std::size_t k = 0; k < 3; ++k) {
        const glm::u8vec4 pixel = ramp.at(static_cast<int>(x[k]), static_cast<int>(y[k]));
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[k][c] * 255, pixel[c], 1e-3);
    }
    for (std::size_t k = 3; k < 5; ++k) {
        EXPECT_NEAR(found[k].r * 255, 20 * x[k], 1e-3);
        EXPECT_NEAR(found[k].g * 255, 30 * y[k] + 5, 1e-3);
        EXPECT_NEAR(found[k].b * 255, 10 * x[k] + 15 * y[k] - 12.5, 1e-3);
    }
    // Beyond the edge, what is at the edge.
    EXPECT_NEAR(found[5].r * 255, 10, 2);
    EXPECT_NEAR(found[6].r * 255, 170, 2);
}

}  // namespace stx::panorama
