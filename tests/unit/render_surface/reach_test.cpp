#include "lib/render/surface/reach.hpp"

#include <gtest/gtest.h>

#include "tests/unit/surface/analytic.hpp"

namespace stx::surface {
namespace {

// Views of an object from all around are held against each other, triangle by triangle: a place
// that is nearer or farther than all that a view shows is not looked for in it.
TEST(Reach, HoldsWhatAViewShowsAndNothingBeyond) {
    for (const bool orthographic : {false, true}) {
        const Camera camera = analytic::lookingAt({0.5, 1, 3}, 64, orthographic);
        Bundle bundle;
        bundle.views.push_back(analytic::capture(analytic::torus, camera, 16));
        const ReferenceView& view = bundle.views[0];
        const SurfaceScene scene(PageSet(bundle), {});
        const Reach reach(scene.sources[0]);
        double nearest = 1e9, farthest = 0;
        for (int y = 0; y < 64; ++y) {
            for (int x = 0; x < 64; ++x) {
                const double dist = view.depth.at(x, y);
                if (!hasPoint(view.depth.at(x, y))) continue;
                nearest = std::min(nearest, dist);
                farthest = std::max(farthest, dist);
                for (const double other : {1 - kSameDepth, 1.0, 1 + kSameDepth}) {
                    EXPECT_TRUE(reach.holds(camera.position +
                                            camera.orientation *
                                                camera.unproject(x + 0.5, y + 0.5, other * dist)));
                }
            }
        }
        const auto at = [&](double dist) { return camera.position + dist * camera.forward(); };
        EXPECT_TRUE(reach.holds(at(nearest)) && reach.holds(at(farthest)));
        EXPECT_FALSE(reach.holds(at(0.97 * nearest)));
        EXPECT_FALSE(reach.holds(at(1.03 * farthest)));
        const std::vector<glm::dvec3> around = {at(0.5 * nearest), at(2 * farthest)},
                                      before = {at(0.5 * nearest), at(0.97 * nearest)};
        EXPECT_TRUE(reach.holds(around));
        EXPECT_FALSE(reach.holds(before));
    }
}

}  // namespace
}  // namespace stx::surface
