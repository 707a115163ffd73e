// Surfaces of views from afar, with noise, and of what is one pixel thin.
#include "lib/render/surface/view_surfaces.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "lib/geometry/camera.hpp"

namespace view_surfaces_test {

using namespace stx;

/// Two plates one above the other, 0.4 apart, the lower one 2 wide, the upper one 1.
double plateHit(glm::dvec3 from, glm::dvec3 along) {
    double nearest = kNoDepth;
    for (const auto& [z, half] : {std::pair(0.0, 1.0), std::pair(0.4, 0.5)}) {
        const double t = (z - from.z) / along.z;
        const glm::dvec3 p = from + t * along;
        if (t > 0 && std::abs(p.x) < half && std::abs(p.y) < half) nearest = std::min(nearest, t);
    }
    return nearest;
}

/// A view of the plates from `distance` away, 2.6 wide there.
ReferenceView platesFrom(double elevation, double azimuth, double distance, bool orthographic) {
    const glm::dvec3 towards(std::cos(elevation) * std::cos(azimuth),
                             std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    ReferenceView view;
    const double window = orthographic ? 2.6 : 2 * std::atan(1.3 / distance);
    view.camera = Camera::fromFieldOfView(distance * towards,
                                          *lookAt(distance * towards, {0, 0, 0}, {0, 0.1, 1}),
                                          {window, window}, orthographic, 96, 96);
    view.nearPlane = 0.1;
    view.farPlane = distance + 5;
    view.depth = Image<float>(96, 96, kNoDepth);
    view.texture = Rgba8Image(96, 96, glm::u8vec4(90, 90, 90, 255));
    for (int y = 0; y < 96; ++y) {
        for (int x = 0; x < 96; ++x) {
            // Along the ray of the pixel, by one unit of depth.
            const Camera& c = view.camera;
            const glm::dvec3 none = c.unproject(x + 0.5, y + 0.5, 0);
            const glm::dvec3 one = c.unproject(x + 0.5, y + 0.5, 1) - none;
            const double t = plateHit(c.position + c.orientation * none, c.orientation * one);
            view.depth.at(x, y) = static_cast<float>(t);
        }
    }
    return view;
}

/// The area of the triangles that lie within `within` of z = 0.
double areaOfLowerPlate(const std::vector<ViewSurface>& surfaces, double within) {
    double area = 0;
    for (const ViewSurface& s : surfaces) {
        for (std::size_t t = 0; t < s.triangles.size(); t += 3) {
            const glm::dvec3 a = s.positions[s.triangles[t]], b = s.positions[s.triangles[t + 1]],
                             c = s.positions[s.triangles[t + 2]];
            if (std::max({std::abs(a.z), std::abs(b.z), std::abs(c.z)}) < within)
                area += 0.5 * glm::length(glm::cross(b - a, c - a));
        }
    }
    return area;
}

TEST(ViewSurfacesFromAfar, AreThoseFromNear) {
    Job job;
    for (const bool orthographic : {true, false}) {
        double near = 0;
        for (const double distance : {20.0, 1000.0}) {
            Bundle bundle;
            bundle.views = {platesFrom(1.57, 0, distance, orthographic),
                            platesFrom(0.52, 0.17, distance, orthographic),
                            platesFrom(0.52, 3.3, distance, orthographic)};
            const auto surfaces = viewSurfaces(bundle, job);
            ASSERT_TRUE(surfaces) << surfaces.error().text();
            const double area = areaOfLowerPlate(*surfaces, 0.02);
            if (near == 0) near = area;
            // What lies under the other plate of the first view was missing.
            EXPECT_NEAR(area, near, 0.04 * near) << orthographic << " " << distance;
        }
    }
}

/// A view of z = 0 with noise of a thousandth.
ReferenceView noisyPlaneFrom(glm::dvec3 eye, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(1.0, 0.001);
    ReferenceView view;
    view.camera = Camera::fromFieldOfView(eye, *lookAt(eye, {0, 0, 0}, {0, 0.1, 1}), {0.93, 0.93},
                                          false, 128, 128);
    view.nearPlane = 0.1;
    view.farPlane = 30;
    view.depth = Image<float>(128, 128, kNoDepth);
    view.texture = Rgba8Image(128, 128, glm::u8vec4(90, 90, 90, 255));
    for (int y = 0; y < 128; ++y) {
        for (int x = 0; x < 128; ++x) {
            const glm::dvec3 one =
                view.camera.orientation * view.camera.unproject(x + 0.5, y + 0.5, 1.0);
            view.depth.at(x, y) = static_cast<float>(-eye.z / one.z * noise(random));
        }
    }
    return view;
}

/// How many of 200 x 200 places of the middle of z = 0 no triangle covers, seen from above.
int openPlaces(const std::vector<ViewSurface>& surfaces) {
    constexpr int kSide = 200;
    constexpr double kHalf = 0.5;
    Image<std::uint8_t> covered(kSide, kSide, 0);
    for (const ViewSurface& s : surfaces) {
        for (std::size_t t = 0; t < s.triangles.size(); t += 3) {
            glm::dvec2 p[3];
            for (std::size_t k = 0; k < 3; ++k)
                p[k] = (glm::dvec2(s.positions[s.triangles[t + k]]) / kHalf + 1.0) * (0.5 * kSide);
            const glm::ivec2 low(glm::floor(glm::min(p[0], glm::min(p[1], p[2]))));
            const glm::ivec2 high(glm::ceil(glm::max(p[0], glm::max(p[1], p[2]))));
            for (int y = std::max(low.y, 0); y <= std::min(high.y, kSide - 1); ++y) {
                for (int x = std::max(low.x, 0); x <= std::min(high.x, kSide - 1); ++x) {
                    double least = 1e9, most = -1e9;
                    for (int k = 0; k < 3; ++k) {
                        const glm::dvec2 side = p[(k + 1) % 3] - p[k],
                                         to = glm::dvec2(x + 0.5, y + 0.5) - p[k];
                        const double at = side.x * to.y - side.y * to.x;
                        least = std::min(least, at);
                        most = std::max(most, at);
                    }
                    if (least >= -1e-3 || most <= 1e-3) covered.at(x, y) = 1;
                }
            }
        }
    }
    return static_cast<int>(std::ranges::count(covered.pixels(), 0));
}

TEST(ViewSurfacesWithNoise, LeaveFewGaps) {
    Job job;
    Bundle bundle;
    bundle.views = {noisyPlaneFrom({-2, 0, 2}, 1), noisyPlaneFrom({0, 2, 2}, 2),
                    noisyPlaneFrom({2, 0, 2}, 3), noisyPlaneFrom({0, -2, 2}, 4)};
    const auto surfaces = viewSurfaces(bundle, job);
    ASSERT_TRUE(surfaces) << surfaces.error().text();
    const int open = openPlaces(*surfaces);
    std::printf("%d of 40,000 places are open\n", open);
    EXPECT_LT(open, 40);
}

/// A line one pixel wide, whose neighbours are there in part.
TEST(ViewSurfaces, HaveThePointsOfALineWithASoftMatte) {
    for (const std::uint8_t beside : {0, 100}) {
        Job job;
        Bundle bundle;
        ReferenceView& view = bundle.views.emplace_back();
        view.camera = Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {0.9, 0.9}, false, 32, 32);
        view.nearPlane = 1;
        view.farPlane = 10;
        view.depth = Image<float>(32, 32, kNoDepth);
        view.texture = Rgba8Image(32, 32, glm::u8vec4(0));
        for (int y = 4; y < 28; ++y) {
            for (int x = 15; x <= 17; ++x) {
                const std::uint8_t alpha = x == 16 ? 255 : beside;
                view.texture.rgba8()->at(x, y) = {200, 0, 0, alpha};
                if (alpha > 0) view.depth.at(x, y) = 2.0f;
            }
        }
        const auto surfaces = viewSurfaces(bundle, job);
        ASSERT_TRUE(surfaces) << surfaces.error().text();
        EXPECT_EQ(surfaces->front().lonePixels.size(), 24u) << int{beside};
    }
}

}  // namespace view_surfaces_test
