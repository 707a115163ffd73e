#include <gtest/gtest.h>

#include "formats/meshes/meshes.hpp"
#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/surface/normals.hpp"
#include "tests/shared_data.hpp"

namespace stx {
namespace {

/// Mean angle in degrees between baked normals and the mesh's own, over 16 views of 512x512.
double errorOnSpot(const Mesh& mesh, int bits, BakeSettings::Method method) {
    Job job;
    const ViewFraming framing;
    const auto cameras = layoutCameras({ViewLayout::Kind::sphere, 16, 0}, framing, mesh.positions);
    EXPECT_TRUE(cameras);
    CaptureSettings settings;
    settings.supersampling = 1;
    settings.depthBits = bits;
    settings.meshNormals = true;
    auto bundle = captureBundle(mesh, *cameras, settings, job);
    EXPECT_TRUE(bundle);
    std::vector<Image<glm::vec3>> truth;
    for (const auto& view : bundle->views) truth.push_back(view.normal);
    BakeSettings baking;
    baking.method = method;
    EXPECT_TRUE(bake(*bundle, baking, job));
    double sum = 0;
    std::int64_t points = 0;
    for (std::size_t v = 0; v < bundle->views.size(); ++v) {
        const auto& view = bundle->views[v];
        for (std::size_t i = 0; i < view.depth.count(); ++i) {
            if (!hasPoint(view.depth.pixels()[i])) continue;
            const double c = glm::dot(view.normal.pixels()[i], truth[v].pixels()[i]);
            sum += glm::degrees(std::acos(std::clamp(c, -1.0, 1.0)));
            ++points;
        }
    }
    return sum / static_cast<double>(points);
}

TEST(MeshNormals, SpotWithinTheTargets) {
    REQUIRE_SHARED(path, "data/meshes/obj/spot/spot_triangulated.obj");
    Job job;
    const auto mesh = readMesh(path, job);
    ASSERT_TRUE(mesh) << mesh.error().text();
    for (const auto method : {BakeSettings::Method::robust, BakeSettings::Method::paper}) {
        for (const int bits : {16, 8}) {
            const double degrees = errorOnSpot(*mesh, bits, method);
            fmt::print("spot, 16 views of 512x512, {} bits, {}: {:.2f} degrees\n", bits,
                       method == BakeSettings::Method::robust ? "robust" : "paper", degrees);
            if (method == BakeSettings::Method::robust) {
                EXPECT_LT(degrees, bits == 16 ? 3.0 : 6.0);
            } else if (bits == 8) {
                EXPECT_GT(degrees, 8.0) << "plain differences show the stairs";
            }
        }
    }
}

}  // namespace
}  // namespace stx
