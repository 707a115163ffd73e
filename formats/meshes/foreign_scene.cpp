#include "formats/meshes/foreign_scene.hpp"

#include <algorithm>

namespace stx {
namespace {

using decoders::Unpacker;

template <class T>
std::optional<T> optionally(Unpacker& in) {
    if (in.get<std::uint8_t>() == 0) return std::nullopt;
    return in.get<T>();
}

ForeignScene::Material materialIn(Unpacker& in) {
    ForeignScene::Material material;
    material.name = in.getText();
    material.diffuse = optionally<glm::vec4>(in);
    material.emission = optionally<glm::vec4>(in);
    material.opacity = optionally<float>(in);
    for (auto& texture : material.textures) {
        if (in.get<std::uint8_t>() == 0) continue;
        auto& to = texture.emplace();
        to.name = in.getText();
        to.property = in.getText();
        to.wrapU = in.get<std::uint8_t>();
        to.wrapV = in.get<std::uint8_t>();
        to.uvScale = in.get<glm::vec2>();
        to.uvOffset = in.get<glm::vec2>();
        to.uvRotationRad = in.get<float>();
        to.uvSet = in.get<std::uint32_t>();
        to.embedded = in.get<std::int32_t>();
    }
    material.hasBump = in.get<std::uint8_t>() != 0;
    material.hasDisplacement = in.get<std::uint8_t>() != 0;
    return material;
}

ForeignScene::Node nodeIn(Unpacker& in) {
    ForeignScene::Node node;
    node.parent = in.get<std::int32_t>();
    node.name = in.getText();
    node.parentFromNode = in.get<glm::mat4>();
    const auto meshes = in.getBytes();
    node.meshes.resize(meshes.size() / sizeof(std::uint32_t));
    if (!node.meshes.empty())
        std::memcpy(node.meshes.data(), meshes.data(), node.meshes.size() * sizeof(std::uint32_t));
    return node;
}

/// What is before the meshes; nothing when it makes no sense. Nothing is made for a count before
/// what it counts is there.
std::optional<ForeignScene> sceneIn(ByteSpan content, std::uint32_t& meshes) {
    Unpacker in(content);
    ForeignScene scene;
    for (auto n = in.get<std::uint32_t>(); n > 0 && in.ok(); --n)
        scene.materials.push_back(materialIn(in));
    for (auto n = in.get<std::uint32_t>(); n > 0 && in.ok(); --n) {
        auto& to = scene.embedded.emplace_back();
        to.coded = in.get<std::uint8_t>() != 0;
        const auto bytes = in.getBytes();
        to.bytes.assign(bytes.begin(), bytes.end());
    }
    for (auto n = in.get<std::uint32_t>(); n > 0 && in.ok(); --n) {
        const auto before = static_cast<std::int64_t>(scene.nodes.size());
        scene.nodes.push_back(nodeIn(in));
        if (scene.nodes.back().parent >= before) return std::nullopt;
    }
    meshes = in.get<std::uint32_t>();
    scene.animations = in.get<std::uint32_t>();
    scene.cameras = in.get<std::uint32_t>();
    scene.lights = in.get<std::uint32_t>();
    const auto known = [&](std::uint32_t mesh) { return mesh < meshes; };
    const bool all = std::ranges::all_of(
        scene.nodes, [&](const auto& node) { return std::ranges::all_of(node.meshes, known); });
    for (const auto& material : scene.materials) {
        for (const auto& texture : material.textures)
            if (texture && texture->embedded >= static_cast<std::int64_t>(scene.embedded.size()))
                return std::nullopt;
    }
    if (!in.ok() || !all) return std::nullopt;
    return scene;
}

template <class T>
bool receiveArray(DecoderProcess& process, std::vector<T>& to, std::uint64_t count) {
    to.resize(count);
    return process.receive(to.data(), count * sizeof(T));
}

Result<ForeignScene::Mesh> receiveMesh(DecoderProcess& process, std::size_t nodes,
                                       const Limits& limits, std::uint64_t& total) {
    constexpr std::uint64_t kLongestName = 1 << 16;
    decoders::MessageHead head;
    std::uint64_t nameLength = 0;
    ForeignScene::Mesh mesh;
    models::MeshHead facts;
    if (!process.receiveHead(head) || head.tag != decoders::Tag::mesh ||
        !process.receive(&facts, sizeof(facts)) ||
        !process.receive(&nameLength, sizeof(nameLength)) || nameLength > kLongestName)
        return process.lost();
    const auto arrays = models::bytesOf(facts);
    if (!arrays || head.size != sizeof(facts) + sizeof(nameLength) + nameLength + *arrays)
        return process.lost();
    // Nothing is behind a mesh that is larger than what may be held.
    total += *arrays;
    STX_CHECK(limits.checkAllocation(total, 1, "the model"));
    mesh.material = facts.material;
    mesh.name.resize(nameLength);
    if (!process.receive(mesh.name.data(), nameLength) ||
        !receiveArray(process, mesh.positions, facts.positions) ||
        !receiveArray(process, mesh.normals, facts.normals ? facts.positions : 0) ||
        !receiveArray(process, mesh.colours, facts.colours ? facts.positions : 0) ||
        !receiveArray(process, mesh.uvs, facts.uvs ? facts.positions : 0) ||
        !receiveArray(process, mesh.cornerCounts, facts.triangles ? 0 : facts.faces) ||
        !receiveArray(process, mesh.corners, facts.corners) ||
        !receiveArray(process, mesh.bones, facts.bones) ||
        !receiveArray(process, mesh.weights, facts.weights))
        return process.lost();
    std::uint64_t corners = facts.triangles ? facts.faces * 3 : 0;
    for (const std::uint32_t count : mesh.cornerCounts) corners += count;
    const bool inside = std::ranges::all_of(
        mesh.corners, [&](std::uint32_t corner) { return corner < facts.positions; });
    std::uint64_t weights = 0;
    for (const auto& bone : mesh.bones) weights += bone.weights;
    const bool bonesFit =
        weights == facts.weights &&
        std::ranges::all_of(mesh.bones, [&](const auto& bone) { return bone.node < nodes; }) &&
        std::ranges::all_of(mesh.weights,
                            [&](const auto& weight) { return weight.vertex < facts.positions; });
    if (corners != facts.corners || !inside || !bonesFit) return process.lost();
    return mesh;
}

}  // namespace

Result<ForeignScene> receiveScene(DecoderProcess& process, ByteSpan content, const Limits& limits) {
    std::uint32_t meshes = 0;
    auto scene = sceneIn(content, meshes);
    if (!scene) return process.lost();
    std::uint64_t total = content.size();
    for (std::uint32_t i = 0; i < meshes; ++i) {
        STX_TRY(auto mesh, receiveMesh(process, scene->nodes.size(), limits, total));
        scene->meshes.push_back(std::move(mesh));
    }
    return std::move(*scene);
}

}  // namespace stx
