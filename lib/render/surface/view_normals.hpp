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

/// What normalBetween() gives for each of `origins` (see DrawnFrame::origin) whose four pixels lie
/// in a view of `views`; zero for the others, and for pixels without an origin. False when one of
/// the others has an origin: those are the caller's, see isBetween().
bool normalsBetween(std::span<const glm::vec3> origins, std::span<const ViewNormals> views,
                    glm::vec3* normals);

/// Whether the four pixels around an origin lie in its view.
[[nodiscard]] bool isBetween(const ViewNormals& view, float u, float v);

}  // namespace stx::surface
