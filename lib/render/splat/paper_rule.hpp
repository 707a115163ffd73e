#pragma once

#include <algorithm>
#include <cmath>

#include <glm/glm.hpp>

#include "lib/geometry/camera.hpp"
#include "lib/render/renderer.hpp"

namespace stx {

/// The coefficient of the paper's splat sizes, pixels = coefficient / distance. Lee & Park find it
/// by hand; here the view nearest to the camera decides: its samples, at their
/// mean distance, just close (sqrt(2) spacings). `views` have .view and .blocks with zMin and zMax.
template <class Views>
[[nodiscard]] double paperCoefficient(const Views& views, const RenderSettings& settings,
                                      const Camera& novel) {
    if (settings.splatCoefficient > 0) return settings.splatCoefficient;
    double best = 1e300, coefficient = 1;
    for (const auto& info : views) {
        const auto& c = info.view->camera;
        const double distance =
            glm::distance(c.position, novel.position) - glm::dot(c.forward(), novel.forward());
        if (info.blocks.empty() || distance >= best) continue;
        best = distance;
        double mean = 0;
        for (const auto& b : info.blocks)
            mean += 0.5 * (b.zMin + b.zMax) / static_cast<double>(info.blocks.size());
        const auto spacing = c.sampleSpacing(mean);
        coefficient = std::sqrt(2.0) * std::max(spacing.x * novel.fx, spacing.y * novel.fy);
    }
    return coefficient;
}

}  // namespace stx
