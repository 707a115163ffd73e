#include "lib/background/key_views.hpp"

#include <algorithm>

#include "lib/base/parallel.hpp"

namespace stx::temporal {
namespace {

/// Places of the grid along the longer side.
constexpr int kGrid = 24;
/// A glimpse sees a point of another when its pixels there are at most this much coarser,
constexpr double kMostCoarser = 1.5;
/// and nothing that it sees there is nearer by more than this share (the grid is coarse).
constexpr float kHidden = 0.05f;
/// One more glimpse is worth its memory when it adds this share of all points.
constexpr double kWorthIt = 0.01;

struct SeenPoint {
    glm::dvec3 world;
    double spacing;  ///< between the pixels that saw it, scene units
};

bool sees(const Glimpse& g, const glm::dmat3& turn, const SeenPoint& point) {
    const glm::dvec3 p = turn * (point.world - g.camera.position);
    if (!(p.z < 0) && !g.camera.orthographic) return false;
    const glm::dvec3 at = g.camera.project(p);
    if (!(at.x >= 0 && at.y >= 0 && at.x < g.camera.width && at.y < g.camera.height)) return false;
    if (g.camera.sampleSpacing(at.z).x > kMostCoarser * point.spacing) return false;
    const int x = static_cast<int>(at.x * g.depth.width() / g.camera.width);
    const int y = static_cast<int>(at.y * g.depth.height() / g.camera.height);
    // The grid is coarse: a point counts as seen unless it is behind the farthest of the places
    // around it.
    float farthest = 0;
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, g.depth.height() - 1); ++j)
        for (int i = std::max(x - 1, 0); i <= std::min(x + 1, g.depth.width() - 1); ++i)
            if (hasPoint(g.depth.at(i, j))) farthest = std::max(farthest, g.depth.at(i, j));
    return farthest > 0 && at.z <= (1 + kHidden) * farthest;
}

void addPoints(const Glimpse& g, std::vector<SeenPoint>& points) {
    for (int y = 0; y < g.depth.height(); ++y) {
        for (int x = 0; x < g.depth.width(); ++x) {
            const float dist = g.depth.at(x, y);
            if (!hasPoint(dist) || !(dist > 0)) continue;
            const glm::dvec2 at = g.pixelOf(x, y);
            points.push_back(
                {g.camera.position + g.camera.orientation * g.camera.unproject(at.x, at.y, dist),
                 g.camera.sampleSpacing(dist).x});
        }
    }
}

glm::dmat3 cameraFromWorld(const Glimpse& g) {
    return glm::transpose(glm::mat3_cast(g.camera.orientation));
}

}  // namespace

std::int64_t sharedPoints(const Glimpse& one, const Glimpse& other) {
    std::vector<SeenPoint> points;
    addPoints(one, points);
    const glm::dmat3 turn = cameraFromWorld(other);
    return std::count_if(points.begin(), points.end(),
                         [&](const SeenPoint& p) { return sees(other, turn, p); });
}

Glimpse glimpseOf(const ReferenceView& view) {
    const Camera& c = view.camera;
    const double scale = std::min(1.0, static_cast<double>(kGrid) / std::max(c.width, c.height));
    Glimpse glimpse{c, Image<float>(std::max(1, static_cast<int>(c.width * scale)),
                                    std::max(1, static_cast<int>(c.height * scale)))};
    for (int y = 0; y < glimpse.depth.height(); ++y) {
        for (int x = 0; x < glimpse.depth.width(); ++x) {
            const glm::dvec2 at = glimpse.pixelOf(x, y);
            glimpse.depth.at(x, y) = view.depth.at(static_cast<int>(at.x), static_cast<int>(at.y));
        }
    }
    return glimpse;
}

std::vector<int> chooseKeys(std::span<const Glimpse> glimpses, int most) {
    std::vector<SeenPoint> points;
    for (const Glimpse& g : glimpses) addPoints(g, points);
    std::vector<std::vector<std::uint8_t>> seen(glimpses.size());
    parallelFor(0, glimpses.size(), [&](std::size_t i) {
        const Glimpse& g = glimpses[i];
        auto& mine = seen[i];
        mine.resize(points.size());
        const glm::dmat3 turn = cameraFromWorld(g);
        for (std::size_t k = 0; k < points.size(); ++k) mine[k] = sees(g, turn, points[k]);
    });
    std::vector<int> keys;
    std::vector<std::uint8_t> covered(points.size(), 0);
    while (static_cast<int>(keys.size()) < most) {
        int best = -1;
        std::int64_t bestAdds = 0;
        for (std::size_t i = 0; i < glimpses.size(); ++i) {
            std::int64_t adds = 0;
            for (std::size_t k = 0; k < points.size(); ++k) adds += seen[i][k] & ~covered[k] & 1;
            if (adds <= bestAdds) continue;
            best = static_cast<int>(i);
            bestAdds = adds;
        }
        const double least = keys.empty() ? 0.0 : kWorthIt * static_cast<double>(points.size());
        if (best < 0 || static_cast<double>(bestAdds) < least) break;
        keys.push_back(best);
        for (std::size_t k = 0; k < points.size(); ++k) covered[k] |= seen[best][k];
    }
    return keys;
}

}  // namespace stx::temporal
