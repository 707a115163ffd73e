#include "formats/meshes/triangulate.hpp"

#include <cstdint>

namespace stx {
namespace {

double cross(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool inside(glm::dvec2 p, glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) {
    return cross(a, b, p) >= 0 && cross(b, c, p) >= 0 && cross(c, a, p) >= 0;
}

/// The polygon in its own plane, counter-clockwise.
std::vector<glm::dvec2> flatten(std::span<const glm::dvec3> corners) {
    glm::dvec3 normal(0.0);
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const auto a = corners[i], b = corners[(i + 1) % corners.size()];
        normal += glm::cross(a - corners[0], b - corners[0]);
    }
    const auto size = glm::abs(normal);
    std::vector<glm::dvec2> flat;
    flat.reserve(corners.size());
    for (const auto& c : corners) {
        if (size.x >= size.y && size.x >= size.z)
            flat.emplace_back(normal.x < 0 ? c.z : c.y, normal.x < 0 ? c.y : c.z);
        else if (size.y >= size.z)
            flat.emplace_back(normal.y < 0 ? c.x : c.z, normal.y < 0 ? c.z : c.x);
        else
            flat.emplace_back(normal.z < 0 ? c.y : c.x, normal.z < 0 ? c.x : c.y);
    }
    return flat;
}

void fan(std::span<const std::uint32_t> corners, std::vector<glm::uvec3>& triangles) {
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        triangles.emplace_back(corners[0], corners[i], corners[i + 1]);
}

}  // namespace

void triangulate(std::span<const glm::dvec3> corners, std::vector<glm::uvec3>& triangles) {
    const auto n = corners.size();
    if (n < 3) return;
    std::vector<std::uint32_t> rest(n);
    for (std::size_t i = 0; i < n; ++i) rest[i] = static_cast<std::uint32_t>(i);
    if (n == 3) return fan(rest, triangles);
    const auto flat = flatten(corners);
    bool convex = true;
    for (std::size_t i = 0; i < n; ++i)
        convex = convex && cross(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) >= 0;
    // Ears cost n^2 to n^3 steps: a polygon of this many corners is an attack rather than a
    // drawing.
    constexpr std::size_t kMostCorners = 2048;
    if (convex || n > kMostCorners) return fan(rest, triangles);

    std::size_t at = 0, misses = 0;
    while (rest.size() > 3 && misses < rest.size()) {
        const auto m = rest.size();
        const auto before = rest[(at + m - 1) % m], tip = rest[at % m], after = rest[(at + 1) % m];
        bool ear = cross(flat[before], flat[tip], flat[after]) > 0;
        for (std::size_t i = 0; ear && i < m; ++i) {
            const auto other = rest[i];
            if (other == before || other == tip || other == after) continue;
            const auto p = flat[other];
            // Corners at the same place (a bridge to a hole) do not block.
            if (p == flat[before] || p == flat[tip] || p == flat[after]) continue;
            ear = !inside(p, flat[before], flat[tip], flat[after]);
        }
        if (ear) {
            triangles.emplace_back(before, tip, after);
            rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(at % m));
            at = (at + rest.size() - 1) % rest.size();
            misses = 0;
        } else {
            at = (at + 1) % m;
            ++misses;
        }
    }
    fan(rest, triangles);
}

}  // namespace stx
