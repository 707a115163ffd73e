// What no source saw: backgrounds of scenes that fill the frame.

#include <algorithm>

#include <gtest/gtest.h>

#include "lib/render/finish/fill.hpp"

namespace stx::surface {
namespace {

struct Picture {
    Image<glm::vec4> albedo;
    Image<float> q;
    PixelSpace space;

    Picture(int width, int height)
        : albedo(width, height, glm::vec4(0.0f)), q(width, height, 0.0f) {
        Camera camera;
        camera.width = width;
        camera.height = height;
        space = PixelSpace(camera, 10);
    }
    void close(int x, int y, const glm::vec3& colour, float depth) {
        albedo.at(x, y) = glm::vec4(colour, 1.0f);
        q.at(x, y) = depth;
    }
    void fill() { fillBackground({albedo, q, space}); }
    [[nodiscard]] int openPixels() const {
        const auto pixels = albedo.pixels();
        return static_cast<int>(std::count_if(pixels.begin(), pixels.end(),
                                              [](const glm::vec4& p) { return p.a < 0.999f; }));
    }
};

TEST(FillBackground, FarFromSurfaceItIsSmooth) {
    // Stripes on the left, nothing elsewhere: rays alone would carry each stripe across.
    constexpr int kWidth = 400, kHeight = 300, kSurface = 12;
    Picture p(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kSurface; ++x) p.close(x, y, glm::vec3(y / 2 % 2 ? 1.0f : 0.0f), 0.5f);
    p.fill();
    EXPECT_EQ(p.openPixels(), 0);
    float roughest = 0;
    for (int y = 1; y < kHeight; ++y)
        for (int x = kSurface + 100; x < kWidth; ++x)
            roughest = std::max(roughest, std::abs(p.albedo.at(x, y).r - p.albedo.at(x, y - 1).r));
    EXPECT_LT(roughest, 0.03f);
    EXPECT_NEAR(p.albedo.at(kWidth - 50, kHeight / 2).r, 0.5f, 0.1f);
    EXPECT_NEAR(p.q.at(kWidth - 50, kHeight / 2), 0.5f, 1e-4f);
}

TEST(FillBackground, AGapTakesTheColourAndTheDepthOfTheFartherSide) {
    constexpr int kWide = 64;
    Picture p(kWide, kWide);
    for (int y = 0; y < kWide; ++y) {
        for (int x = 0; x < 24; ++x) p.close(x, y, {1, 0, 0}, 1.0f);
        for (int x = 40; x < kWide; ++x) p.close(x, y, {0, 0, 1}, 0.1f);
    }
    p.fill();
    EXPECT_EQ(p.openPixels(), 0);
    for (int x = 24; x < 40; ++x) {
        EXPECT_LT(p.albedo.at(x, 32).r, 0.01f) << x;
        EXPECT_NEAR(p.q.at(x, 32), 0.1f, 0.01f) << x;
    }
}

TEST(FillBackground, OnePixelOfSurfaceFillsThePicture) {
    // No ray of most pixels meets it.
    Picture p(333, 77);
    p.close(332, 0, {0.25f, 0.5f, 0.75f}, 2.0f);
    p.fill();
    EXPECT_EQ(p.openPixels(), 0);
    EXPECT_NEAR(p.albedo.at(0, 76).b, 0.75f, 1e-3f);
    EXPECT_NEAR(p.q.at(0, 76), 2.0f, 1e-3f);
}

TEST(FillBackground, APictureWithoutSurfaceStaysOpen) {
    Picture p(70, 1);
    p.fill();
    EXPECT_EQ(p.openPixels(), 70);
}

}  // namespace
}  // namespace stx::surface
