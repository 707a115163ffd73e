#include <gtest/gtest.h>

#include "lib/capture/capture.hpp"

namespace stx {
namespace {

/// Looks at a square of 2 x 2 around the origin from +Z, at `x` beside it.
Camera cameraBeside(double x) {
    Camera camera;
    camera.width = camera.height = 8;
    camera.position = {x, 0, 4};
    camera.orthographic = true;
    camera.fx = camera.fy = 3;
    camera.cx = camera.cy = 4;
    return camera;
}

TEST(CapturedNames, BelongToTheirCamerasWhateverIsDropped) {
    Mesh mesh;
    mesh.positions = {{-1, 1, 0}, {1, 1, 0}, {1, -1, 0}, {-1, -1, 0}};
    mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
    mesh.triangleMaterial = {0, 0};
    mesh.materials = {Material()};
    CaptureSettings settings;
    settings.names = {"view001", "away", "left"};
    Job job;
    const auto bundle =
        captureBundle(mesh, {cameraBeside(0), cameraBeside(100), cameraBeside(0.5)}, settings, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_EQ(bundle->views.size(), 2u);
    EXPECT_EQ(bundle->views[0].name, "view001");
    EXPECT_EQ(bundle->views[1].name, "left");
    settings.names.pop_back();
    const auto wrong = captureBundle(mesh, {cameraBeside(0)}, settings, job);
    ASSERT_FALSE(wrong);
    EXPECT_EQ(wrong.error().code, ErrorCode::usage);
}

}  // namespace
}  // namespace stx
