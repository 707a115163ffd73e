#pragma once

#include <memory>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/base/result.hpp"
#include "lib/geometry/bounds.hpp"
#include "lib/model/texture.hpp"

namespace stx {

struct SplatCloud;

/// A picture on a mesh: 8-bit RGBA, straight alpha.
struct MeshTexture {
    enum class Wrap { repeat, mirror, clamp };
    Rgba8Image pixels;  ///< row 0 is v = 0 (glTF's convention: v runs down)
    Wrap wrapU = Wrap::repeat;
    Wrap wrapV = Wrap::repeat;
    bool nearest = false;  ///< magnification without interpolation
};

/// How a triangle looks (glTF 2.0 metallic-roughness). Pictures show its base colour and emission;
/// metallic and roughness are for engines (CaptureSettings::materials).
struct Material {
    enum class Alpha { opaque, mask, blend };
    std::string name;
    glm::vec4 baseColour{1.0f};         ///< linear factor, multiplies texture and vertex colour
    int baseColourTexture = -1;         ///< index into Mesh::textures, -1 = none; sRGB-coded
    glm::vec3 emissive{0.0f};           ///< linear, added to the base colour; may exceed 1
    int emissiveTexture = -1;           ///< multiplies `emissive`, -1 = none; sRGB-coded
    float metallic = 0.0f;              ///< 0..1, where hasMetallicRoughness
    float roughness = 1.0f;             ///< 0..1
    int metallicRoughnessTexture = -1;  ///< G multiplies roughness, B metallic
    bool hasMetallicRoughness = false;  ///< the file says the two
    int normalTexture = -1;             ///< tangent-space normal map, -1 = none; linear
    float normalScale = 1.0f;
    Alpha alpha = Alpha::opaque;
    float alphaCutoff = 0.5f;  ///< for Alpha::mask
    bool doubleSided = true;   ///< false: back faces are not drawn
    bool unlit = false;        ///< keeps its colour under lights (KHR_materials_unlit)
    bool hasColour = true;     ///< false: nobody gave a colour, baseColour is white for lack of one
};

/// Triangles (and loose points) in the world, all node transforms and instances applied.
/// Per-vertex arrays are empty or as long as `positions`.
struct Mesh {
    /// Added to `positions`, gives the world's coordinates: 0 unless these are so large that floats
    /// would round them (see originFor()). All else here and in lib counts from it.
    glm::dvec3 origin{0.0};
    std::vector<glm::vec3> positions;  ///< scene units, +Y up
    std::vector<glm::vec3> normals;    ///< unit; 0 of points and unused vertices that have none
    std::vector<glm::vec4> tangents;   ///< xyz unit, w = handedness (only with normal maps)
    std::vector<glm::vec4> colours;    ///< linear RGBA, multiplies the base colour
    std::vector<glm::vec2> uvs;  ///< of the base colour texture, its transform applied; v down
    // Of the other textures, each when it differs from uvs for some material.
    std::vector<glm::vec2> normalUvs;
    std::vector<glm::vec2> metallicRoughnessUvs;
    std::vector<glm::vec2> emissiveUvs;

    std::vector<glm::uvec3> triangles;            ///< indices into the vertex arrays
    std::vector<std::uint32_t> triangleMaterial;  ///< one per triangle, index into materials
    std::vector<std::uint32_t> points;            ///< vertices drawn as points (point clouds)

    /// A cloud of Gaussians, drawn in place of everything else; `positions` are their centres then,
    /// and `points` those that frame it. Null: none.
    std::shared_ptr<const SplatCloud> splats;

    std::vector<Material> materials;  ///< at least one when there are triangles
    std::vector<MeshTexture> textures;

    /// Of all that is drawn, but for the few small pieces that lie far off (findStrays()).
    [[nodiscard]] Bounds bounds() const;
    /// Errors on indices out of range, arrays of unlike length, NaN or infinite positions, and on a
    /// mesh with neither triangles nor points.
    [[nodiscard]] Result<void> check() const;
};

}  // namespace stx
