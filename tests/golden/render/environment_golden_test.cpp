// An object before an environment: what is behind it is what is painted there, and its silhouette
// has no rim of another colour. The truth is the mesh before the same environment.
#include <cmath>

#include <gtest/gtest.h>

#include "formats/any/open.hpp"
#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/render/compose/environment_behind.hpp"
#include "lib/render/factory.hpp"
#include "lib/render/mesh/mesh_renderer.hpp"
#include "tests/painted_environment.hpp"

namespace stx {
namespace {

double psnrOf(double sum, double count) {
    return 10 * std::log10(count / std::max(sum, 1e-12));
}

TEST(EnvironmentGolden, AnObjectStandsBeforeItsPlace) {
    Job job;
    auto opened = openRenderable(STX_SAMPLE_MODEL, {}, job);
    ASSERT_TRUE(opened) << opened.error().text();
    const Mesh mesh = std::get<Mesh>(std::move(*opened));
    const auto views =
        layoutCameras(*parseViewLayout("sphere:16"), {.width = 256, .height = 256}, mesh.positions);
    ASSERT_TRUE(views);
    auto bundle = captureBundle(mesh, *views, {}, job);
    ASSERT_TRUE(bundle);
    const Environment place = paintedCube(256);
    bundle->environment = std::make_shared<const Environment>(place);
    const auto map = EnvironmentMap::make(place, Limits());
    ASSERT_TRUE(map);

    const glm::dvec3 eye(1.1, 1.0, 2.0), middle = mesh.bounds().centre();
    const Camera camera =
        Camera::fromFieldOfView(eye, *lookAt(eye, middle), {0.8, 0.8}, false, 256, 256);
    RenderSettings settings;
    const auto truth = withEnvironment(makeMeshRenderer(mesh, settings, job), *map)->render(camera);
    ASSERT_TRUE(truth);
    // Reached: surface 35.9 and 25.0 dB, splat 30.7 and 17.7 (all, and the rim); as much as before
    // plain grey.
    struct Way {
        RenderMode mode;
        double least, leastAtEdges;
    };
    for (const Way& way : {Way{RenderMode::surface, 35, 24}, Way{RenderMode::splat, 30, 17}}) {
        settings.mode = way.mode;
        const auto renderer = makeRenderer(Backend::cpu, *bundle, settings, -1, job);
        ASSERT_TRUE(renderer) << renderer.error().text();
        const auto frame = (*renderer)->render(camera);
        ASSERT_TRUE(frame);
        double sum = 0, edgeSum = 0, edges = 0, worstBehind = 0;
        int translucent = 0;
        for (int y = 0; y < 256; ++y) {
            for (int x = 0; x < 256; ++x) {
                const glm::dvec4 got(frame->colour.at(x, y)), expected(truth->colour.at(x, y));
                translucent += got.a != 1.0;
                const glm::dvec3 off = glm::dvec3(got - expected);
                sum += glm::dot(off, off) / 3;
                const float share = truth->albedo.empty() ? 0 : truth->albedo.at(x, y).a;
                if (hasPoint(truth->depth.at(x, y)) || hasPoint(frame->depth.at(x, y))) {
                    // The rim of the object: a neighbour shows the place.
                    bool rim = share > 0 && share < 1;
                    for (int k = 0; k < 4 && !rim; ++k) {
                        const int nx = x + (k == 0) - (k == 1), ny = y + (k == 2) - (k == 3);
                        rim = truth->depth.contains(nx, ny) && !hasPoint(truth->depth.at(nx, ny));
                    }
                    if (rim) {
                        edgeSum += glm::dot(off, off) / 3;
                        ++edges;
                    }
                    continue;
                }
                // Two pixels and more from the object there is nothing of it.
                bool near = false;
                for (int dy = -2; dy <= 2; ++dy)
                    for (int dx = -2; dx <= 2; ++dx)
                        near = near || (truth->depth.contains(x + dx, y + dy) &&
                                        hasPoint(truth->depth.at(x + dx, y + dy)));
                if (near) continue;
                const glm::dvec3 painted = paintedColour(camera.viewDirection(x + 0.5, y + 0.5));
                worstBehind = std::max(worstBehind, glm::distance(glm::dvec3(got), painted));
            }
        }
        const char* name = way.mode == RenderMode::surface ? "surface" : "splat";
        RecordProperty(name, fmt::format("{:.2f} dB, rim {:.2f} dB", psnrOf(sum, 256.0 * 256.0),
                                         psnrOf(edgeSum, edges)));
        EXPECT_GT(psnrOf(sum, 256.0 * 256.0), way.least) << name;
        EXPECT_GT(psnrOf(edgeSum, edges), way.leastAtEdges) << name;
        EXPECT_GT(edges, 100) << name;
        EXPECT_EQ(translucent, 0) << name;
        EXPECT_LT(worstBehind, 0.01) << name;
    }
}

}  // namespace
}  // namespace stx
