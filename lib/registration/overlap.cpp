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

/// Where a camera is, for another one: a place there, w being 1, or the direction towards an
/// orthographic one, w being 0.
glm::dvec4 eyeIn(const Pose& frame, const Camera& camera) {
    if (camera.orthographic) return {-camera.forward() * frame.worldFromCamera, 0};
    return {frame.toCamera(camera.position), 1};
}

/// Whether two eyes, in the space of a view's camera, look at the same side of the surface that
/// passes pixel (x, y) of it.
bool seeTheSameSide(const DepthView& view, int x, int y, const glm::dvec4& own,
                    const glm::dvec4& other) {
    const auto here = sampleDepth(*view.depth, x + 0.5, y + 0.5);
    if (!here) return false;
    const auto at = [&](double dx, double dy, double more) {
        return view.header->camera.unproject(x + 0.5 + dx, y + 0.5 + dy, here->distance + more);
    };
    const glm::dvec3 point = at(0, 0, 0);
    const glm::dvec3 normal =
        glm::cross(at(1, 0, here->gradient.x) - point, at(0, 1, here->gradient.y) - point);
    const auto side = [&](const glm::dvec4& eye) {
        return glm::dot(normal, glm::dvec3(eye) - eye.w * point);
    };
    return side(own) * side(other) > 0;
}

}  // namespace

CommonPoints commonPoints(const DepthView& from, const DepthView& to, int perAxis,
                          double tolerance) {
    CommonPoints out;
    const Camera &own = from.header->camera, &other = to.header->camera;
    const Pose source(own), target(other);
    const glm::dvec4 ownEye = eyeIn(source, own), otherEye = eyeIn(source, other);
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
            if (!seeTheSameSide(from, x, y, ownEye, otherEye)) continue;
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
