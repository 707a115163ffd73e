// The real MIV set spheres-miv: the same images as PNG and as YUV planes.

#include <cmath>

#include <gtest/gtest.h>

#include "formats/images/images.hpp"
#include "formats/imagesets/camera_file.hpp"
#include "formats/imagesets/image_sets.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/render/factory.hpp"
#include "tests/shared_data.hpp"

using namespace stx;

namespace {

const ReferenceView& viewNamed(const Bundle& bundle, const std::string& name) {
    for (const auto& view : bundle.views)
        if (view.name == name) return view;
    throw std::runtime_error("no view " + name);
}

TEST(SpheresMiv, PngIsReadBeforeYuvAndAllSourcesAreThere) {
    REQUIRE_SHARED(set, "data/imagesets/spheres-miv");
    const auto kind = recogniseImageSet(set);
    ASSERT_TRUE(kind) << kind.error().text();
    EXPECT_EQ(*kind, "miv");
    Job job;
    const auto bundle = readImageSet(set, {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_EQ(bundle->views.size(), 4u);
    EXPECT_EQ(bundle->title, "SynthSpheres");
    for (const auto& view : bundle->views) {
        EXPECT_EQ(view.pointCount(), 1024 * 768);
        EXPECT_EQ(view.camera.fx, 900);
        EXPECT_EQ(view.camera.cx, 512);
        EXPECT_GE(view.nearPlane, 1.0);
        EXPECT_LE(view.farPlane, 20.0001);
    }
    // v0 stands at x forward 0, y left 0.2, z up 1.35.
    EXPECT_NEAR(glm::length(bundle->views[0].camera.position - glm::dvec3(-0.2, 1.35, 0)), 0,
                1e-12);
}

TEST(SpheresMiv, YuvEqualsPngToThePrecisionOfItsChroma) {
    REQUIRE_SHARED(set, "data/imagesets/spheres-miv");
    Job job;
    const auto png = readImageSet(set, {}, job);
    ASSERT_TRUE(png) << png.error().text();
    // Of the list's sources only two lie there as planes; name the images one by one.
    for (const std::string name : {"v0", "v3"}) {
        const auto json = set / "cameras.json";
        const auto cameras = readCameraFile(json, job);
        ASSERT_TRUE(cameras) << cameras.error().text();
        ImageSetOptions options;
        options.texturePattern = name + "_texture_{w}x{h}_{format}.yuv";
        options.depthPattern = name + "_depth_{w}x{h}_{format}.yuv";
        const auto yuv = readImageSet(set, options, job);
        ASSERT_TRUE(yuv) << yuv.error().text();
        const auto& a = viewNamed(*png, name);
        const auto& b = viewNamed(*yuv, name);
        EXPECT_EQ(a.depth, b.depth);
        EXPECT_EQ(a.nearPlane, b.nearPlane);
        EXPECT_EQ(a.camera, b.camera);
        const auto same = compare(*a.texture.rgba8(), *b.texture.rgba8());
        ASSERT_TRUE(same);
        ::testing::Test::RecordProperty(name + "_psnr", fmt::format("{:.2f}", *same->psnrY));
        std::printf("%s: YUV against PNG %.2f dB RGB, %.2f dB Y, worst %g\n", name.c_str(),
                    *same->psnrRgb, *same->psnrY, same->worst.difference);
        EXPECT_GT(*same->psnrY, 50.0);
        EXPECT_GT(*same->psnrRgb, 36.0);
    }
}

TEST(SpheresMiv, TheCenterViewIsRenderedAsWellAsTheDesignPromises) {
    REQUIRE_SHARED(set, "data/imagesets/spheres-miv");
    Job job;
    const auto bundle = readImageSet(set, {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    const auto cameras = readCameraFile(set / "cameras.json", job);
    ASSERT_TRUE(cameras);
    RenderSettings settings;
    auto renderer = makeRenderer(Backend::cpu, *bundle, settings, -1, job);
    ASSERT_TRUE(renderer) << renderer.error().text();
    for (const auto& [name, camera, time, aligned] : *cameras) {
        if (name != "gt_center") continue;
        const auto frame = (*renderer)->render(camera);
        ASSERT_TRUE(frame);
        const auto bytes = readFile(set / "gt_center_color.png", job.limits);
        ASSERT_TRUE(bytes);
        const auto truth = decodeImage(*bytes, "gt", job.limits);
        ASSERT_TRUE(truth);
        Rgba8Image out(camera.width, camera.height);
        for (std::size_t i = 0; i < out.count(); ++i)
            out.data()[i] =
                glm::u8vec4(glm::clamp(frame->colour.data()[i], 0.0f, 1.0f) * 255.0f + 0.5f);
        const auto result = compare(out, rgba8From(*truth));
        ASSERT_TRUE(result);
        std::printf("gt_center: %.2f dB\n", *result->psnrY);
        EXPECT_GT(*result->psnrY, 46.0);
    }
}

/// PSNR of Y of a picture of the set, whole, as users get it.
double wholeFrame(const Bundle& bundle, const std::filesystem::path& set, const std::string& name) {
    Job job;
    const auto cameras = readCameraFile(set / "cameras.json", job);
    const auto bytes = readFile(set / (name + "_color.png"), job.limits);
    const auto renderer = makeRenderer(Backend::cpu, bundle, {}, -1, job);
    if (!cameras || !bytes || !renderer) return 0;
    const auto truth = decodeImage(*bytes, name, job.limits);
    for (const auto& [label, camera, time, aligned] : *cameras) {
        if (label != name) continue;
        const auto frame = (*renderer)->render(camera);
        if (!truth || !frame) return 0;
        Rgba8Image out(camera.width, camera.height);
        for (std::size_t i = 0; i < out.count(); ++i)
            out.data()[i] =
                glm::u8vec4(glm::clamp(frame->colour.data()[i], 0.0f, 1.0f) * 255.0f + 0.5f);
        const auto result = compare(out, rgba8From(*truth));
        return result ? *result->psnrY : 0;
    }
    return 0;
}

TEST(SpheresMiv, ABorderWithoutDepthTakesNoFillingAway) {
    REQUIRE_SHARED(set, "data/imagesets/spheres-miv");
    Job job;
    const auto bundle = readImageSet(set, {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    Bundle ring = *bundle;
    for (ReferenceView& view : ring.views) {
        view.noDepth = NoDepth::unknown;
        const int width = view.depth.width(), height = view.depth.height();
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                if (x == 0 || y == 0 || x + 1 == width || y + 1 == height)
                    view.depth.at(x, y) = kNoDepth;
    }
    const double whole = wholeFrame(*bundle, set, "gt_outside");
    const double without = wholeFrame(ring, set, "gt_outside");
    std::printf("gt_outside: %.2f dB, without the outermost ring %.2f dB\n", whole, without);
    EXPECT_GT(whole, 38);
    EXPECT_GT(without, whole - 0.5);
}

}  // namespace
