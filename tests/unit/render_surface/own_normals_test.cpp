// Views that bring no normals are drawn with those that they would be baked with.

#include <utility>

#include <gtest/gtest.h>

#include "lib/render/surface/cpu/cpu_surface.hpp"
#include "lib/surface/normals.hpp"
#include "tests/unit/surface/analytic.hpp"

namespace stx::surface {
namespace {

Frame withNormals(const Bundle& bundle, const Camera& camera) {
    RenderSettings settings;
    settings.normals = true;
    Job job;
    auto frame = makeCpuSurfaceRenderer(bundle, settings, job)->render(camera);
    EXPECT_TRUE(frame) << frame.error().text();
    return std::move(*frame);
}

TEST(OwnNormals, AreThoseOfTheBakedViewAlongOutlinesToo) {
    for (const bool orthographic : {false, true}) {
        Bundle plain;
        plain.views.push_back(analytic::capture(
            analytic::torus, analytic::lookingAt({1.2, 0.8, 2.8}, 64, orthographic), 32));
        plain.views[0].name = "view";
        bleedColour(plain.views[0].texture);
        Bundle baked = plain;
        Job job;
        ASSERT_TRUE(bake(baked, {}, job));
        // Its own place, and one beside it.
        for (const glm::dvec3 eye : {glm::dvec3(1.2, 0.8, 2.8), glm::dvec3(1.1, 0.9, 2.8)}) {
            const Camera camera = analytic::lookingAt(eye, 64, orthographic);
            const Frame a = withNormals(plain, camera), b = withNormals(baked, camera);
            int shown = 0;
            for (std::size_t i = 0; i < a.normal.count(); ++i) {
                const glm::vec3 normal = b.normal.data()[i];
                if (normal != glm::vec3(0.0f)) ++shown;
                ASSERT_LT(glm::length(a.normal.data()[i] - normal), 1e-4f) << "pixel " << i;
            }
            EXPECT_GT(shown, 500);
        }
    }
}

}  // namespace
}  // namespace stx::surface
