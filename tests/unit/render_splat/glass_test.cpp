#include <gtest/gtest.h>

#include "lib/render/splat/cpu/cpu_splat.hpp"
#include "lib/render/splat/prepared.hpp"

namespace stx {
namespace {

constexpr int kPaneSide = 96;

/// A pane that fills the picture, `distance` before a camera in the origin.
ReferenceView paneView(double distance, glm::vec4 colour, bool floats) {
    ReferenceView view;
    view.camera =
        Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.0, 1.0}, false, kPaneSide, kPaneSide);
    view.depth = Image<float>(kPaneSide, kPaneSide, static_cast<float>(distance));
    if (floats)
        view.texture = Texture(RgbaFloatImage(kPaneSide, kPaneSide, colour));
    else
        view.texture =
            Texture(Rgba8Image(kPaneSide, kPaneSide, glm::u8vec4(glm::round(colour * 255.0f))));
    view.nearPlane = 1;
    view.farPlane = 10;
    return view;
}

/// Glass with an alpha of less than one half had no depth, and was mixed with what is behind it.
TEST(SplatGlass, HidesWhatIsBehindWhateverItsAlphaIs) {
    const glm::dvec3 eye(0.2, 0.1, -1);
    const Camera camera =
        Camera::fromFieldOfView(eye, *lookAt(eye, {0, 0, -3}), {0.5, 0.5}, false, 64, 64);
    for (const bool floats : {false, true}) {
        for (const float alpha : {0.1f, 0.3f, 0.5f, 0.7f}) {
            Bundle bundle;
            bundle.views.push_back(paneView(6, {0, 0, 1, 1}, floats));
            bundle.views.push_back(paneView(3, {1, 0, 0, alpha}, floats));
            for (const auto rule : {SplatRule::data, SplatRule::paper}) {
                RenderSettings settings;
                settings.mode = RenderMode::splat;
                settings.splat = rule;
                Job job;
                const auto frame = makeCpuSplatRenderer(bundle, settings, job)->render(camera);
                ASSERT_TRUE(frame) << frame.error().text();
                for (std::size_t i = 0; i < frame->depth.count(); ++i) {
                    ASSERT_LT(frame->depth.data()[i], 3.0f) << alpha;
                    const glm::vec4 c = frame->colour.data()[i];
                    ASSERT_EQ(c.b, 0.0f) << alpha;
                    // An 8-bit code is off by half a step.
                    ASSERT_NEAR(c.a, alpha, 0.5f / 255 + 1e-4f) << alpha;
                }
            }
        }
    }
}

/// Glass is marked by the flag of links, which only opaque points have else.
TEST(SplatGlass, IsMarkedWhereItCoversHalfOfAPixel) {
    Bundle bundle;
    bundle.views.push_back(paneView(3, {1, 0, 0, 1}, false));
    const splat::PreparedPages opaque = splat::preparePages(bundle, false);
    EXPECT_FALSE(opaque.glass);
    // Glass to the left of column 40, which it covers a quarter of, in half of the blocks.
    for (int y = 0; y < kPaneSide; ++y)
        for (int x = 0; x <= 40; ++x)
            bundle.views[0].texture.rgba8()->at(x, y).a = x < 40 ? 60 : 15;
    const splat::PreparedPages glass = splat::preparePages(bundle, false);
    EXPECT_TRUE(glass.glass);
    for (const splat::BlockInfo& b : glass.rectangles[0].blocks) {
        EXPECT_EQ(b.glass, b.u0 < 40) << b.u0;
        EXPECT_EQ(b.opaque, b.u0 > 40) << b.u0;
        if (b.glass) {
            EXPECT_FALSE(b.linked) << b.u0;
        }
    }
    const auto slopeOf = [](const splat::PreparedPages& pages, int x, int y) {
        return pages.pages[0].slopes.data()[kPaneSide * y + x];
    };
    for (int y = 1; y + 1 < kPaneSide; ++y) {
        for (int x = 1; x + 1 < kPaneSide; ++x) {
            const splat::Slope now = slopeOf(glass, x, y), before = slopeOf(opaque, x, y);
            EXPECT_EQ((now.u & splat::Slope::kGlass) != 0, x != 40 && x != 41) << x << " " << y;
            EXPECT_EQ(now.u & ~splat::Slope::kGlass, before.u & ~splat::Slope::kGlass);
            EXPECT_EQ(now.v, before.v);
        }
    }
}

}  // namespace
}  // namespace stx
