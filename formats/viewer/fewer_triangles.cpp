#include "formats/viewer/fewer_triangles.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <meshoptimizer.h>

#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"

namespace stx {
namespace {

/// How far beside its own place a view that is alone is looked at, as a share of the median
/// distance: what pages let it turn by.
constexpr double kAside = 0.08;
/// What is so near that it moves by more is out of any picture: the largest one has so many pixels.
constexpr double kMostPixels = 65535;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// How far beside its own place what a view shows is looked at, as a share of its distance: a depth
/// that is off by one pixel there counts as a corner that is off by one pixel. From wherever
/// another view looks at the same side; a ball of 16 views with 7,000 triangles has 33.0 dB
/// so, 25.9 with kAside, and spot with 20,000 has 43.3, 33.9.
double asideOf(const Bundle& bundle, const Camera& camera, double distance) {
    const glm::dvec3 middle = camera.position + distance * camera.forward();
    double aside = kAside;
    for (const ReferenceView& other : bundle.views) {
        const glm::dvec3 towards = other.camera.orthographic
                                       ? -other.camera.forward()
                                       : glm::normalize(other.camera.position - middle);
        const double along = -glm::dot(towards, camera.forward());
        aside = std::max(aside, along > 0 ? std::sqrt(std::max(1 - along * along, 0.0)) : 0.0);
    }
    return aside;
}

/// Where corners are in pixels: across, down, and by how far they move between the view's own place
/// and one beside it. Planes are planes there, too.
std::vector<glm::vec3> inPixels(const Bundle& bundle, const Camera& camera,
                                const ViewSurface& surface) {
    std::vector<glm::dvec3> seen;
    std::vector<double> distances;
    for (const glm::vec3& world : surface.positions) {
        const glm::dvec3 relative = glm::dvec3(world) - camera.position;
        seen.push_back(camera.project(glm::conjugate(camera.orientation) * relative));
        distances.push_back(seen.back().z);
    }
    const double distance = medianOf(std::move(distances));
    const double aside = asideOf(bundle, camera, distance) * camera.fx;
    std::vector<glm::vec3> out;
    out.reserve(seen.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
        const double z = seen[i].z;
        const double moves = camera.orthographic ? aside * z : aside * distance / z;
        out.emplace_back(surface.pixels[i].x, surface.pixels[i].y,
                         std::isnan(moves) ? 0.0 : std::clamp(moves, -kMostPixels, kMostPixels));
    }
    return out;
}

/// Leaves out the corners that are on no triangle any more.
void dropCorners(ViewSurface& surface) {
    std::vector<std::uint32_t> numbers(surface.positions.size(), kNone);
    std::vector<glm::u16vec2> pixels;
    std::vector<glm::vec3> positions;
    for (std::uint32_t& corner : surface.triangles) {
        std::uint32_t& number = numbers[corner];
        if (number == kNone) {
            number = static_cast<std::uint32_t>(positions.size());
            pixels.push_back(surface.pixels[corner]);
            positions.push_back(surface.positions[corner]);
        }
        corner = number;
    }
    surface.pixels = std::move(pixels);
    surface.positions = std::move(positions);
}

/// Twice the area of a triangle in pixels, whose sign says which way round its corners go.
std::int64_t turnOf(const ViewSurface& surface, const std::uint32_t* corners) {
    const glm::i64vec2 a(surface.pixels[corners[0]]), b(surface.pixels[corners[1]]),
        c(surface.pixels[corners[2]]);
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Which way round most of a view's picture is covered.
std::int64_t turnOfAll(const ViewSurface& surface) {
    std::int64_t sum = 0;
    for (std::size_t t = 0; t < surface.triangles.size(); t += 3)
        sum += turnOf(surface, &surface.triangles[t]);
    return sum;
}

/// Turns round the triangles that were folded over. A view sees no surface from behind, and viewers
/// light a side that is turned away with its normal turned, too. `all`: turnOfAll() of before.
void faceTheView(std::int64_t all, ViewSurface& surface) {
    for (std::size_t t = 0; t < surface.triangles.size(); t += 3) {
        const std::int64_t turn = turnOf(surface, &surface.triangles[t]);
        if ((turn > 0 && all < 0) || (turn < 0 && all > 0))
            std::swap(surface.triangles[t + 1], surface.triangles[t + 2]);
    }
}

void simplify(const Bundle& bundle, const Camera& camera, double share, ViewSurface& surface) {
    const std::vector<glm::vec3> places = inPixels(bundle, camera, surface);
    std::vector<std::uint32_t> fewer(surface.triangles.size());
    const std::int64_t all = turnOfAll(surface);
    const auto wanted =
        static_cast<std::size_t>(share * static_cast<double>(surface.triangles.size() / 3));
    // Of the error that it may make: that of all triangles away.
    constexpr float kAnyError = std::numeric_limits<float>::max();
    fewer.resize(meshopt_simplify(fewer.data(), surface.triangles.data(), surface.triangles.size(),
                                  &places[0].x, places.size(), sizeof(glm::vec3), 3 * wanted,
                                  kAnyError, 0, nullptr));
    surface.triangles = std::move(fewer);
    faceTheView(all, surface);
    dropCorners(surface);
}

}  // namespace

Result<void> takeFewerTriangles(const Bundle& bundle, std::size_t most,
                                std::vector<ViewSurface>& surfaces, Job& job) {
    const auto count = [&] {
        std::size_t triangles = 0;
        for (const ViewSurface& surface : surfaces) triangles += surface.triangles.size() / 3;
        return triangles;
    };
    const std::size_t before = count();
    if (before <= most) return {};
    const double share = static_cast<double>(most) / static_cast<double>(before);
    parallelFor(0, surfaces.size(), [&](std::size_t at) {
        if (job.cancelled || surfaces[at].triangles.empty()) return;
        simplify(bundle, bundle.views[at].camera, share, surfaces[at]);
    });
    STX_CHECK(job.checkCancelled());
    if (const std::size_t left = count(); left > most)
        job.note(fmt::format(
            "{} of {} triangles are left, more than the {} that are asked for: fewer would close "
            "holes or join parts",
            left, before, most));
    return {};
}

}  // namespace stx
