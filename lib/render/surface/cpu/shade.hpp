#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/render/surface/cpu/fuse.hpp"
#include "lib/render/surface/plan/plan.hpp"

namespace stx::surface {

/// A source as the shader reads it.
struct ShadeSource {
    const Source* source = nullptr;
    Warp sourceFromPixel;  ///< from frame pixel positions
    Ray fromEye{};         ///< from the source's eye to a point of the frame
};

/// The colour of each piece, straight RGB: a quadratic is fitted to all samples of the sources that
/// see it, mapped into the frame along its tangent plane, and read in the middle (moving least
/// squares). `bestSource` becomes the local index of the source that weighed most, -1 = none.
void shadePieces(const Pieces& pieces, std::span<const ShadeSource> sources, const Ray& fromEye,
                 const ShadeSettings& settings, std::vector<glm::vec3>& colours,
                 std::vector<std::int8_t>& bestSource);

}  // namespace stx::surface
