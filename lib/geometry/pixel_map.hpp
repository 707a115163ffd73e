#pragma once

#include <glm/glm.hpp>

#include "lib/geometry/camera.hpp"

namespace stx {

/// Where the pixels of a source are in the novel view: with (u, v) a pixel's index and z its depth,
/// H = (a0 + au u + av v) z + (b0 + bu u + bv v), and then x = H.x / H.z, y = H.y / H.z (or H.x,
/// H.y when the novel camera is orthographic), novel depth H.z. Pixel centres are whole numbers.
struct PixelMap {
    glm::dvec3 a0, au, av, b0, bu, bv;
};

/// Where the pixels of `source` are in the picture of `novel`.
[[nodiscard]] PixelMap pixelMap(const Camera& source, const Camera& novel);

}  // namespace stx
