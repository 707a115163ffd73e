#include "lib/registration/overlap.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"

namespace stx::registration {
namespace {

/// Neighbours whose distances differ by a larger share are not one surface.
constexpr float kEdge = 0.05f;
/// Points looked up per view and axis to find who overlaps: in few views, in many (each is held
/// against each).
constexpr int kProbes = 24, kProbesOfMany = 10;
constexpr int kMany = 64;
/// Points looked up per view and axis to measure a pair.
constexpr int kMeasured = 120;

/// Calls visit(relative difference) for points of `from` on a grid that `to` sees, too; gives the
/// number of grid points that are points of the object.
template <class Visit>
int lookUp(const ReferenceView& from, const ReferenceView& to, int perAxis, double tolerance,
           Visit&& visit) {
    const Pose target(to.camera);
    const int stepX = std::max(1, from.camera.width / perAxis);
    const int stepY = std::max(1, from.camera.height / perAxis);
    int points = 0;
    for (int y = stepY / 2; y < from.camera.height; y += stepY) {
        for (int x = stepX / 2; x < from.camera.width; x += stepX) {
            if (!hasPoint(from.depth.at(x, y))) continue;
            ++points;
            const glm::dvec3 inTarget = target.toCamera(from.worldPoint(x, y));
            if (!(inTarget.z < 0)) continue;
            const glm::dvec3 at = to.camera.project(inTarget);
            const auto there = sampleDepth(to.depth, at.x, at.y);
            if (!there) continue;
            const double difference = (at.z - there->distance) / at.z;
            if (std::abs(difference) < tolerance) visit(difference);
        }
    }
    return points;
}

}  // namespace

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

std::vector<Pair> overlappingPairs(const Bundle& bundle, const PoseRefinementSettings& settings) {
    const int count = static_cast<int>(bundle.views.size());
    std::vector<std::vector<Pair>> ofView(bundle.views.size());
    parallelFor(0, count, [&](std::int64_t i) {
        const ReferenceView& from = bundle.views[static_cast<std::size_t>(i)];
        auto& pairs = ofView[static_cast<std::size_t>(i)];
        for (int j = 0; j < count; ++j) {
            if (j == i) continue;
            int common = 0;
            const int points = lookUp(from, bundle.views[static_cast<std::size_t>(j)],
                                      count < kMany ? kProbes : kProbesOfMany,
                                      settings.overlapTolerance, [&](double) { ++common; });
            const double overlap = points > 0 ? static_cast<double>(common) / points : 0;
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

DepthDisagreement disagreement(const Bundle& bundle, const std::vector<Pair>& pairs,
                               const PoseRefinementSettings& settings) {
    std::vector<double> medians(pairs.size());
    parallelFor(0, static_cast<std::int64_t>(pairs.size()), [&](std::int64_t i) {
        const Pair& pair = pairs[static_cast<std::size_t>(i)];
        std::vector<double> differences;
        lookUp(bundle.views[static_cast<std::size_t>(pair.from)],
               bundle.views[static_cast<std::size_t>(pair.to)], kMeasured,
               settings.overlapTolerance, [&](double d) { differences.push_back(std::abs(d)); });
        medians[static_cast<std::size_t>(i)] = medianOf(std::move(differences));
    });
    DepthDisagreement result;
    result.pairs = static_cast<int>(pairs.size());
    for (const Pair& pair : pairs) result.overlap += pair.overlap / result.pairs;
    result.relative = medianOf(std::move(medians));
    return result;
}

}  // namespace stx::registration

namespace stx {

DepthDisagreement measureDepthDisagreement(const Bundle& bundle,
                                           const PoseRefinementSettings& settings) {
    return registration::disagreement(bundle, registration::overlappingPairs(bundle, settings),
                                      settings);
}

}  // namespace stx
