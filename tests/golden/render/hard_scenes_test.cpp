// Scenes that sources disagree about: leaves and thin parts, which no pixel shows whole, creases,
// and a sheet without thickness. Novel views against pictures of another program and against the
// mesh.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "formats/any/open.hpp"
#include "formats/imagesets/camera_file.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/render/api/frame_picture.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "lib/render/factory.hpp"
#include "lib/render/mesh/mesh_renderer.hpp"
#include "tests/golden/tolerance.hpp"
#include "tests/naive_warp.hpp"
#include "tests/noisy_depth.hpp"
#include "tests/shared_data.hpp"
#include "tests/spheres_miv.hpp"

namespace stx {
namespace {

RenderSettings settingsOf(Quality quality) {
    RenderSettings s;
    s.quality = quality;
    return s;
}

/// PSNR of RGB on black, dB.
double psnr(const Frame& frame, const Image<glm::u8vec4>& truth) {
    const auto compared = compare(rgba8From(frame, glm::vec3(0.0f)), truth, {});
    return compared ? compared->psnrRgb.value_or(99) : 0;
}

struct Set {
    const char* name;
    double normal, best;  ///< dB, mean of the novel views
};

class HardScenes : public testing::TestWithParam<Set> {};

TEST_P(HardScenes, NovelViewsStayAsGood) {
    const Set& set = GetParam();
    REQUIRE_SHARED(folder, std::string("data/imagesets/") + set.name);
    Job job;
    const auto bundle = readImageSet(folder / "transforms.json", {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    const auto cameras = readCameraFile(folder / "transforms_test.json", job);
    ASSERT_TRUE(cameras) << cameras.error().text();
    const auto mean = [&](Quality quality) {
        const auto renderer = makeRenderer(Backend::cpu, *bundle, settingsOf(quality), -1, job);
        double sum = 0;
        for (std::size_t i = 0; i < cameras->size(); ++i) {
            const auto frame = (*renderer)->render((*cameras)[i].camera);
            sum += psnr(*frame, spheres::picture(folder / fmt::format("test/rgb_{:03}.png", i)));
        }
        return sum / static_cast<double>(cameras->size());
    };
    const double normal = mean(Quality::normal), best = mean(Quality::best);
    std::printf("%s: normal %.2f dB, best %.2f dB\n", set.name, normal, best);
    EXPECT_GT(normal, set.normal - kTolerance);
    EXPECT_GT(best, set.best - kTolerance);
    // Of few views normal takes nearly all, as best does.
    EXPECT_GE(best, normal - 0.05);
}

INSTANTIATE_TEST_SUITE_P(Sets, HardScenes,
                         testing::Values(Set{"statue", 43.35, 43.35}, Set{"oaktree", 31.3, 31.7}),
                         [](const auto& set) { return std::string(set.param.name); });

struct Faults {
    const char* set;
    const char* kind;  ///< see noisy::damage()
    double best;       ///< dB
    int view = 0;      ///< the novel view
};

class FaultySources : public testing::TestWithParam<Faults> {};

TEST_P(FaultySources, StaysAboveTheNaiveWarp) {
    const Faults& faults = GetParam();
    REQUIRE_SHARED(folder, std::string("data/imagesets/") + faults.set);
    Job job;
    auto bundle = readImageSet(folder / "transforms.json", {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_TRUE(noisy::damage(*bundle, faults.kind));
    const auto cameras = readCameraFile(folder / "transforms_test.json", job);
    ASSERT_TRUE(cameras) << cameras.error().text();
    const Camera& camera = (*cameras)[static_cast<std::size_t>(faults.view)].camera;
    const auto truth =
        spheres::picture(folder / ("test/rgb_00" + std::to_string(faults.view) + ".png"));
    double naive = 0;
    for (const ReferenceView& view : bundle->views)
        naive = std::max(naive, *compare(naiveWarp(view, camera).picture, truth)->psnrRgb);
    const auto renderer = makeRenderer(Backend::cpu, *bundle, settingsOf(Quality::best), -1, job);
    const double best = psnr(*(*renderer)->render(camera), truth);
    std::printf("%s, %s: best %.2f dB, naive warp %.2f dB\n", faults.set, faults.kind, best, naive);
    EXPECT_GT(best, faults.best - kTolerance);
    EXPECT_GT(best, naive);
}

INSTANTIATE_TEST_SUITE_P(
    Sets, FaultySources,
    testing::Values(Faults{"statue", "noise0.5", 42.85}, Faults{"statue", "noise2", 37.9},
                    // Looks at the backs of what most views see, where votes leave holes.
                    Faults{"statue", "noise0.5", 38.5, 3}, Faults{"statue", "missing3", 45.75},
                    Faults{"statue", "edges1", 45.2}, Faults{"statue", "light", 45.3},
                    Faults{"oaktree", "edges1", 26.95}, Faults{"oaktree", "noise0.5", 28.85},
                    Faults{"oaktree", "noise2", 27.1}),
    [](const auto& faults) {
        std::string name = std::string(faults.param.set) + faults.param.kind;
        if (faults.param.view) name += "view" + std::to_string(faults.param.view);
        std::erase(name, '.');
        return name;
    });

// What the step `mixed` of refining is worth: splats of pixels that hang between two surfaces cover
// what is behind them.
TEST(FlyingPixels, AreWorthLeavingOutOfSplats) {
    constexpr int kViews = 4;
    const auto cameraAt = [](double index) {
        return analyticCamera(AnalyticScene::room, index, kViews).resized(480, 360);
    };
    Bundle bundle;
    for (int i = 0; i < kViews; ++i)
        bundle.views.push_back(viewOfAnalyticScene(AnalyticScene::room, cameraAt(i), 2));
    noisy::mixEdges(bundle, 0.5);
    const auto truth = viewOfAnalyticScene(AnalyticScene::room, cameraAt(1.5), 2);
    const auto drawn = [&](const char* steps) {
        RenderSettings settings;
        settings.mode = RenderMode::splat;
        settings.refine = *RefineSettings::from(steps);
        Job job;
        const auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
        EXPECT_TRUE(renderer);
        const auto frame = (*renderer)->render(truth.camera);
        EXPECT_TRUE(frame);
        return psnr(*frame, *truth.texture.rgba8());
    };
    const double with = drawn("auto,mixed"), without = drawn("auto");
    std::printf("without flying pixels %.2f dB, with them %.2f\n", with, without);
    EXPECT_GT(with, without + kTolerance);
}

// A sheet whose border every view shows: each more view could bite another piece out of it.
TEST(HardScenesPlane, BetterQualityIsNoWorseOnATwoSidedSheet) {
    REQUIRE_SHARED(path, "data/meshes/gltf/draco-repo/TwoSidedPlane/glTF/TwoSidedPlane.gltf");
    Job job;
    auto opened = openRenderable(path, {}, job);
    ASSERT_TRUE(opened) << opened.error().text();
    const Mesh mesh = std::get<Mesh>(std::move(*opened));
    const double degree = std::numbers::pi / 180;
    const auto views =
        layoutCameras(*parseViewLayout("sphere:16"),
                      {.width = 512, .height = 512, .fovRad = 35 * degree}, mesh.positions);
    const auto bundle = captureBundle(mesh, *views, {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    const glm::dvec3 eye(0, 3, 1);
    const Camera camera = Camera::fromFieldOfView(eye, *lookAt(eye, {0, 0, 0}, {0, 1, 0}),
                                                  {50 * degree, 50 * degree}, false, 512, 512);
    const auto truth = makeMeshRenderer(mesh, settingsOf(Quality::best), job)->render(camera);
    double last = 30;
    for (const Quality quality : {Quality::normal, Quality::best}) {
        const auto renderer = makeRenderer(Backend::cpu, *bundle, settingsOf(quality), -1, job);
        const auto frame = (*renderer)->render(camera);
        const double reached = psnr(*frame, rgba8From(*truth, glm::vec3(0.0f)));
        EXPECT_GE(reached, last);
        last = reached;
    }
    EXPECT_GT(last, 54.6 - 3 * kTolerance);
}

}  // namespace
}  // namespace stx
