#include <cmath>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "formats/meshes/gltf/primitive.hpp"
#include "formats/meshes/gltf/splats.hpp"
#include "formats/meshes/readers.hpp"
#include "lib/splats/transform.hpp"

namespace stx {
namespace gltf {
namespace {

glm::dmat4 fromTrs(glm::dvec3 translation, glm::dvec4 rotation, glm::dvec3 scale) {
    const double length = glm::length(rotation);
    const glm::dquat q = length > 0 ? glm::dquat(rotation.w / length, rotation.x / length,
                                                 rotation.y / length, rotation.z / length)
                                    : glm::dquat(1, 0, 0, 0);
    auto m = glm::translate(glm::dmat4(1.0), translation) * glm::mat4_cast(q);
    return glm::scale(m, scale);
}

/// Transforms a part; a mirroring transform turns the triangles around.
void transform(MeshPart& part, const glm::dmat4& worldFromMesh) {
    const glm::dmat3 linear(worldFromMesh);
    const double determinant = glm::determinant(linear);
    // The cofactor matrix is the inverse transpose but for a factor, and exists for flat
    // transforms.
    const glm::dmat3 forNormals(glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
                                glm::cross(linear[0], linear[1]));
    const double side = determinant < 0 ? -1.0 : 1.0;
    for (auto& p : part.positions) p = glm::dvec3(worldFromMesh * glm::dvec4(p, 1.0));
    for (auto& n : part.normals) {
        const auto turned = forNormals * glm::dvec3(n) * side;
        const double length = glm::length(turned);
        n = length > 0 ? glm::vec3(turned / length) : glm::vec3(0);
    }
    for (auto& t : part.tangents)
        t = glm::vec4(glm::vec3(linear * glm::dvec3(t)), t.w * static_cast<float>(side));
    if (determinant < 0) {
        for (auto& t : part.triangles) std::swap(t.y, t.z);
    }
}

class SceneReader {
  public:
    SceneReader(GltfFile& model, MeshBuilder& builder)
        : model_(model), builder_(builder), materials_(model, builder) {}

    Result<Mesh> read() {
        STX_CHECK(readNodes());
        STX_CHECK(readScene());
        if (splats_.centres.empty()) {
            say();
            return builder_.finish();
        }
        if (const auto n = builder_.parts()) dropped_["primitives that are no splats"] += n;
        say();
        return meshOfSplats(std::move(splats_), model_.job());
    }

  private:
    struct Node {
        const Json* json = nullptr;
        std::vector<std::uint64_t> children;
        std::int64_t parent = -1;  ///< the first one
        glm::dmat4 parentFromNode{1.0};
        glm::dmat4 worldFromNode{1.0};
    };

    [[nodiscard]] const Json& root() const { return model_.root(); }

    Result<glm::dmat4> localMatrix(const Json& node, const std::string& where) {
        glm::dmat4 matrix(1.0);
        double values[16];
        STX_TRY(const bool hasMatrix, getNumbers(node, "matrix", where, values));
        if (hasMatrix) {
            for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = values[i];
            return matrix;
        }
        glm::dvec3 translation(0.0), scale(1.0);
        glm::dvec4 rotation(0, 0, 0, 1);
        STX_CHECK(getNumbers(node, "translation", where, {&translation.x, 3}));
        STX_CHECK(getNumbers(node, "rotation", where, {&rotation.x, 4}));
        STX_CHECK(getNumbers(node, "scale", where, {&scale.x, 3}));
        return fromTrs(translation, rotation, scale);
    }

    /// All nodes with their transforms; errors when one is its own ancestor.
    Result<void> readNodes() {
        const auto count = listSize(root(), "nodes");
        STX_CHECK(builder_.charge(count, sizeof(Node), "the node list"));
        nodes_.resize(count);
        for (std::size_t i = 0; i < count; ++i) {
            const auto where = fmt::format("nodes[{}]", i);
            STX_TRY(nodes_[i].json, element(root(), "nodes", i, "glTF"));
            STX_TRY(nodes_[i].parentFromNode, localMatrix(*nodes_[i].json, where));
            STX_TRY(nodes_[i].children, getIndices(*nodes_[i].json, "children", where));
            for (const auto child : nodes_[i].children) {
                if (child >= count)
                    return fail(ErrorCode::invalidInput,
                                "{} has the child {}, but there are only {} nodes", where, child,
                                count);
                if (nodes_[child].parent < 0) nodes_[child].parent = static_cast<std::int64_t>(i);
            }
        }
        // Depth-first without recursion: a file may be deeper than the stack.
        enum class State : std::uint8_t { unseen, open, done };
        std::vector<State> states(count, State::unseen);
        std::vector<std::uint64_t> childrenFirst;
        std::vector<std::pair<std::uint64_t, std::size_t>> stack;
        for (std::size_t start = 0; start < count; ++start) {
            if (states[start] != State::unseen) continue;
            stack.emplace_back(start, 0);
            states[start] = State::open;
            while (!stack.empty()) {
                auto& [node, next] = stack.back();
                const auto& children = nodes_[node].children;
                if (next == children.size()) {
                    states[node] = State::done;
                    childrenFirst.push_back(node);
                    stack.pop_back();
                    continue;
                }
                const auto child = children[next++];
                if (states[child] == State::open)
                    return fail(
                        ErrorCode::invalidInput,
                        "nodes[{}] is its own ancestor; the nodes must form a tree without cycles",
                        child);
                if (states[child] == State::unseen) {
                    states[child] = State::open;
                    stack.emplace_back(child, 0);
                }
            }
        }
        for (auto it = childrenFirst.rbegin(); it != childrenFirst.rend(); ++it) {
            auto& node = nodes_[*it];
            node.worldFromNode = node.parent < 0
                                     ? node.parentFromNode
                                     : nodes_[node.parent].worldFromNode * node.parentFromNode;
        }
        return {};
    }

    struct Visit {
        std::uint64_t node = 0;
        glm::dmat4 worldFromNode{1.0};
    };

    /// Nodes of the scene, parents first. The standard wants a tree; files with a node below
    /// several parents exist and mean an instance for each.
    Result<std::vector<Visit>> sceneNodes() {
        const auto scenes = listSize(root(), "scenes");
        STX_TRY(const auto chosen, getUint(root(), "scene", "glTF"));
        std::vector<std::uint64_t> roots;
        if (chosen || scenes > 0) {
            const auto index = chosen.value_or(0);
            STX_TRY(const Json* scene, element(root(), "scenes", index, "scene"));
            STX_TRY(roots, getIndices(*scene, "nodes", fmt::format("scenes[{}]", index)));
            if (scenes > 1)
                model_.job().note(
                    fmt::format("scene {} of {} is read; the others are dropped", index, scenes));
            for (const auto n : roots) {
                if (n >= nodes_.size())
                    return fail(ErrorCode::invalidInput,
                                "scenes[{}] has node {}, but there are only {}", index, n,
                                nodes_.size());
            }
        } else {
            for (std::size_t i = 0; i < nodes_.size(); ++i) {
                if (nodes_[i].parent < 0) roots.push_back(i);
            }
        }
        constexpr std::size_t kMaxVisits = 1 << 20;
        std::vector<Visit> order, stack;
        for (auto it = roots.rbegin(); it != roots.rend(); ++it)
            stack.push_back({*it, nodes_[*it].worldFromNode});
        while (!stack.empty()) {
            const auto visit = stack.back();
            stack.pop_back();
            // What is below a hidden node is hidden, too.
            STX_TRY(const bool hidden, isHidden(visit.node));
            if (hidden) continue;
            order.push_back(visit);
            const auto& children = nodes_[visit.node].children;
            if (order.size() + stack.size() + children.size() > kMaxVisits)
                return fail(
                    ErrorCode::invalidInput,
                    "the scene shows more than {} nodes, counting those with several parents each "
                    "time",
                    kMaxVisits);
            for (auto it = children.rbegin(); it != children.rend(); ++it)
                stack.push_back({*it, visit.worldFromNode * nodes_[*it].parentFromNode});
        }
        return order;
    }

    Result<bool> isHidden(std::uint64_t node) {
        const auto where = fmt::format("nodes[{}]", node);
        STX_TRY(const Json* visibility,
                getExtension(*nodes_[node].json, "KHR_node_visibility", where));
        if (!visibility) return false;
        STX_TRY(const auto visible,
                getBool(*visibility, "visible", where + ".extensions.KHR_node_visibility"));
        return !visible.value_or(true);
    }

    Result<void> readScene() {
        const auto meshCount = listSize(root(), "meshes");
        if (nodes_.empty() && meshCount > 0) {
            model_.job().note("the file has no nodes; its meshes are taken as they are");
            for (std::size_t m = 0; m < meshCount; ++m)
                STX_CHECK(addMesh(m, "glTF", {}, {glm::dmat4(1.0)}, nullptr, false));
            return {};
        }
        STX_TRY(const auto order, sceneNodes());
        // Meshes that several nodes show are decoded once.
        std::map<std::uint64_t, int> uses;
        for (const auto& [i, worldFromNode] : order) {
            STX_TRY(const auto mesh, getUint(*nodes_[i].json, "mesh", fmt::format("nodes[{}]", i)));
            if (mesh) ++uses[*mesh];
        }
        for (const auto& [i, worldFromNode] : order) {
            const auto& node = *nodes_[i].json;
            const auto where = fmt::format("nodes[{}]", i);
            if (node.contains("camera")) ++dropped_["cameras"];
            STX_TRY(const Json* light, getExtension(node, "KHR_lights_punctual", where));
            if (light) ++dropped_["lights"];
            STX_TRY(const auto mesh, getUint(node, "mesh", where));
            if (!mesh) continue;
            std::vector<glm::dmat4> transforms;
            STX_TRY(transforms, instances(node, where, worldFromNode));
            std::vector<glm::dmat4> joints;
            STX_TRY(const auto skin, getUint(node, "skin", where));
            if (skin) STX_SET(joints, skinMatrices(*skin, where));
            std::vector<double> weights;
            STX_TRY(weights, morphWeights(node, where));
            STX_CHECK(addMesh(*mesh, where, weights, transforms, skin ? &joints : nullptr,
                              uses[*mesh] > 1 && weights.empty()));
        }
        return {};
    }

    Result<std::vector<double>> morphWeights(const Json& object, const std::string& where) {
        std::vector<double> weights;
        STX_TRY(const Json* array, getArray(object, "weights", where));
        if (!array) return weights;
        weights.resize(array->size());
        STX_CHECK(getNumbers(object, "weights", where, weights));
        return weights;
    }

    /// The node's transform, or one for each instance of EXT_mesh_gpu_instancing.
    Result<std::vector<glm::dmat4>> instances(const Json& node, const std::string& where,
                                              const glm::dmat4& worldFromNode) {
        std::vector<glm::dmat4> transforms;
        STX_TRY(const Json* extension, getExtension(node, "EXT_mesh_gpu_instancing", where));
        if (!extension) {
            transforms.push_back(worldFromNode);
            return transforms;
        }
        STX_TRY(const Json* attributes, getObject(*extension, "attributes", where));
        if (!attributes)
            return fail(ErrorCode::invalidInput, "{}: instances without attributes", where);
        std::size_t count = 0;
        const auto read = [&](const char* name,
                              std::string_view type) -> Result<std::optional<AccessorValues>> {
            STX_TRY(const auto index, getUint(*attributes, name, where));
            if (!index) return std::nullopt;
            STX_TRY(auto values, model_.accessor(*index, where + " " + name, {type}));
            if (count != 0 && values.count != count)
                return fail(ErrorCode::invalidInput,
                            "{}: instance attributes of {} and {} elements", where, count,
                            values.count);
            count = values.count;
            return values;
        };
        STX_TRY(const auto translation, read("TRANSLATION", "VEC3"));
        STX_TRY(const auto rotation, read("ROTATION", "VEC4"));
        STX_TRY(const auto scale, read("SCALE", "VEC3"));
        STX_CHECK(builder_.charge(count, sizeof(glm::dmat4), where));
        for (std::size_t i = 0; i < count; ++i) {
            glm::dvec3 t(0.0), s(1.0);
            glm::dvec4 r(0, 0, 0, 1);
            for (int c = 0; c < 3; ++c) {
                if (translation) t[c] = translation->at(i, c);
                if (scale) s[c] = scale->at(i, c);
            }
            for (int c = 0; c < 4 && rotation; ++c) r[c] = rotation->at(i, c);
            transforms.push_back(worldFromNode * fromTrs(t, r, s));
        }
        return transforms;
    }

    Result<std::vector<glm::dmat4>> skinMatrices(std::uint64_t index, const std::string& user) {
        STX_TRY(const Json* skin, element(root(), "skins", index, user));
        const auto where = fmt::format("skins[{}]", index);
        STX_TRY(const auto joints, getIndices(*skin, "joints", where));
        if (joints.empty()) return fail(ErrorCode::invalidInput, "{} has no joints", where);
        std::optional<AccessorValues> inverse;
        STX_TRY(const auto accessor, getUint(*skin, "inverseBindMatrices", where));
        if (accessor) {
            STX_TRY(inverse, model_.accessor(*accessor, where, {"MAT4"}));
            if (inverse->count < joints.size())
                return fail(ErrorCode::invalidInput,
                            "{} has {} joints but only {} inverse bind matrices", where,
                            joints.size(), inverse->count);
        }
        std::vector<glm::dmat4> matrices;
        for (std::size_t j = 0; j < joints.size(); ++j) {
            if (joints[j] >= nodes_.size())
                return fail(ErrorCode::invalidInput,
                            "{}.joints[{}] is node {}, but there are only {}", where, j, joints[j],
                            nodes_.size());
            glm::dmat4 bind(1.0);
            for (int c = 0; c < 16 && inverse; ++c) bind[c / 4][c % 4] = inverse->at(j, c);
            matrices.push_back(nodes_[joints[j]].worldFromNode * bind);
        }
        return matrices;
    }

    /// Poses a skinned primitive. A skinned mesh does not follow its node (glTF 2.0, 3.7.3.3).
    Result<void> pose(Primitive& primitive, const std::vector<glm::dmat4>& joints) {
        auto& part = primitive.part;
        double handedness = 0;
        for (std::size_t i = 0; i < part.positions.size(); ++i) {
            glm::dmat4 blend(0.0);
            double sum = 0;
            for (const auto& influence : primitive.influences) {
                for (int c = 0; c < 4; ++c) {
                    const double weight = influence.weights.at(i, c);
                    if (weight == 0) continue;
                    const double joint = influence.joints.at(i, c);
                    if (!(joint >= 0) || joint >= static_cast<double>(joints.size()) ||
                        !std::isfinite(weight))
                        return fail(
                            ErrorCode::invalidInput,
                            "{}: vertex {} follows joint {} by {}, but the skin has {} joints",
                            part.where, i, joint, weight, joints.size());
                    blend += joints[static_cast<std::size_t>(joint)] * weight;
                    sum += weight;
                }
            }
            if (sum == 0)
                blend = joints[0];
            else
                blend /= sum;
            const glm::dmat3 linear(blend);
            const double determinant = glm::determinant(linear);
            handedness += determinant < 0 ? -1 : 1;
            part.positions[i] = glm::dvec3(blend * glm::dvec4(part.positions[i], 1.0));
            if (!part.normals.empty()) {
                const glm::dmat3 forNormals(glm::cross(linear[1], linear[2]),
                                            glm::cross(linear[2], linear[0]),
                                            glm::cross(linear[0], linear[1]));
                const auto n =
                    forNormals * glm::dvec3(part.normals[i]) * (determinant < 0 ? -1.0 : 1.0);
                const double length = glm::length(n);
                part.normals[i] = length > 0 ? glm::vec3(n / length) : glm::vec3(0);
            }
            if (!part.tangents.empty())
                part.tangents[i] = glm::vec4(glm::vec3(linear * glm::dvec3(part.tangents[i])),
                                             part.tangents[i].w * (determinant < 0 ? -1.0f : 1.0f));
        }
        if (handedness < 0) {
            for (auto& t : part.triangles) std::swap(t.y, t.z);
        }
        return {};
    }

    Result<void> addMesh(std::uint64_t index, const std::string& user,
                         const std::vector<double>& nodeWeights,
                         const std::vector<glm::dmat4>& transforms,
                         const std::vector<glm::dmat4>* joints, bool keep) {
        STX_CHECK(addSplatsOf(index, user, transforms));
        std::vector<Primitive> fresh;
        const std::vector<Primitive>* primitives = &fresh;
        if (const auto it = meshes_.find(index); it != meshes_.end() && nodeWeights.empty()) {
            primitives = &it->second;
        } else {
            STX_TRY(const Json* mesh, element(root(), "meshes", index, user));
            const auto where = fmt::format("meshes[{}]", index);
            auto weights = nodeWeights;
            if (weights.empty()) STX_SET(weights, morphWeights(*mesh, where));
            STX_TRY(const Json* list, getArray(*mesh, "primitives", where));
            for (std::size_t p = 0; list && p < list->size(); ++p) {
                const auto at = fmt::format("{}.primitives[{}]", where, p);
                if (!(*list)[p].is_object())
                    return fail(ErrorCode::invalidInput, "{} is not an object", at);
                STX_TRY(const Json* splats, splatsIn((*list)[p], at));
                if (splats) continue;
                STX_TRY(auto primitive, readPrimitive(model_, builder_, materials_, (*list)[p], at,
                                                      weights, dropped_));
                if (primitive.drawn) fresh.push_back(std::move(primitive));
            }
            if (keep) primitives = &meshes_.emplace(index, std::move(fresh)).first->second;
        }
        for (const auto& primitive : *primitives) {
            if (joints && !primitive.influences.empty()) {
                auto posed = primitive;
                STX_CHECK(pose(posed, *joints));
                STX_CHECK(builder_.add(std::move(posed.part)));
                continue;
            }
            for (const auto& worldFromMesh : transforms) {
                auto part = primitive.part;
                transform(part, worldFromMesh);
                STX_CHECK(builder_.add(std::move(part)));
            }
        }
        return {};
    }

    /// The primitives of a mesh that are splats, with each transform.
    Result<void> addSplatsOf(std::uint64_t index, const std::string& user,
                             const std::vector<glm::dmat4>& transforms) {
        STX_TRY(const Json* mesh, element(root(), "meshes", index, user));
        const auto where = fmt::format("meshes[{}]", index);
        STX_TRY(const Json* list, getArray(*mesh, "primitives", where));
        for (std::size_t p = 0; list && p < list->size(); ++p) {
            const auto at = fmt::format("{}.primitives[{}]", where, p);
            if (!(*list)[p].is_object()) continue;  // said by those who read the others
            STX_TRY(const Json* splats, splatsIn((*list)[p], at));
            for (std::size_t i = 0; splats && i < transforms.size(); ++i) {
                const std::size_t first = splats_.centres.size();
                STX_CHECK(addSplats(model_, (*list)[p], at, splats_));
                for (std::size_t k = first; k < splats_.centres.size(); ++k)
                    splats_.centres[k] =
                        glm::dvec3(transforms[i] * glm::dvec4(splats_.centres[k], 1.0));
                transformSplats(splats_.cloud, first, transforms[i]);
            }
        }
        return {};
    }

    /// One line about everything that was left out.
    void say() {
        if (const auto n = listSize(root(), "animations"))
            dropped_["animations"] += static_cast<int>(n);
        for (const auto& [name, count] : materials_.dropped) dropped_[name] += count;
        std::string line;
        for (const auto& [name, count] : dropped_)
            line += fmt::format("{}{} ({})", line.empty() ? "dropped: " : ", ", name, count);
        if (!line.empty()) model_.job().note(line);
    }

    GltfFile& model_;
    MeshBuilder& builder_;
    Materials materials_;
    std::vector<Node> nodes_;
    std::map<std::uint64_t, std::vector<Primitive>> meshes_;
    std::map<std::string, int> dropped_;
    FileSplats splats_;
};

}  // namespace
}  // namespace gltf

Result<Mesh> readGltf(ByteSpan bytes, ModelFiles& files) {
    MeshBuilder builder(files.job());
    STX_TRY(auto model, gltf::GltfFile::open(bytes, files, builder));
    return gltf::SceneReader(model, builder).read();
}

}  // namespace stx
