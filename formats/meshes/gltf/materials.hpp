#pragma once

#include <map>
#include <tuple>

#include "formats/meshes/gltf/gltf_file.hpp"

namespace stx::gltf {

/// Which texture coordinates a texture uses, and KHR_texture_transform on them.
struct UvSource {
    bool used = false;
    int set = 0;  ///< n of TEXCOORD_n
    glm::dvec2 offset{0.0};
    glm::dvec2 scale{1.0};
    double rotation = 0;  ///< radians, counter-clockwise as seen with v running down

    [[nodiscard]] glm::vec2 apply(glm::vec2 uv) const;
    bool operator==(const UvSource&) const = default;
};

/// A material of the file as the mesh's material `index`.
struct MaterialUse {
    std::uint32_t index = 0;
    /// Of the mesh's uvs: the base colour's, else those of the first other map that is not for
    /// normals.
    UvSource baseColour;
    UvSource normal, metallicRoughness, emissive;
};

/// Which textures of a material have texture coordinates. Those that share the base colour's go
/// with it.
struct TexturesKept {
    bool baseColour = true, normal = true, metallicRoughness = true, emissive = true;

    auto operator<=>(const TexturesKept&) const = default;
};

/// Makes the mesh's materials from the file's, each when it is first used.
class Materials {
  public:
    Materials(GltfFile& model, MeshBuilder& builder) : model_(model), builder_(builder) {}

    /// `index` of `materials`, or nothing for glTF's default material.
    [[nodiscard]] Result<MaterialUse> use(std::optional<std::uint64_t> index,
                                          const std::string& user);
    /// The same material without textures, for a primitive that lacks their coordinates.
    [[nodiscard]] MaterialUse withoutTextures(const MaterialUse& use, TexturesKept kept);

    /// What materials had that a base colour does not show: name -> count.
    std::map<std::string, int> dropped;

  private:
    [[nodiscard]] Result<MaterialUse> read(std::uint64_t index, const std::string& user);
    /// `info` of the base colour's texture, null where there is none.
    [[nodiscard]] Result<void> readBaseColour(const Json* info, const std::string& where,
                                              Material& m, MaterialUse& use);
    /// A texture whose pixels the caller's picture takes (ModelFiles::replacesColour()).
    [[nodiscard]] int placeOfColour(const SamplerState& state);
    [[nodiscard]] Result<void> readEmissive(const Json& object, const std::string& where,
                                            Material& m, MaterialUse& use);
    [[nodiscard]] Result<void> readMetallicRoughness(const Json* base, bool glossy,
                                                     const std::string& where, Material& m,
                                                     MaterialUse& use);
    /// The mesh's texture that `info` names, -1 (with a note) where it cannot be read.
    [[nodiscard]] Result<int> texture(const Json& info, const std::string& where, UvSource& uv);
    /// Which of the file's images a texture shows; none (with a note) where none can be read.
    [[nodiscard]] Result<std::optional<std::uint64_t>> imageOf(const Json& texture,
                                                               const std::string& where);
    [[nodiscard]] Result<int> readImage(std::uint64_t index, const std::string& textureWhere,
                                        const SamplerState& state);

    GltfFile& model_;
    MeshBuilder& builder_;
    std::map<std::int64_t, MaterialUse> known_;
    std::map<std::pair<std::uint32_t, TexturesKept>, std::uint32_t> plain_;
    std::map<std::tuple<MeshTexture::Wrap, MeshTexture::Wrap, bool>, int> places_;
};

}  // namespace stx::gltf
