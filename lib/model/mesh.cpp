#include "lib/model/mesh.hpp"

#include <cmath>

#include "lib/model/strays.hpp"

namespace stx {

Bounds Mesh::bounds() const {
    return findStrays(*this).bounds;
}

Result<void> Mesh::check() const {
    if (triangles.empty() && points.empty())
        return fail(ErrorCode::invalidInput, "the mesh has neither triangles nor points");
    const auto n = positions.size();
    const auto fits = [&](std::size_t size) { return size == 0 || size == n; };
    if (!fits(normals.size()) || !fits(tangents.size()) || !fits(colours.size()) ||
        !fits(uvs.size()) || !fits(normalUvs.size()) || !fits(metallicRoughnessUvs.size()) ||
        !fits(emissiveUvs.size()))
        return fail(
            ErrorCode::invalidInput,
            "the mesh has {} positions, {} normals, {} colours, {} uvs; all must be as many", n,
            normals.size(), colours.size(), uvs.size());
    if (triangleMaterial.size() != triangles.size())
        return fail(ErrorCode::invalidInput, "the mesh has {} triangles but {} materials for them",
                    triangles.size(), triangleMaterial.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto& t = triangles[i];
        if (t.x >= n || t.y >= n || t.z >= n)
            return fail(ErrorCode::invalidInput,
                        "triangle {} uses vertex {}, but there are only {} vertices", i,
                        std::max({t.x, t.y, t.z}), n);
        if (triangleMaterial[i] >= materials.size())
            return fail(ErrorCode::invalidInput,
                        "triangle {} uses material {}, but there are only {}", i,
                        triangleMaterial[i], materials.size());
    }
    for (const auto p : points) {
        if (p >= n) return fail(ErrorCode::invalidInput, "a point uses vertex {} of {}", p, n);
    }
    for (std::size_t i = 0; i < n; ++i) {
        const auto& p = positions[i];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
            return fail(ErrorCode::invalidInput,
                        "vertex {} is at ({}, {}, {}); positions must be finite", i, p.x, p.y, p.z);
    }
    const auto textureExists = [&](int t) { return t < static_cast<int>(textures.size()); };
    for (std::size_t i = 0; i < textures.size(); ++i) {
        if (textures[i].pixels.empty())
            return fail(ErrorCode::invalidInput, "texture {} has no pixels", i);
    }
    for (const auto& m : materials) {
        if (!textureExists(m.baseColourTexture) || !textureExists(m.normalTexture) ||
            !textureExists(m.emissiveTexture) || !textureExists(m.metallicRoughnessTexture))
            return fail(ErrorCode::invalidInput, "material '{}' uses a texture that does not exist",
                        m.name);
        const auto without = [&](int texture, const std::vector<glm::vec2>& own) {
            return texture >= 0 && uvs.empty() && own.empty();
        };
        if (without(m.baseColourTexture, uvs) || without(m.emissiveTexture, emissiveUvs) ||
            without(m.metallicRoughnessTexture, metallicRoughnessUvs))
            return fail(ErrorCode::invalidInput,
                        "material '{}' has a texture but the mesh has no uvs", m.name);
    }
    return {};
}

}  // namespace stx
