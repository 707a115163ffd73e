#include "lib/registration/overlap.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx::registration {
namespace {

/// Neighbours whose distances differ by a larger share are not one surface.
constexpr float kEdge = 0.05f;
/// Points looked up per view and axis to find who overlaps: in few views, in many (each is held
/// against each).
constexpr int kProbes = 24, kProbesOfMany = 10;
constexpr int kMany = 64;

/// Whether two cameras look at the same side of a surface that passes pixel (x, y) of `from`.
bool seeTheSameSide(const DepthView& from, int x, int y, const Camera& to) {
    const auto here = sampleDepth(*from.depth, x + 0.5, y + 0.5);
    if (!here) return false;
    const Camera& camera = from.header->camera;
    const auto at = [&](double dx, double dy, double dist) {
        return Pose(camera).worldFromCamera * camera.unproject(x + 0.5 + dx, y + 0.5 + dy, dist) +
               camera.position;
    };
    const double dist = here->distance;
    const glm::dvec3 point = at(0, 0, dist);
    const glm::dvec3 normal = glm::cross(at(1, 0, dist + here->gradient.x) - point,
                                         at(0, 1, dist + here->gradient.y) - point);
    const auto side = [&](const Camera& c) {
        return glm::dot(normal, c.orthographic ? -c.forward() : c.position - point);
    };
    return side(camera) * side(to) > 0;
}

}  // namespace

CommonPoints commonPoints(const DepthView& from, const DepthView& to, int perAxis,
                          double tolerance) {
    CommonPoints out;
    const Camera &own = from.header->camera, &other = to.header->camera;
    const Pose source(own), target(other);
    const int stepX = std::max(1, own.width / perAxis), stepY = std::max(1, own.height / perAxis);
    for (int y = stepY / 2; y < own.height; y += stepY) {
        for (int x = stepX / 2; x < own.width; x += stepX) {
            const float dist = from.depth->at(x, y);
            if (!hasPoint(dist)) continue;
            ++out.asked;
            const glm::dvec3 inTarget = target.toCamera(
                source.position + source.worldFromCamera * own.unproject(x + 0.5, y + 0.5, dist));
            if (!(inTarget.z < 0)) continue;
            const glm::dvec3 at = other.project(inTarget);
            const auto there = sampleDepth(*to.depth, at.x, at.y);
            if (!there || !(std::abs(at.z - there->distance) < tolerance * at.z)) continue;
            if (!seeTheSameSide(from, x, y, other)) continue;
            out.points.push_back({dist, at.z, there->distance});
        }
    }
    return out;
}

std::optional<DepthSample> sampleDepth(const Image<float>& depth, double x, double y) {
    const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
    if (!(left >= 0 && top >= 0 && left < depth.width() - 1 && top < depth.height() - 1)) return {};
    const int ix = static_cast<int>(left), iy = static_cast<int>(top);
    const float a = depth.at(ix, iy), b = depth.at(ix + 1, iy);
    const float c = depth.at(ix, iy + 1), d = depth.at(ix + 1, iy + 1);
    if (!hasPoint(a) || !hasPoint(b) || !hasPoint(c) || !hasPoint(d)) return {};
    const auto [least, most] = std::minmax({a, b, c, d});
    if (most - least > kEdge * least) return {};
    const double u = x - 0.5 - left, v = y - 0.5 - top;
    const double upper = a + (b - a) * u, lower = c + (d - c) * u;
    return DepthSample{upper + (lower - upper) * v,
                       {(b - a) * (1 - v) + (d - c) * v, lower - upper}};
}

std::vector<Pair> overlappingPairs(std::span<const DepthView> views,
                                   const OverlapSettings& settings) {
    const int count = static_cast<int>(views.size());
    std::vector<std::vector<Pair>> ofView(views.size());
    parallelFor(0, count, [&](std::int64_t i) {
        const DepthView& from = views[static_cast<std::size_t>(i)];
        auto& pairs = ofView[static_cast<std::size_t>(i)];
        for (int j = 0; j < count; ++j) {
            if (j == i) continue;
            const DepthView& to = views[static_cast<std::size_t>(j)];
            if (to.header->background != from.header->background) continue;
            const double overlap = commonPoints(from, to, count < kMany ? kProbes : kProbesOfMany,
                                                settings.overlapTolerance)
                                       .overlap();
            if (overlap >= settings.minOverlap) pairs.push_back({static_cast<int>(i), j, overlap});
        }
        std::stable_sort(pairs.begin(), pairs.end(),
                         [](const Pair& a, const Pair& b) { return a.overlap > b.overlap; });
        if (pairs.size() > static_cast<std::size_t>(settings.neighbours))
            pairs.resize(static_cast<std::size_t>(settings.neighbours));
    });
    std::vector<Pair> all;
    for (auto& pairs : ofView) all.insert(all.end(), pairs.begin(), pairs.end());
    return all;
}

}  // namespace stx::registration
