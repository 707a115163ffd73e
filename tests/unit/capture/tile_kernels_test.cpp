#include "lib/capture/tile_kernels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "lib/capture/material_sampler.hpp"

namespace stx {
namespace {

MeshTexture noiseTexture(int width, int height, MeshTexture::Wrap wrap, std::mt19937& random) {
    MeshTexture texture;
    texture.pixels = Rgba8Image(width, height);
    for (auto& p : texture.pixels.pixels())
        for (int c = 0; c < 4; ++c) p[c] = static_cast<std::uint8_t>(random());
    texture.wrapU = texture.wrapV = wrap;
    return texture;
}

TEST(TileKernels, SumsOfTexelsAreThoseOfSampleTextureBitForBit) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    int whole = 0, refused = 0;
    for (const auto wrap :
         {MeshTexture::Wrap::repeat, MeshTexture::Wrap::mirror, MeshTexture::Wrap::clamp}) {
        const MeshTexture texture = noiseTexture(37, 23, wrap, random);
        for (const int side : {1, 2, 3, 4, 5, 8}) {
            const PixelSamples samples(side);
            for (int trial = 0; trial < 400; ++trial) {
                const int px = static_cast<int>(random() % 64),
                          py = static_cast<int>(random() % 64);
                const Affine total{0.002 * any(random), 0.002 * any(random), 1.0};
                // Around places inside the texture and a little beyond.
                const double reach = trial % 2 ? 0.01 : 0.1;
                Affine u{reach * any(random), reach * any(random), 0};
                Affine v{reach * any(random), reach * any(random), 0};
                u.c = (0.5 + 0.6 * any(random)) * total.at(px, py) - u.a * px - u.b * py;
                v.c = (0.5 + 0.6 * any(random)) * total.at(px, py) - v.a * px - v.b * py;
                glm::vec3 expected(0.0f);
                for (int k = 0; k < side * side; ++k) {
                    const double step = 1.0 / side;
                    const double x = px + (k % side + 0.5) * step, y = py + (k / side + 0.5) * step;
                    const double inverse = 1.0 / total.at(x, y);
                    expected += glm::vec3(
                        sampleTexture(texture, {static_cast<float>(u.at(x, y) * inverse),
                                                static_cast<float>(v.at(x, y) * inverse)}));
                }
                const auto sum = samples.sum(texture, u, v, total, px, py);
                ++(sum ? whole : refused);
                ASSERT_EQ(sum.value_or(expected), expected) << side << ' ' << trial;
            }
        }
    }
    // Both kinds occurred: most lie inside.
    EXPECT_GT(whole, 3000);
    EXPECT_GT(refused, 300);
}

TEST(TileKernels, ColoursOfATriangleAreThoseOfSampleTextureBitForBit) {
    std::mt19937 random(9);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    const MeshTexture texture = noiseTexture(40, 40, MeshTexture::Wrap::repeat, random);
    const PixelSamples samples(4);
    int found = 0;
    for (int trial = 0; trial < 1000; ++trial) {
        Affine edges[3];
        for (auto& e : edges) e = {0.05 * any(random), 0.05 * any(random), 1 + 0.5 * any(random)};
        std::array<glm::vec2, 3> uvs;
        for (auto& uv : uvs) uv = glm::vec2(0.5 + 0.4 * any(random), 0.5 + 0.4 * any(random));
        PixelColours colours;
        if (!samples.colours(texture, edges, uvs, 2, 3, colours)) continue;
        ++found;
        for (int k = 0; k < 16; ++k) {
            const double x = 2 + (k % 4 + 0.5) * 0.25, y = 3 + (k / 4 + 0.5) * 0.25;
            const double e0 = edges[0].at(x, y), e1 = edges[1].at(x, y), e2 = edges[2].at(x, y);
            const double scale = 1.0 / (e0 + e1 + e2);
            const glm::vec3 b(static_cast<float>(e0 * scale), static_cast<float>(e1 * scale),
                              static_cast<float>(e2 * scale));
            const glm::vec2 uv = uvs[0] * b.x + uvs[1] * b.y + uvs[2] * b.z;
            ASSERT_EQ(colours.at(k), glm::vec3(sampleTexture(texture, uv))) << trial << ' ' << k;
        }
    }
    EXPECT_GT(found, 900);
}

TEST(TileKernels, FarAndNearestTexturesAreLeftToThePlainLoop) {
    std::mt19937 random(6);
    MeshTexture texture = noiseTexture(16, 16, MeshTexture::Wrap::repeat, random);
    const PixelSamples samples(4);
    const Affine one{0, 0, 1}, middle{0, 0, 0.5}, far{0, 0, 2.5}, none{0, 0, NAN};
    EXPECT_TRUE(samples.sum(texture, middle, middle, one, 0, 0));
    EXPECT_FALSE(samples.sum(texture, far, middle, one, 0, 0));
    EXPECT_FALSE(samples.sum(texture, middle, none, one, 0, 0));
    EXPECT_FALSE(samples.sum(texture, middle, middle, {0, 0, 0}, 0, 0));
    texture.wrapU = texture.wrapV = MeshTexture::Wrap::clamp;
    EXPECT_FALSE(samples.sum(texture, none, middle, one, 0, 0));
    texture.nearest = true;
    EXPECT_FALSE(samples.sum(texture, middle, middle, one, 0, 0));
}

TEST(TileKernels, NearerSamplesAreThoseOfAPlainLoop) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    for (int trial = 0; trial < 500; ++trial) {
        std::vector<float> depth(60 + kSpanPadding), expectedDepth;
        std::vector<std::uint32_t> ids(depth.size(), 9), expectedIds;
        for (float& d : depth) d = static_cast<float>(any(random));
        expectedDepth = depth;
        expectedIds = ids;
        Span span;
        span.from = static_cast<int>(random() % 60);
        span.to = span.from + static_cast<int>(random() % (60 - span.from));
        span.origin = 100 * any(random);
        span.step = 0.25;
        span.slope = 0.1 * any(random);
        span.base = -span.slope * span.origin + any(random);
        span.perspective = trial % 2 == 0;
        span.slot = 3;
        for (int i = span.from; i <= span.to; ++i) {
            const double x = span.origin + i * span.step;
            const auto nearness = static_cast<float>(span.slope * x + span.base);
            if (span.perspective ? nearness <= 0.0f : nearness > 0.0f) continue;
            if (!(nearness > expectedDepth[i])) continue;
            expectedDepth[i] = nearness;
            expectedIds[i] = span.slot;
        }
        nearerSamples(span, depth.data(), ids.data());
        ASSERT_EQ(depth, expectedDepth) << trial;
        ASSERT_EQ(ids, expectedIds) << trial;
    }
}

TEST(TileKernels, NearerInsideIsThatOfAPlainLoop) {
    std::mt19937 random(8);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    std::size_t taken = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        Patch patch;
        patch.side = 32;
        patch.left = static_cast<int>(random() % 32);
        patch.right = std::min(31, patch.left + static_cast<int>(random() % 20) - 1);
        patch.top = static_cast<int>(random() % 32);
        patch.bottom = std::min(31, patch.top + static_cast<int>(random() % 20) - 1);
        patch.x = 100 * any(random);
        patch.y = 100 * any(random);
        patch.step = 0.25;
        patch.perspective = trial % 2 == 0;
        patch.slot = 3;
        const auto around = [&](double base) {
            const Affine f{any(random), any(random), 0};
            const double x = patch.x + patch.left * 0.25, y = patch.y + patch.top * 0.25;
            return Affine{f.a, f.b, base - f.a * x - f.b * y};
        };
        const Affine edges[] = {around(0), around(0.5), around(1)}, nearness = around(any(random));
        patch.edges = edges;
        patch.nearness = &nearness;
        std::vector<float> depth(32 * 32 + kSpanPadding, -0.5f);
        std::vector<std::uint32_t> ids(depth.size(), 9);
        auto expectedDepth = depth;
        auto expectedIds = ids;
        for (int row = patch.top; row <= patch.bottom; ++row) {
            for (int i = patch.left; i <= patch.right; ++i) {
                const double x = patch.x + i * patch.step, y = patch.y + row * patch.step;
                if (std::ranges::any_of(edges, [&](const Affine& e) { return !(e.at(x, y) >= 0); }))
                    continue;
                const auto near = static_cast<float>(nearness.at(x, y));
                if (patch.perspective ? near <= 0.0f : near > 0.0f) continue;
                const auto at = static_cast<std::size_t>(row) * 32 + i;
                if (!(near > expectedDepth[at])) continue;
                expectedDepth[at] = near;
                expectedIds[at] = 3;
                ++taken;
            }
        }
        nearerInside(patch, depth.data(), ids.data());
        ASSERT_EQ(depth, expectedDepth) << trial;
        ASSERT_EQ(ids, expectedIds) << trial;
    }
    EXPECT_GT(taken, 5000u);
}

}  // namespace
}  // namespace stx
