#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/render/surface/cpu/fuse.hpp"

namespace stx::surface {

/// Three affine functions of (x, y, q): the vector from an eye to the point, up to a positive
/// scale.
using Ray = std::array<float, 12>;

/// A source as the shader reads it.
struct ShadeSource {
    const Source* source = nullptr;
    Warp sourceFromPixel;  ///< from frame pixel positions
    Ray fromEye{};         ///< from the source's eye to a point of the frame
};

/// How colours are fitted; see shadePieces().
struct ShadeSettings {
    int mostSources = 4;    ///< sources that one piece takes colours from
    float kernel = 3.0f;    ///< squared radius of the fit, target pixels
    float ridge = 0.0015f;  ///< holds the linear and quadratic terms down
};

/// The vector from a camera's eye to the point (x, y, q) of a frame (orthographic: along its axis).
[[nodiscard]] Ray rayFrom(const PixelSpace& eye, const PixelSpace& frame);

/// The colour of each piece, straight RGB: a quadratic is fitted to all samples of the sources that
/// see it, mapped into the frame along its tangent plane, and read in the middle (moving least
/// squares). `bestSource` becomes the local index of the source that weighed most, -1 = none.
void shadePieces(const Pieces& pieces, std::span<const ShadeSource> sources, const Ray& fromEye,
                 const ShadeSettings& settings, std::vector<glm::vec3>& colours,
                 std::vector<std::int8_t>& bestSource);

}  // namespace stx::surface
