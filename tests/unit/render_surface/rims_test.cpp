// What is in front ends where its pixels end, and not half a pixel before, if their colour says so.

#include <gtest/gtest.h>

#include "lib/render/factory.hpp"
#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {
namespace {

constexpr int kPlateSide = 40, kPlateBegin = 10, kPlateEnd = 30;
constexpr std::uint8_t kPlateGrey = 50, kWallGrey = 200;
constexpr float kPlateDist = 3, kWallDist = 6;

/// A dark plate before a light wall. The pixels of its first column have the colour `first`.
Bundle plateBeforeWall(std::uint8_t first) {
    ReferenceView view;
    view.camera = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, glm::dvec2(0.9), false,
                                          kPlateSide, kPlateSide);
    view.nearPlane = 1;
    view.farPlane = 9;
    view.depth = Image<float>(kPlateSide, kPlateSide, kWallDist);
    Rgba8Image texture(kPlateSide, kPlateSide, glm::u8vec4(glm::u8vec3(kWallGrey), 255));
    for (int y = kPlateBegin; y < kPlateEnd; ++y)
        for (int x = kPlateBegin; x < kPlateEnd; ++x) {
            view.depth.at(x, y) = kPlateDist;
            const std::uint8_t grey = x == kPlateBegin ? first : kPlateGrey;
            texture.at(x, y) = glm::u8vec4(glm::u8vec3(grey), 255);
        }
    view.texture = Texture(std::move(texture));
    Bundle bundle;
    bundle.views = {view};
    return bundle;
}

bool isRimPixel(const SurfaceScene& scene, int x, int y) {
    const Source& s = scene.sources[0];
    const SourceBlock& block =
        s.blocks[static_cast<std::size_t>(y / kBlock * s.blocksX + x / kBlock)];
    return block.rims[static_cast<std::size_t>(y % kBlock)] >> x % kBlock & 1;
}

TEST(Rims, ArePixelsWithoutTheColourOfWhatIsBehind) {
    const Bundle bundle = plateBeforeWall((kPlateGrey + kWallGrey) / 2);
    const SurfaceScene scene(bundle);
    for (int y = kPlateBegin + 2; y < kPlateEnd - 2; ++y) {
        EXPECT_FALSE(isRimPixel(scene, kPlateBegin, y)) << y;  // mixed
        EXPECT_TRUE(isRimPixel(scene, kPlateEnd - 1, y)) << y;
        EXPECT_FALSE(isRimPixel(scene, kPlateEnd / 2, y)) << y;  // no edge
    }
    RenderSettings without;
    without.without.add(Stage::rims);
    EXPECT_FALSE(isRimPixel(SurfaceScene(bundle, without), kPlateEnd - 1, kPlateSide / 2));
}

TEST(Rims, OfSeveralViewsAreLeftToTheOthers) {
    Bundle bundle = plateBeforeWall(kPlateGrey);
    bundle.views.push_back(bundle.views[0]);
    bundle.views[1].camera.position.x += 1;
    EXPECT_FALSE(isRimPixel(SurfaceScene(bundle), kPlateEnd - 1, kPlateSide / 2));
}

TEST(Rims, AreDrawnWhole) {
    const Bundle bundle = plateBeforeWall(kPlateGrey);
    Camera aside = bundle.views[0].camera;
    // The plate moves by one and a half pixels, the wall by three quarters.
    aside.position.x += 1.5 * kPlateDist / aside.fx;
    const auto greyBeside = [&](const RenderSettings& settings) {
        Job job;
        const auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
        EXPECT_TRUE(renderer);
        const auto frame = (*renderer)->render(aside);
        EXPECT_TRUE(frame);
        return 255 * frame->colour.at(kPlateBegin - 2, kPlateSide / 2).r;
    };
    RenderSettings without;
    without.without.add(Stage::rims);
    constexpr float kHalf = (kPlateGrey + kWallGrey) / 2;
    EXPECT_NEAR(greyBeside({}), kHalf, 15);
    EXPECT_GT(greyBeside(without), kHalf + 25);
}

}  // namespace
}  // namespace stx::surface
