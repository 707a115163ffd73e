#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "lib/light/lighting.hpp"
#include "lib/model/mesh.hpp"

namespace stx {

/// Some material says metallic and roughness.
[[nodiscard]] bool hasMetallicRoughness(const Mesh& mesh);
/// Some material gives off light.
[[nodiscard]] bool emits(const Mesh& mesh);

/// Some colour can be brighter than white, by what is given off or by factors above 1.
[[nodiscard]] bool mayExceedWhite(const Mesh& mesh);

/// Where the light goes that a material gives off.
enum class Glow { inColour, apart };

/// Evaluates a mesh's materials and normals at points of its triangles.
class MaterialSampler {
  public:
    /// The mesh must pass check() and outlive the sampler.
    explicit MaterialSampler(const Mesh& mesh, Glow glow = Glow::inColour);

    /// Straight sRGB-coded RGBA, 0 or more, at barycentric coordinates of a triangle.
    [[nodiscard]] glm::vec4 colour(std::uint32_t triangle, glm::vec3 barycentric) const;
    /// Metallic and roughness, 0..1; 0 and 1 where the material does not say them.
    [[nodiscard]] glm::vec2 metallicRoughness(std::uint32_t triangle, glm::vec3 barycentric) const;
    /// Linear light that it gives off, 0 or more.
    [[nodiscard]] glm::vec3 emissive(std::uint32_t triangle, glm::vec3 barycentric) const;
    /// What `lighting`, of the world, makes of `albedo`, the colour() there: shadePhong(), but that
    /// the light it gives off is added whatever falls on it, and an unlit material stays as it is.
    /// `toEye` is unit, `back` as in normal().
    [[nodiscard]] glm::vec3 lit(const Lighting& lighting, std::uint32_t triangle,
                                glm::vec3 barycentric, bool back, glm::vec3 albedo,
                                glm::vec3 position, glm::vec3 toEye) const;
    /// Whether the surface is there at all (alpha mask).
    [[nodiscard]] bool opaqueAt(std::uint32_t triangle, glm::vec3 barycentric) const;
    /// This triangle can have see-through points, so opaqueAt() must be asked.
    [[nodiscard]] bool seeThrough(std::uint32_t triangle) const {
        return seeThrough_[mesh_.triangleMaterial[triangle]];
    }
    /// This triangle's alpha is its coverage (Material::Alpha::blend).
    [[nodiscard]] bool translucent(std::uint32_t triangle) const {
        return translucent_[mesh_.triangleMaterial[triangle]];
    }
    /// The colour of a triangle that has only one, else null.
    [[nodiscard]] const glm::vec3* constantColour(std::uint32_t triangle) const {
        const auto material = mesh_.triangleMaterial[triangle];
        return constant_[material] ? &constantColour_[material] : nullptr;
    }
    /// The uvs of a triangle whose colour is its texture alone, else null.
    [[nodiscard]] const std::vector<glm::vec2>* plainTextureUvs(std::uint32_t triangle) const {
        const auto material = mesh_.triangleMaterial[triangle];
        const bool plain =
            plainTexture_[material] && mesh_.materials[material].baseColourTexture >= 0;
        return plain ? &mesh_.uvs : nullptr;
    }
    /// The base colour texture of a triangle that has one.
    [[nodiscard]] const MeshTexture& texture(std::uint32_t triangle) const {
        return mesh_.textures[mesh_.materials[mesh_.triangleMaterial[triangle]].baseColourTexture];
    }
    /// Unit world normal of the side that is seen, `back` where corners turn clockwise there:
    /// interpolated, normal-mapped where the material says so; the geometric one where the mesh has
    /// no normals; zero on triangles without area. Normals that bend a surface may point away from
    /// the eye (glTF 2.0, 3.9.2 reverses those of back faces only). Where the vertices' normals are
    /// on the triangle's back, as in formats whose winding means nothing, that is its front.
    [[nodiscard]] glm::vec3 normal(std::uint32_t triangle, glm::vec3 barycentric, bool back) const;

  private:
    /// normal(), of the triangle's front.
    [[nodiscard]] glm::vec3 frontNormal(std::uint32_t triangle, glm::vec3 barycentric) const;
    /// Of its front by its winding; its length is twice the area.
    [[nodiscard]] glm::vec3 areaNormal(std::uint32_t triangle) const;
    /// The vertices' normals are on the triangle's back, most of them.
    [[nodiscard]] bool normalsBehind(std::uint32_t triangle) const;
    [[nodiscard]] glm::vec4 colour(std::uint32_t triangle, glm::vec3 barycentric, Glow glow) const;
    /// The texture coordinates of a texture that may have some of its own.
    [[nodiscard]] const std::vector<glm::vec2>& uvsOr(const std::vector<glm::vec2>& own) const {
        return own.empty() ? mesh_.uvs : own;
    }

    const Mesh& mesh_;
    Glow glow_;
    std::vector<bool> seeThrough_;    ///< per material
    std::vector<bool> translucent_;   ///< per material
    std::vector<bool> plainTexture_;  ///< per material: the texture alone decides, no conversion
    std::vector<bool> constant_;      ///< per material: one colour everywhere
    std::vector<glm::vec3> constantColour_;
};

/// Bilinear (or nearest) texel value at uv, straight RGBA 0..1 as stored.
[[nodiscard]] glm::vec4 sampleTexture(const MeshTexture& texture, glm::vec2 uv);

}  // namespace stx
