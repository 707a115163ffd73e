#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "formats/decoders/decoder_process.hpp"
#include "formats/meshes/model_wire.hpp"

namespace stx {

/// Outside of what it is a part of: clang makes none of a nested class before its outer one ends.
struct ForeignTexture {
    std::string name;
    std::string property;                     ///< of FBX, that it is connected to; empty: of no one
    std::uint8_t wrapU = 0, wrapV = 0;        ///< values of MeshTexture::Wrap
    glm::vec2 uvScale{1.0f}, uvOffset{0.0f};  ///< first scaled, then moved; v runs up
    float uvRotationRad = 0;
    std::uint32_t uvSet = 0;     ///< number of the texture coordinates that it is drawn with
    std::int32_t embedded = -1;  ///< its number among ForeignScene::embedded, when inside
};

/// A model as the library that reads it has it, before it is a Mesh: what its process tells
/// (Tag::scene, then Tag::mesh for each mesh). Numbers of meshes, nodes and vertices are checked.
struct ForeignScene {
    using Texture = ForeignTexture;
    using Use = models::TextureUse;
    struct Material {
        std::string name;
        std::optional<glm::vec4> diffuse, emission;
        std::optional<float> opacity;
        std::array<std::optional<Texture>, models::kTextureUses> textures;  ///< by Use
        bool hasBump = false, hasDisplacement = false;
    };
    /// A picture inside the model's own file.
    struct Embedded {
        bool coded = false;  ///< a PNG or JPEG as it is; else plain texels, which are left out
        Bytes bytes;
    };
    struct Node {
        std::int32_t parent = -1;  ///< comes before it; -1: the root
        std::string name;
        glm::mat4 parentFromNode{1.0f};
        std::vector<std::uint32_t> meshes;
    };
    struct Mesh {
        std::string name;
        std::uint32_t material = 0;
        std::vector<glm::vec3> positions;
        std::vector<glm::vec3> normals;  ///< as many, or none; so are the next two
        std::vector<glm::vec4> colours;
        std::vector<glm::vec2> uvs;               ///< of the set of its material's first texture
        std::vector<std::uint32_t> cornerCounts;  ///< of each face; empty: all are triangles
        std::vector<std::uint32_t> corners;       ///< numbers of positions, face after face
        std::vector<models::Bone> bones;
        std::vector<models::BoneWeight> weights;  ///< bone after bone
    };

    std::vector<Material> materials;
    std::vector<Embedded> embedded;
    std::vector<Node> nodes;
    std::vector<Mesh> meshes;
    std::uint32_t animations = 0, cameras = 0, lights = 0;
};

/// What a process tells of a model, after Tag::scene with these bytes. Errors (invalidInput): it
/// makes no sense, or needs more than the memory limit.
[[nodiscard]] Result<ForeignScene> receiveScene(DecoderProcess& process, ByteSpan content,
                                                const Limits& limits);

}  // namespace stx
