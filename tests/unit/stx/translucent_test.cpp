#include <gtest/gtest.h>

#include "formats/stx/stx.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// A square of 2 x 2 of red glass that lets 7 tenths through.
Mesh glass() {
    Mesh mesh;
    mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.triangleMaterial = {0, 0};
    Material m;
    m.name = "glass";
    m.baseColour = {1, 0, 0, 0.3f};
    m.alpha = Material::Alpha::blend;
    mesh.materials = {m};
    return mesh;
}

ConvertSettings oneView() {
    ConvertSettings settings;
    settings.cameras = {*cameraAt({0, 0, 4}, {0, 0, 0}, {.width = 64, .height = 64})};
    return settings;
}

TEST(Translucent, EveryExactContainerKeepsTheAlpha) {
    Job job;
    const auto bundle = convert(glass(), oneView(), job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    TemporaryFolder folder;
    for (const char* name : {"a.exr", "a.mp4", "a.bt"}) {
        ASSERT_TRUE(save(*bundle, folder / name, {}, job)) << name;
        const auto back = open(folder / name, {}, job);
        ASSERT_TRUE(back) << name << ": " << back.error().text();
        const auto& view = std::get<Bundle>(*back).views[0];
        EXPECT_EQ(view.texture.rgba8()->at(32, 32), glm::u8vec4(255, 0, 0, 77)) << name;
        EXPECT_TRUE(hasPoint(view.depth.at(32, 32))) << name;
    }
    (void)job.takeNotes();
    ASSERT_TRUE(save(*bundle, folder / "j.mp4", {.jpegQuality = 90}, job));
    std::string notes;
    for (const auto& n : job.takeNotes()) notes += n + "\n";
    EXPECT_NE(notes.find("no alpha"), std::string::npos) << notes;
}

TEST(Translucent, SplatsKeepTheAlphaAndSurfacesAreWholeWithANote) {
    Job job;
    const auto bundle = convert(glass(), oneView(), job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    const auto camera = cameraAt({0.5, 0.3, 4}, {0, 0, 0}, {.width = 64, .height = 64});
    (void)job.takeNotes();
    for (const auto mode : {RenderMode::splat, RenderMode::surface}) {
        RenderSettings settings;
        settings.mode = mode;
        const auto frame = render(*bundle, *camera, settings, job);
        ASSERT_TRUE(frame) << frame.error().text();
        const auto picture = pictureOf(*frame).coded;
        const int alpha = mode == RenderMode::splat ? 77 : 255;
        for (int y = 26; y < 38; ++y) {
            for (int x = 26; x < 38; ++x) {
                EXPECT_NEAR(picture.at(x, y).w, alpha, 3) << x << ' ' << y;
                EXPECT_GE(picture.at(x, y).r, 250) << x << ' ' << y;
            }
        }
        const auto notes = job.takeNotes();
        EXPECT_EQ(std::any_of(notes.begin(), notes.end(),
                              [](auto& n) { return n.find("opaque") != std::string::npos; }),
                  mode == RenderMode::surface);
    }
    // The mesh itself is the truth.
    const auto truth = render(glass(), *camera, {}, job);
    ASSERT_TRUE(truth);
    EXPECT_NEAR(pictureOf(*truth).coded.at(32, 32).w, 77, 1);
}

}  // namespace
}  // namespace stx
