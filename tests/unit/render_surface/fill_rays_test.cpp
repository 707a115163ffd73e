#include "lib/render/surface/fill/fill_rays.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "lib/render/surface/fill/fill_half.hpp"

namespace stx::surface {
namespace {

/// Some pixels of surface; how far each pixel is from the nearest.
Image<std::uint8_t> someDistances(int width, int height, int surfaces, std::mt19937& random) {
    std::vector<glm::ivec2> places;
    for (int k = 0; k < surfaces; ++k)
        places.emplace_back(random() % static_cast<unsigned>(width),
                            random() % static_cast<unsigned>(height));
    Image<std::uint8_t> distances(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            int least = 255;
            for (const glm::ivec2& p : places)
                least = std::min(least, std::max(std::abs(p.x - x), std::abs(p.y - y)));
            distances.at(x, y) = static_cast<std::uint8_t>(least);
        }
    }
    return distances;
}

struct PlainRay {
    glm::vec2 start, direction;
    const Image<std::uint8_t>& distances;

    [[nodiscard]] std::int32_t pixelAt(float along) const {
        const float x = start.x + direction.x * along, y = start.y + direction.y * along;
        if (!(x >= 0 && y >= 0) || along > kLongestRay) return RayBatch::kNone;
        if (x >= static_cast<float>(distances.width()) ||
            y >= static_cast<float>(distances.height()))
            return RayBatch::kNone;
        return static_cast<int>(y) * distances.width() + static_cast<int>(x);
    }
    /// One step after the other; the length where it meets surface or ends.
    [[nodiscard]] float walk(float along) const {
        for (;;) {
            const std::int32_t pixel = pixelAt(along);
            if (pixel == RayBatch::kNone || distances.data()[pixel] == 0) return along;
            along += distances.data()[pixel];
        }
    }
};

TEST(FillRays, ABatchGoesAsRaysDoOneByOne) {
    std::mt19937 random(7);
    for (const auto& [width, height, surfaces] :
         {std::array{97, 61, 40}, std::array{700, 3, 1}, std::array{1, 1, 1}}) {
        const Image<std::uint8_t> distances = someDistances(width, height, surfaces, random);
        const DistanceWords words(distances);
        RayBatch batch(words);
        // A full one and others, which are the same batch used again.
        for (const std::size_t pixels : {kRayBatch, std::size_t{1}, kRayBatch - 3}) {
            std::vector<glm::ivec2> places;
            while (!batch.full() && batch.count() < pixels) {
                places.emplace_back(random() % static_cast<unsigned>(width),
                                    random() % static_cast<unsigned>(height));
                batch.add(places.back().x, places.back().y,
                          distances.at(places.back().x, places.back().y));
            }
            batch.walk();
            int met = 0;
            for (std::size_t i = 0; i < pixels; ++i) {
                for (std::size_t k = 0; k < kRays; ++k) {
                    const float angle = static_cast<float>(k) * (6.2831853f / kRays);
                    const PlainRay ray{
                        glm::vec2(places[i]) + 0.5f, {std::cos(angle), std::sin(angle)}, distances};
                    const float length = ray.walk(distances.at(places[i].x, places[i].y));
                    const RayBatch::Rays& rays = batch.rays()[k];
                    ASSERT_EQ(rays.rim[i], ray.pixelAt(length)) << i << " " << k;
                    if (rays.rim[i] == RayBatch::kNone) continue;
                    ++met;
                    EXPECT_EQ(rays.length[i], length);
                    EXPECT_EQ(rays.behind[i], ray.pixelAt(length + 1));
                }
            }
            EXPECT_GT(met, 0);
            batch.clear();
        }
    }
}

TEST(FillHalf, WhatItKeepsIsWhatHasAFilledPixelBeside) {
    std::mt19937 random(3);
    for (const auto& [width, height] : {std::array{67, 21}, std::array{64, 2}, std::array{1, 1}}) {
        Half half{Image<glm::vec4>((width + 1) / 2, (height + 1) / 2, glm::vec4(0.0f)),
                  Image<float>((width + 1) / 2, (height + 1) / 2, 0.0f),
                  Image<std::uint8_t>((width + 1) / 2, (height + 1) / 2, 0)};
        for (std::size_t i = 0; i < half.q.count(); ++i) {
            if (random() % 5 != 0) continue;
            half.q.data()[i] = 0.5f;
            half.albedo.data()[i] = glm::vec4(1.0f);
        }
        std::vector<std::uint8_t> filled;
        for (int y = 0; y < height; ++y) {
            std::vector<std::uint8_t> marks(static_cast<std::size_t>(width + width % 2), 9);
            half.keepFilled(y, marks, filled);
            for (int x = 0; x < width; ++x)
                EXPECT_EQ(marks[static_cast<std::size_t>(x)] == 9, half.at(x, y).q > 0.0f)
                    << x << " " << y;
        }
    }
}

TEST(FillHalf, OnlyWhatIsAmidFilledPixelsIsLikeThem) {
    Half half{Image<glm::vec4>(3, 2, glm::vec4(1.0f)), Image<float>(3, 2, 0.5f),
              Image<std::uint8_t>(3, 2, 0)};
    EXPECT_FALSE(half.at(1, 1).mixed);
    half.surface.at(1, 0) = 1;
    EXPECT_TRUE(half.at(1, 1).mixed);
    EXPECT_FALSE(half.at(0, 1).mixed);  // beside the border
    half.surface.at(1, 0) = 0;
    half.q.at(1, 0) = 0;
    EXPECT_TRUE(half.at(1, 1).mixed);
}

}  // namespace
}  // namespace stx::surface
