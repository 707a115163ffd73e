#pragma once

#include <glm/glm.hpp>

#include "lib/base/image.hpp"

namespace stx {

/// A rendered picture. All images have the same size; row 0 is on top.
struct Frame {
    /// Premultiplied RGBA in the bundle's own colour space (sRGB-coded 0..1, or linear), lit;
    /// beyond 1 where Lighting::beyondOne lets it, and where splats are brighter than white.
    Image<glm::vec4> colour;
    bool linear = false;      ///< colour is linear light, not sRGB-coded
    Image<glm::vec4> albedo;  ///< as colour, before lighting; empty when not asked for
    Image<float> depth;       ///< planar distance; kNoDepth where nothing was drawn
    Image<glm::vec3> normal;  ///< unit, in the world; zero where unknown; empty when not asked for
    /// Time of drawing, without file input and output. Of a frame that was begun while another was
    /// finished (Renderer::expect): only what the caller waited for.
    double milliseconds = 0;
};

}  // namespace stx
