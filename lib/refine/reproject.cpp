#include "lib/refine/reproject.hpp"

#include <algorithm>
#include <cmath>

#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

/// Samples whose distances differ by less belong to one surface.
constexpr float kOneSurface = 0.02f;

/// The distance at a corner of a pixel, which lies between it, the pixels beside it by `dx` and by
/// `dy`, and the one across: that of the plane through those that are of its surface.
double distanceAtCorner(const Image<float>& depth, int x, int y, int dx, int dy) {
    const float own = depth.at(x, y);
    // 1/z, which is linear on planes; 0: not of this surface.
    const auto inverse = [&](int i, int j) {
        const float d = depth.contains(i, j) ? depth.at(i, j) : kNoDepth;
        return hasPoint(d) && std::abs(d - own) <= kOneSurface * std::min(d, own)
                   ? 1.0 / static_cast<double>(d)
                   : 0.0;
    };
    const double a = 1.0 / static_cast<double>(own), b = inverse(x + dx, y), c = inverse(x, y + dy),
                 across = inverse(x + dx, y + dy);
    // Each case gives the same from all pixels that share it, so that faces meet.
    if (b > 0 && c > 0) return 1.0 / (across > 0 ? (a + b + c + across) / 4 : (b + c) / 2);
    if (across > 0) return 2.0 / (a + across);
    if (b > 0) return 2.0 / (a + b);
    return c > 0 ? 2.0 / (a + c) : own;
}

/// Draws a triangle of corners in pixels with 1/distance as z; the largest z stays.
void drawNearest(Image<float>& inverse, const glm::dvec3& a, const glm::dvec3& b,
                 const glm::dvec3& c) {
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    // The back of a triangle, which only noise turns to this camera.
    if (!(area > 0)) return;
    const auto first = [](double least, double size) {
        return static_cast<int>(std::ceil(std::clamp(least - 0.5, 0.0, size)));
    };
    const auto last = [](double most, double size) {
        return static_cast<int>(std::floor(std::clamp(most - 0.5, -1.0, size - 1)));
    };
    const int y1 = last(std::max({a.y, b.y, c.y}), inverse.height());
    const int x1 = last(std::max({a.x, b.x, c.x}), inverse.width());
    const int x0 = first(std::min({a.x, b.x, c.x}), inverse.width());
    for (int y = first(std::min({a.y, b.y, c.y}), inverse.height()); y <= y1; ++y) {
        for (int x = x0; x <= x1; ++x) {
            const glm::dvec2 p(x + 0.5, y + 0.5);
            const auto share = [&](const glm::dvec3& from, const glm::dvec3& to) {
                return ((to.x - from.x) * (p.y - from.y) - (to.y - from.y) * (p.x - from.x)) / area;
            };
            const double wa = share(b, c), wb = share(c, a), wc = share(a, b);
            // Edges count for both sides: no pixel is lost between two faces.
            if (wa < 0 || wb < 0 || wc < 0) continue;
            float& nearest = inverse.at(x, y);
            nearest = std::max(nearest, static_cast<float>(wa * a.z + wb * b.z + wc * c.z));
        }
    }
}

}  // namespace

Result<Image<float>> depthSeenBy(const Camera& to, const RealFromIdeal& lens,
                                 const Image<float>& depth, const Camera& from, Job& job) {
    const glm::dquat turn = glm::conjugate(to.orientation) * from.orientation;
    const glm::dvec3 shift = glm::conjugate(to.orientation) * (from.position - to.position);
    Image<float> inverse(to.width, to.height, 0.0f);
    for (int y = 0; y < depth.height(); ++y) {
        STX_CHECK(job.checkCancelled());
        for (int x = 0; x < depth.width(); ++x) {
            if (!hasPoint(depth.at(x, y))) continue;
            glm::dvec3 corners[4];
            bool behind = false, inside = false;
            for (int i = 0; i < 4; ++i) {
                const int right = i == 1 || i == 2, down = i >= 2;
                const double d = distanceAtCorner(depth, x, y, right ? 1 : -1, down ? 1 : -1);
                const glm::dvec3 p = turn * from.unproject(x + right, y + down, d) + shift;
                behind |= !(p.z < 0);
                if (behind) break;
                const glm::dvec3 at = to.project(p);
                inside |= at.x >= 0 && at.y >= 0 && at.x <= to.width && at.y <= to.height;
                corners[i] = {lens ? lens(glm::dvec2(at)) : glm::dvec2(at), 1.0 / at.z};
            }
            // A formula of a lens may fold what is far outside into the picture.
            if (behind || (!inside && lens)) continue;
            drawNearest(inverse, corners[0], corners[1], corners[2]);
            drawNearest(inverse, corners[0], corners[2], corners[3]);
        }
    }
    for (float& value : inverse.pixels()) value = value > 0 ? 1.0f / value : kNoDepth;
    return inverse;
}

}  // namespace stx
