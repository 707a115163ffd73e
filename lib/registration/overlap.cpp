#include "lib/registration/overlap.hpp"

#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx::registration {
namespace {

/// Neighbours whose distances differ by a larger share are not one surface.
constexpr float kEdge = 0.05f;
/// Points looked up per view and axis to find who overlaps: in few views, in many.
constexpr int kProbes = 24, kProbesOfMany = 10;
constexpr std::size_t kMany = 64;

/// Where a camera is, for another one: a place there, w being 1, or the direction towards an
/// orthographic one, w being 0.
glm::dvec4 eyeIn(const Pose& frame, const Camera& camera) {
    if (camera.orthographic) return {-camera.forward() * frame.worldFromCamera, 0};
    return {frame.toCamera(camera.position), 1};
}

/// Whether an eye, in the space of a view's camera, looks at the side that the camera sees of the
/// surface at pixel position (x, y).
bool seesTheSameSide(const Camera& camera, double x, double y, const DepthSample& surface,
                     const glm::dvec4& eye) {
    const auto at = [&](double dx, double dy) {
        return camera.unproject(
            x + dx, y + dy, surface.distance + dx * surface.gradient.x + dy * surface.gradient.y);
    };
    const glm::dvec3 point = at(0, 0);
    const glm::dvec3 normal = glm::cross(at(1, 0) - point, at(0, 1) - point);
    // The camera is at its origin, or looks along -z.
    const glm::dvec3 own = camera.orthographic ? glm::dvec3(0, 0, 1) : -point;
    return glm::dot(normal, glm::dvec3(eye) - eye.w * point) * glm::dot(normal, own) > 0;
}

/// How far a surface may be from what is read between four pixels of it: a quarter of the change of
/// slope there, by the second differences at the four. (x, y) as of sampleDepth().
double bentBetween(const Image<float>& depth, double x, double y) {
    const int left = static_cast<int>(std::floor(x - 0.5));
    const int top = static_cast<int>(std::floor(y - 0.5));
    const auto bend = [&](int px, int py, int dx, int dy) {
        if (!depth.contains(px - dx, py - dy) || !depth.contains(px + dx, py + dy)) return 0.0;
        const float before = depth.at(px - dx, py - dy), after = depth.at(px + dx, py + dy);
        if (!hasPoint(before) || !hasPoint(after)) return 0.0;
        return std::abs(static_cast<double>(before) - 2.0 * depth.at(px, py) + after);
    };
    double bends = 0;
    for (int i = 0; i < 4; ++i)
        bends += bend(left + i % 2, top + i / 2, 1, 0) + bend(left + i % 2, top + i / 2, 0, 1);
    return bends / 8;  // each change of slope is in two pixels of two rows
}

}  // namespace

GridOfPoints gridOfPoints(const Image<float>& depth, int perAxis) {
    GridOfPoints grid;
    const int stepX = std::max(1, depth.width() / perAxis);
    const int stepY = std::max(1, depth.height() / perAxis);
    for (int y = stepY / 2; y < depth.height(); y += stepY) {
        for (int x = stepX / 2; x < depth.width(); x += stepX) {
            const float dist = depth.at(x, y);
            if (!hasPoint(dist)) continue;
            const bool surface = sampleDepth(depth, x + 0.5, y + 0.5).has_value();
            grid.points.push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                                   dist, surface ? depth.at(x + 1, y) : 0.0f,
                                   surface ? depth.at(x, y + 1) : 0.0f, surface});
        }
    }
    return grid;
}

ShownSphere sphereAround(const GridOfPoints& grid, const Camera& camera) {
    const Pose pose(camera);
    std::vector<glm::dvec3> points;
    for (const GridOfPoints::Point& p : grid.points)
        points.push_back(pose.position +
                         pose.worldFromCamera * camera.unproject(p.x + 0.5, p.y + 0.5, p.own));
    return ShownSphere::around(points);
}

CommonPoints commonPoints(const GridOfPoints& from, const Camera& own, const DepthView& to,
                          double tolerance) {
    CommonPoints out;
    const Camera& other = to.header->camera;
    const Pose source(own), target(other);
    const glm::dvec4 ownEye = eyeIn(target, own), otherEye = eyeIn(source, other);
    out.asked = static_cast<int>(from.points.size());
    for (const GridOfPoints::Point& p : from.points) {
        const glm::dvec3 inTarget = target.toCamera(
            source.position + source.worldFromCamera * own.unproject(p.x + 0.5, p.y + 0.5, p.own));
        if (!(inTarget.z < 0)) continue;
        const glm::dvec3 at = other.project(inTarget);
        const auto there = sampleDepth(*to.depth, at.x, at.y);
        if (!there || !p.onSurface) continue;
        const DepthSample surface{p.own, {p.right - p.own, p.below - p.own}};
        if (!seesTheSameSide(own, p.x + 0.5, p.y + 0.5, surface, otherEye)) continue;
        ++out.faced;
        out.past += there->distance - at.z >= tolerance * at.z ? 1 : 0;
        if (!(std::abs(at.z - there->distance) < tolerance * at.z) ||
            !seesTheSameSide(other, at.x, at.y, *there, ownEye))
            continue;
        out.points.push_back({p.own, at.z, there->distance, bentBetween(*to.depth, at.x, at.y)});
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

int probesAmong(std::size_t views) {
    return views < kMany ? kProbes : kProbesOfMany;
}

void addSeenPast(int from, int to, const CommonPoints& common, const OverlapSettings& settings,
                 std::vector<SeenPast>& past) {
    if (common.faced < static_cast<int>(kFewestPoints) ||
        common.faced < settings.minOverlap * common.asked)
        return;
    past.push_back({from, to, 2 * common.past > common.faced});
}

std::vector<Pair> overlappingPairs(std::span<const DepthView> views,
                                   const OverlapSettings& settings, std::vector<SeenPast>* past) {
    const int count = static_cast<int>(views.size());
    std::vector<std::vector<Pair>> ofView(views.size());
    std::vector<std::vector<SeenPast>> pastOfView(views.size());
    parallelFor(0, count, [&](std::int64_t i) {
        const DepthView& from = views[i];
        auto& pairs = ofView[i];
        const GridOfPoints grid = gridOfPoints(*from.depth, probesAmong(views.size()));
        for (const std::size_t j : viewsThatMayShow(
                 views.size(),
                 [&](std::size_t n) -> const Camera& { return views[n].header->camera; },
                 static_cast<std::size_t>(i), sphereAround(grid, from.header->camera),
                 kMostCompared)) {
            const DepthView& to = views[j];
            if (to.header->background != from.header->background) continue;
            const CommonPoints common =
                commonPoints(grid, from.header->camera, to, settings.overlapTolerance);
            addSeenPast(static_cast<int>(i), static_cast<int>(j), common, settings, pastOfView[i]);
            const double overlap = common.overlap();
            if (overlap >= settings.minOverlap)
                pairs.push_back({static_cast<int>(i), static_cast<int>(j), overlap});
        }
        std::stable_sort(pairs.begin(), pairs.end(),
                         [](const Pair& a, const Pair& b) { return a.overlap > b.overlap; });
        if (pairs.size() > static_cast<std::size_t>(settings.neighbours))
            pairs.resize(static_cast<std::size_t>(settings.neighbours));
    });
    std::vector<Pair> all;
    for (auto& pairs : ofView) all.insert(all.end(), pairs.begin(), pairs.end());
    if (past)
        for (const auto& of : pastOfView) past->insert(past->end(), of.begin(), of.end());
    return all;
}

}  // namespace stx::registration
