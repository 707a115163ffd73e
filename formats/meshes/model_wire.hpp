#pragma once

#include <cstdint>
#include <optional>

#include <glm/glm.hpp>

/// What is said between this process and the one that reads models, beside the messages themselves.
/// A header alone, for the module.
namespace stx::models {

/// A name that does not exist on any disk, so that all that is opened is asked for.
inline constexpr const char* kModelFolder = "stx-model/";

/// Assimp's name of the material of what has none.
inline constexpr const char* kUnnamedMaterial = "DefaultMaterial";

/// What textures are for, in the order in which they are sent.
enum class TextureUse : std::uint8_t { diffuse, opacity, emissive, normals };
inline constexpr std::size_t kTextureUses = 4;

/// A bone of a mesh, and how many weights are its own, bone after bone.
struct Bone {
    std::uint32_t node = 0, weights = 0;
    glm::mat4 nodeFromMesh{1.0f};  ///< in the pose that the mesh is in
};
struct BoneWeight {
    std::uint32_t vertex = 0;
    float weight = 0;
};

/// What leads a message of a mesh. Behind it: the length of its name, 64 bits, the name, and
/// positions, normals, colours, texture coordinates, numbers of corners of each face, corners,
/// bones, weights.
struct MeshHead {
    std::uint64_t positions = 0, faces = 0, corners = 0, bones = 0, weights = 0;
    std::uint32_t material = 0;
    std::uint8_t normals = 0, colours = 0, uvs = 0;
    std::uint8_t triangles = 0;  ///< numbers of corners are left out: all are 3
};

/// Bytes of a mesh's arrays; nothing when that is more than can be.
inline std::optional<std::uint64_t> bytesOf(const MeshHead& head) {
    constexpr std::uint64_t kMost = 1ull << 40;
    for (const auto count : {head.positions, head.faces, head.corners, head.bones, head.weights})
        if (count > kMost) return std::nullopt;
    const std::uint64_t each = sizeof(glm::vec3) + (head.normals ? sizeof(glm::vec3) : 0) +
                               (head.colours ? sizeof(glm::vec4) : 0) +
                               (head.uvs ? sizeof(glm::vec2) : 0);
    return head.positions * each + head.bones * sizeof(Bone) + head.weights * sizeof(BoneWeight) +
           sizeof(std::uint32_t) * ((head.triangles ? 0 : head.faces) + head.corners);
}

}  // namespace stx::models
