#include "formats/meshes/fbx_scene.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "formats/meshes/fbx_facts.hpp"
#include "lib/model/mesh.hpp"

namespace stx {
namespace {

/// What is behind a model's name in the names of nodes that Assimp adds for parts of transforms.
constexpr std::string_view kPartOfTransform = "_$AssimpFbx$_";
constexpr std::string_view kGeometricPart = "_$AssimpFbx$_Geometric";

constexpr std::size_t kUnknown = SIZE_MAX;  ///< of a node without a model, and the other way

class FbxScene {
  public:
    FbxScene(const FbxFacts& facts, ForeignScene& scene, Job& job)
        : facts_(facts), scene_(scene), job_(job) {}

    Result<void> complete() {
        for (const auto& note : facts_.lost) job_.note(note);
        matchModels();
        setBones();
        for (auto& material : scene_.materials) complete(material);
        return hide();
    }

  private:
    /// Models and nodes of a name are in the same order, where there are as many of both.
    void matchModels() {
        std::map<std::string_view, std::vector<std::size_t>> models;
        for (std::size_t i = 0; i < facts_.models.size(); ++i)
            models[facts_.models[i].name].push_back(i);
        for (std::size_t i = 1; i < scene_.nodes.size(); ++i)  // the root is of no model
            if (scene_.nodes[i].name.find(kPartOfTransform) == std::string::npos)
                nodesOf_[scene_.nodes[i].name].push_back(i);
        modelOf_.assign(scene_.nodes.size(), kUnknown);
        nodeOf_.assign(facts_.models.size(), kUnknown);
        for (const auto& [name, nodes] : nodesOf_) {
            const auto known = models.find(name);
            if (known == models.end() || known->second.size() != nodes.size()) continue;
            for (std::size_t k = 0; k < nodes.size(); ++k) {
                modelOf_[nodes[k]] = known->second[k];
                nodeOf_[known->second[k]] = nodes[k];
            }
        }
    }

    /// What the geometric parts of a node's transform, which are its parents, do to its mesh.
    [[nodiscard]] glm::mat4 geometricTransform(std::size_t node) const {
        glm::mat4 all(1.0f);
        for (auto up = scene_.nodes[node].parent; up >= 0; up = scene_.nodes[up].parent) {
            if (scene_.nodes[up].name.find(kGeometricPart) == std::string::npos) break;
            all = scene_.nodes[up].parentFromNode * all;
        }
        return all;
    }

    void setBones() {
        std::vector<std::size_t> shownBy(scene_.meshes.size(), kUnknown);
        for (std::size_t i = 0; i < scene_.nodes.size(); ++i)
            for (const auto mesh : scene_.nodes[i].meshes)
                if (shownBy[mesh] == kUnknown) shownBy[mesh] = i;
        std::set<std::string> unsure;
        for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
            if (shownBy[m] == kUnknown || scene_.meshes[m].bones.empty()) continue;
            const auto geometric = geometricTransform(shownBy[m]);
            const auto model = modelOf_[shownBy[m]];
            for (auto& bone : scene_.meshes[m].bones) {
                bone.nodeFromMesh = bone.nodeFromMesh * geometric;
                const auto& name = scene_.nodes[bone.node].name;
                if (const auto node = boneOf(model, name); node != kUnknown)
                    bone.node = static_cast<std::uint32_t>(node);
                else if (const auto same = nodesOf_.find(name);
                         same != nodesOf_.end() && same->second.size() > 1)
                    unsure.insert(name);
            }
        }
        for (const auto& name : unsure)
            job_.note(fmt::format(
                "bone '{}': {} objects have that name, and the first is taken; rename them", name,
                nodesOf_.at(name).size()));
    }

    [[nodiscard]] std::size_t boneOf(std::size_t model, const std::string& name) const {
        if (model == kUnknown) return kUnknown;
        const auto& bones = facts_.models[model].bones;
        const auto bone = bones.find(name);
        return bone == bones.end() ? kUnknown : nodeOf_[bone->second];
    }

    void complete(ForeignScene::Material& material) const {
        const auto known = facts_.materials.find(material.name);
        if (known == facts_.materials.end()) {
            // Assimp's own, of what has none: its colour is not the file's.
            if (material.name == models::kUnnamedMaterial) material.diffuse.reset();
            return;
        }
        const FbxFacts::Material& facts = known->second;
        for (auto& texture : material.textures) {
            const auto said =
                texture ? facts.textures.find(texture->property) : facts.textures.end();
            if (said == facts.textures.end()) continue;
            constexpr auto kClamp = static_cast<std::uint8_t>(MeshTexture::Wrap::clamp);
            if (said->second.clampU) texture->wrapU = kClamp;
            if (said->second.clampV) texture->wrapV = kClamp;
            if (texture->name.empty()) texture->name = said->second.file;
        }
        // A map takes the place of a black colour, but not of its strength, with which Assimp has
        // multiplied it.
        auto& map = material.textures[static_cast<std::size_t>(models::TextureUse::emissive)];
        const auto strength = static_cast<float>(facts.emissiveFactor);
        if (!map || (material.emission && glm::vec3(*material.emission) != glm::vec3(0.0f))) return;
        if (strength > 0)
            material.emission = glm::vec4(glm::vec3(strength), 1.0f);
        else
            map.reset();
    }

    Result<void> hide() {
        std::size_t hidden = 0, shown = 0;
        for (std::size_t i = 0; i < scene_.nodes.size(); ++i) {
            auto& meshes = scene_.nodes[i].meshes;
            if (meshes.empty()) continue;
            const bool hides = modelOf_[i] != kUnknown && facts_.models[modelOf_[i]].hidden;
            ++(hides ? hidden : shown);
            if (hides) meshes.clear();
        }
        if (hidden > 0 && shown == 0)
            return fail(ErrorCode::invalidInput,
                        "all meshes of the model are hidden (Visibility or Show is 0); show what "
                        "is wanted before the file is saved");
        if (hidden > 0)
            job_.note(
                fmt::format("dropped: hidden meshes and lower levels of detail ({})", hidden));
        return {};
    }

    const FbxFacts& facts_;
    ForeignScene& scene_;
    Job& job_;
    std::map<std::string, std::vector<std::size_t>> nodesOf_;  ///< by name
    std::vector<std::size_t> modelOf_;                         ///< of each node; kUnknown: unknown
    std::vector<std::size_t> nodeOf_;                          ///< of each model
};

}  // namespace

Result<void> completeFbx(ByteSpan bytes, ForeignScene& scene, Job& job) {
    const FbxFacts facts = fbxFacts(bytes);
    return FbxScene(facts, scene, job).complete();
}

}  // namespace stx
