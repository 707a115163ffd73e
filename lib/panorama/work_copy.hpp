#pragma once

#include <vector>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

namespace stx::panorama {

/// A picture as it is worked on: reduced when it is large.
struct WorkCopy {
    Rgba8Image colour;
    Image<std::uint8_t> grey;  ///< luma of the same
    glm::ivec2 fullSize{0};    ///< of the picture it was made from

    /// Half the diagonal of the full picture, in its own pixels.
    [[nodiscard]] double fullHalfDiagonal() const {
        return 0.5 * glm::length(glm::dvec2(fullSize));
    }
    /// Half the diagonal of the copy.
    [[nodiscard]] double halfDiagonal() const {
        return 0.5 * glm::length(glm::dvec2(colour.size()));
    }
    /// The corner of the picture, in a TurnLens's units.
    [[nodiscard]] glm::dvec2 extent() const {
        return 0.5 * glm::dvec2(fullSize) / fullHalfDiagonal();
    }
    /// A pixel position (0, 0 is the upper left corner) of the copy from one in a TurnLens's units,
    /// and back.
    [[nodiscard]] glm::dvec2 pixel(glm::dvec2 p) const {
        const glm::dvec2 e = 2.0 * extent();
        return {(0.5 + p.x / e.x) * colour.width(), (0.5 - p.y / e.y) * colour.height()};
    }
    [[nodiscard]] glm::dvec2 position(glm::dvec2 pixel) const {
        const glm::dvec2 e = 2.0 * extent();
        return {(pixel.x / colour.width() - 0.5) * e.x, (0.5 - pixel.y / colour.height()) * e.y};
    }
};

/// The copy, whose longer side is at most `maxSide` pixels. The mean of the area that a pixel
/// covers, of alpha, too.
[[nodiscard]] WorkCopy makeWorkCopy(Rgba8Image picture, int maxSide);

/// A picture of width / 2 x height / 2, rounded down but at least 1, smoothed by 1 3 3 1.
[[nodiscard]] Image<float> halved(const Image<float>& image);

/// A value between pixels; the edge's beyond the edge. (0.5, 0.5) is the first pixel's centre.
[[nodiscard]] float sampleLinear(const Image<float>& image, double x, double y);

}  // namespace stx::panorama
