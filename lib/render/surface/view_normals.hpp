#pragma once

#include <cstdint>
#include <span>

#include <glm/glm.hpp>

namespace stx::surface {

/// Normals of a view that fills a page, row by row; null of others.
struct ViewNormals {
    const glm::vec3* normals = nullptr;
    std::int32_t width = 0, height = 0;
};

/// The unit normal at each of `origins` (see DrawnFrame::origin), bilinear between the four pixels
/// around it; zero where there is none, and where they do not lie in a view of `views`. False when
/// there is one of the latter: those are the caller's, see isBetween().
bool normalsBetween(std::span<const glm::vec3> origins, std::span<const ViewNormals> views,
                    glm::vec3* normals);

/// Whether the four pixels around an origin lie in its view and are not the last ones.
[[nodiscard]] bool isBetween(const ViewNormals& view, float u, float v);

}  // namespace stx::surface
