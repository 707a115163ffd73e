#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace stx {

/// Cuts a simple polygon, flat or nearly so, convex or not, into triangles of its corner numbers,
/// in its own winding. Convex polygons become fans, others lose one ear after the other, and before
/// that corners that are where the next one is; what does not form a simple polygon still gives
/// corners - 2 triangles.
void triangulate(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles);

}  // namespace stx
