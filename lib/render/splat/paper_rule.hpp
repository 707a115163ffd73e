#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include <glm/glm.hpp>

#include "lib/render/api/renderer.hpp"
#include "lib/render/splat/prepared.hpp"

namespace stx {

/// The coefficient of the paper's splat sizes, pixels = coefficient / distance. Lee & Park find it
/// by hand; here the view nearest to the camera decides: its samples, at their
/// mean distance, just close (sqrt(2) spacings). Rectangles of one view are side by side.
[[nodiscard]] inline double paperCoefficient(std::span<const splat::PreparedRectangle> rectangles,
                                             const RenderSettings& settings, const Camera& novel) {
    if (settings.splatCoefficient > 0) return settings.splatCoefficient;
    double best = 1e300, coefficient = 1;
    for (std::size_t from = 0, to = 0; from < rectangles.size(); from = to) {
        const Camera& c = rectangles[from].camera();
        double sum = 0, blocks = 0;
        for (; to < rectangles.size() &&
               rectangles[to].rectangle->view == rectangles[from].rectangle->view;
             ++to) {
            for (const auto& b : rectangles[to].blocks) sum += 0.5 * (b.zMin + b.zMax);
            blocks += static_cast<double>(rectangles[to].blocks.size());
        }
        const double distance =
            glm::distance(c.position, novel.position) - glm::dot(c.forward(), novel.forward());
        if (blocks == 0 || distance >= best) continue;
        best = distance;
        const auto spacing = c.sampleSpacing(sum / blocks);
        coefficient = std::sqrt(2.0) * std::max(spacing.x * novel.fx, spacing.y * novel.fy);
    }
    return coefficient;
}

}  // namespace stx
