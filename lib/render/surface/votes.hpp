#pragma once

#include <cmath>

#include "lib/render/surface/constants.hpp"
#include "lib/render/surface/source.hpp"

namespace stx::surface {

/// What a source says about a point of space.
enum class Opinion {
    none,         ///< hidden from it, on its surface, or out of its frame
    freeByAlpha,  ///< it sees background there
    freeByDepth,  ///< it sees a surface clearly behind the point
};

/// Bilinear alpha of a source at pixel position (u, v); 1 when the view has none.
[[nodiscard]] inline float alphaAt(const Source& s, float u, float v) {
    if (!s.hasAlpha) return 1.0f;
    const float fu = std::floor(u - 0.5f), fv = std::floor(v - 0.5f);
    const float tu = u - 0.5f - fu, tv = v - 0.5f - fv;
    const int x0 = std::max(static_cast<int>(fu), 0), y0 = std::max(static_cast<int>(fv), 0);
    const int x1 = std::min(static_cast<int>(fu) + 1, s.width - 1);
    const int y1 = std::min(static_cast<int>(fv) + 1, s.height - 1);
    return (s.alpha(x0, y0) * (1 - tu) + s.alpha(x1, y0) * tu) * (1 - tv) +
           (s.alpha(x0, y1) * (1 - tu) + s.alpha(x1, y1) * tu) * tv;
}

/// The opinion of a source on the point at (x, y, q) of the novel view.
[[nodiscard]] inline Opinion opinionOf(const Source& s, const Warp& sourceFromPixel, float x,
                                       float y, float q) {
    const glm::vec4 h = sourceFromPixel.homogeneous(x, y, q);
    if (!(h.w > 0.0f)) return Opinion::none;
    const float inverse = 1.0f / h.w;
    const float u = h.x * inverse, v = h.y * inverse, p = h.z * inverse;
    if (!(u >= 0.0f && v >= 0.0f && u < static_cast<float>(s.width) &&
          v < static_cast<float>(s.height) && p > 0.0f))
        return Opinion::none;
    if (alphaAt(s, u, v) < s.freeAlpha) return Opinion::freeByAlpha;
    const int x0 = static_cast<int>(std::floor(u - 0.5f)),
              y0 = static_cast<int>(std::floor(v - 0.5f));
    bool any = false;
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            const int cx = x0 + i, cy = y0 + j;
            if (!s.q.contains(cx, cy)) continue;
            const float there = s.q.at(cx, cy);
            // What was pruned from here may be the very surface that is asked about.
            if (there < 0.0f) return Opinion::none;
            if (!(there > 0.0f)) continue;
            any = true;
            // The cheap half of the test first: most surfaces are not behind the point at all.
            const float margin = (kClearlyBehind + s.noise) * s.space.axis.whole(p) +
                                 s.step * s.space.axis.perUnit(p);
            const float reach = 4 * kLinkedSamples * s.space.axis.whole(there);
            if (p < there + margin - reach) return Opinion::none;
            const glm::vec2 g = s.gradient(cx, cy);
            const float predicted = there + g.x * (u - 0.5f - static_cast<float>(cx)) +
                                    g.y * (v - 0.5f - static_cast<float>(cy));
            if (p < predicted + margin + kSlopeDoubt * (std::abs(g.x) + std::abs(g.y)))
                return Opinion::none;
        }
    }
    return any ? Opinion::freeByDepth : Opinion::none;
}

}  // namespace stx::surface
