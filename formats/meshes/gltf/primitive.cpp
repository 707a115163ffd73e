#include "formats/meshes/gltf/primitive.hpp"

#include <cmath>
#include <optional>

#include "formats/meshes/draco_geometry.hpp"

namespace stx::gltf {
namespace {

/// Attributes of one primitive, from accessors or from its Draco stream.
class Attributes {
  public:
    Attributes(GltfFile& model, MeshBuilder& builder, const Json& primitive,
               const std::string& where)
        : model_(model), builder_(builder), primitive_(primitive), where_(where) {}

    Result<void> open() {
        STX_TRY(attributes_, getObject(primitive_, "attributes", where_));
        if (!attributes_) return fail(ErrorCode::invalidInput, "{} has no attributes", where_);
        STX_TRY(const Json* extension,
                getExtension(primitive_, "KHR_draco_mesh_compression", where_));
        if (!extension) return {};
        const auto at = where_ + ".extensions.KHR_draco_mesh_compression";
        STX_TRY(const auto view, getUint(*extension, "bufferView", at));
        if (!view) return fail(ErrorCode::invalidInput, "{} names no bufferView", at);
        STX_TRY(dracoIds_, getObject(*extension, "attributes", at));
        if (!dracoIds_) return fail(ErrorCode::invalidInput, "{} has no attributes", at);
        STX_TRY(const auto bytes, model_.bufferView(*view, at));
        auto geometry = DracoGeometry::decode(
            bytes.bytes,
            [&](std::uint64_t n, std::uint64_t each) { return builder_.charge(n, each, at); });
        if (!geometry) return tl::unexpected(geometry.error().at(at));
        if (!geometry->isMesh())
            return fail(ErrorCode::invalidInput, "{} holds a point cloud, expected a mesh", at);
        draco_ = std::move(*geometry);
        return {};
    }

    [[nodiscard]] bool has(const std::string& name) const { return attributes_->contains(name); }
    [[nodiscard]] const std::optional<DracoGeometry>& draco() const { return draco_; }

    /// For messages: the accessor of an attribute.
    [[nodiscard]] std::string source(const std::string& name) const {
        return fmt::format("accessors[{}] ({} {})", attributes_->at(name).get<std::int64_t>(),
                           where_, name);
    }

    /// Values of an attribute, or none when the primitive lacks it.
    Result<std::optional<AccessorValues>> get(const std::string& name,
                                              std::initializer_list<std::string_view> types) {
        STX_TRY(const auto index, getUint(*attributes_, name.c_str(), where_ + ".attributes"));
        if (!index) return std::nullopt;
        if (draco_) {
            STX_TRY(const auto id, getUint(*dracoIds_, name.c_str(), where_ + ".extensions"));
            if (id) {
                STX_TRY(auto values, fromDraco(name, *id, *index));
                return values;
            }
        }
        // Colours must be normalised; exporters forget to say so.
        STX_TRY(auto values,
                model_.accessor(*index, where_ + " " + name, types, name.starts_with("COLOR")));
        return values;
    }

  private:
    Result<AccessorValues> fromDraco(const std::string& name, std::uint64_t id,
                                     std::uint64_t accessor) {
        for (const auto& a : draco_->attributes()) {
            if (a.uniqueId != id) continue;
            // The accessor still says whether integers are normalised.
            STX_TRY(const Json* object, element(model_.root(), "accessors", accessor, where_));
            STX_TRY(const auto normalised,
                    getBool(*object, "normalized", fmt::format("accessors[{}]", accessor)));
            STX_CHECK(builder_.charge(draco_->pointCount(),
                                      static_cast<std::uint64_t>(a.components) * sizeof(float),
                                      where_));
            AccessorValues values;
            values.count = draco_->pointCount();
            values.components = a.components;
            STX_TRY(values.values,
                    draco_->values(a, normalised.value_or(false) || name.starts_with("COLOR")));
            return values;
        }
        return fail(ErrorCode::invalidInput, "{}: the Draco stream has no attribute {} for {}",
                    where_, id, name);
    }

    GltfFile& model_;
    MeshBuilder& builder_;
    const Json& primitive_;
    const std::string& where_;
    const Json* attributes_ = nullptr;
    const Json* dracoIds_ = nullptr;
    std::optional<DracoGeometry> draco_;
};

template <class Vec>
std::vector<Vec> vectors(const AccessorValues& a) {
    std::vector<Vec> out(a.count, Vec(0));
    const int n = std::min(a.components, static_cast<int>(Vec::length()));
    for (std::size_t i = 0; i < a.count; ++i) {
        for (int c = 0; c < n; ++c) out[i][c] = a.at(i, c);
    }
    return out;
}

Result<void> checkCount(const std::optional<AccessorValues>& values, std::size_t expected,
                        int components, const std::string& where, std::string_view name) {
    if (!values) return {};
    if (values->count != expected)
        return fail(ErrorCode::invalidInput,
                    "{}: {} has {} elements, POSITION has {}; they must match", where, name,
                    values->count, expected);
    if (values->components < components)
        return fail(ErrorCode::invalidInput, "{}: {} has {} components, expected {}", where, name,
                    values->components, components);
    return {};
}

/// Triangles of a list (mode 4), strip (5) or fan (6).
std::vector<glm::uvec3> assemble(std::uint64_t mode, std::size_t count, const auto& vertexAt) {
    std::vector<glm::uvec3> triangles;
    if (count < 3) return triangles;
    if (mode == 4) {
        for (std::size_t i = 0; i + 2 < count; i += 3)
            triangles.emplace_back(vertexAt(i), vertexAt(i + 1), vertexAt(i + 2));
    } else {
        for (std::size_t i = 0; i + 2 < count; ++i) {
            if (mode == 5)
                triangles.emplace_back(vertexAt(i), vertexAt(i + 1 + i % 2),
                                       vertexAt(i + 2 - i % 2));
            else
                triangles.emplace_back(vertexAt(i + 1), vertexAt(i + 2), vertexAt(0));
        }
    }
    return triangles;
}

Result<void> applyMorph(GltfFile& model, const Json& primitive, const std::string& where,
                        const std::vector<double>& weights, MeshPart& part,
                        std::map<std::string, int>& dropped) {
    STX_TRY(const Json* targets, getArray(primitive, "targets", where));
    if (!targets) return {};
    if (!weights.empty() && weights.size() != targets->size())
        return fail(ErrorCode::invalidInput, "{} has {} morph targets, but there are {} weights",
                    where, targets->size(), weights.size());
    for (std::size_t t = 0; t < weights.size(); ++t) {
        if (weights[t] == 0) continue;
        const auto at = fmt::format("{}.targets[{}]", where, t);
        if (!(*targets)[t].is_object())
            return fail(ErrorCode::invalidInput, "{} is not an object", at);
        const auto add = [&](const char* name, auto& values) -> Result<void> {
            STX_TRY(const auto index, getUint((*targets)[t], name, at));
            if (!index || values.empty()) return {};
            STX_TRY(const auto deltas, model.accessor(*index, at + " " + name, {"VEC3"}));
            if (deltas.count != values.size())
                return fail(ErrorCode::invalidInput, "{}: {} has {} elements, the mesh has {}", at,
                            name, deltas.count, values.size());
            for (std::size_t i = 0; i < values.size(); ++i) {
                for (int c = 0; c < 3; ++c)
                    values[i][c] = static_cast<std::decay_t<decltype(values[i][c])>>(
                        values[i][c] + weights[t] * deltas.at(i, c));
            }
            return {};
        };
        STX_CHECK(add("POSITION", part.positions));
        STX_CHECK(add("NORMAL", part.normals));
        STX_CHECK(add("TANGENT", part.tangents));
        for (const auto& [name, _] : (*targets)[t].items()) {
            if (name.starts_with("COLOR_")) ++dropped["morphs of vertex colours"];
            if (name.starts_with("TEXCOORD_")) ++dropped["morphs of texture coordinates"];
        }
    }
    return {};
}

/// Reads one primitive, part by part.
class PrimitiveReader {
  public:
    PrimitiveReader(GltfFile& model, MeshBuilder& builder, Materials& materials,
                    const Json& primitive, const std::string& where,
                    std::map<std::string, int>& dropped)
        : model_(model),
          builder_(builder),
          materials_(materials),
          primitive_(primitive),
          where_(where),
          dropped_(dropped),
          attributes_(model, builder, primitive, where) {}

    Result<Primitive> read(const std::vector<double>& morphWeights) {
        part().where = where_;
        STX_TRY(const auto mode, getUint(primitive_, "mode", where_));
        mode_ = mode.value_or(4);
        if (mode_ > 6)
            return fail(ErrorCode::invalidInput, "{}.mode is {}, expected 0 to 6", where_, mode_);
        if (mode_ >= 1 && mode_ <= 3) return notDrawn("line primitives");
        STX_CHECK(attributes_.open());
        STX_TRY(const auto position, attributes_.get("POSITION", {"VEC3"}));
        if (!position) return notDrawn("primitives without positions");
        count_ = position->count;
        STX_CHECK(readPositions(position));
        STX_CHECK(readOthers());
        STX_CHECK(readMaterial());
        STX_CHECK(readInfluences());
        STX_CHECK(applyMorph(model_, primitive_, where_, morphWeights, part(), dropped_));
        if (mode_ == 0)
            STX_CHECK(readPoints());
        else
            STX_CHECK(readTriangles());
        return std::move(result_);
    }

  private:
    MeshPart& part() { return result_.part; }
    Primitive notDrawn(const char* what) {
        ++dropped_[what];
        result_.drawn = false;
        return std::move(result_);
    }

    Result<void> readPositions(const std::optional<AccessorValues>& position) {
        STX_CHECK(checkCount(position, count_, 3, where_, "POSITION"));
        part().positions = vectors<glm::dvec3>(*position);
        // Points that are nowhere are left out later; a triangle needs all of its corners.
        for (std::size_t i = 0; mode_ != 0 && i < count_; ++i) {
            const auto p = part().positions[i];
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
                return fail(ErrorCode::invalidInput,
                            "{}: vertex {} is at ({}, {}, {}); positions must be finite numbers",
                            attributes_.source("POSITION"), i, p.x, p.y, p.z);
        }
        return {};
    }

    /// Normals, tangents and colours.
    Result<void> readOthers() {
        STX_TRY(const auto normal, attributes_.get("NORMAL", {"VEC3"}));
        STX_CHECK(checkCount(normal, count_, 3, where_, "NORMAL"));
        if (normal) part().normals = vectors<glm::vec3>(*normal);
        STX_TRY(const auto tangent, attributes_.get("TANGENT", {"VEC4"}));
        STX_CHECK(checkCount(tangent, count_, 4, where_, "TANGENT"));
        if (tangent) part().tangents = vectors<glm::vec4>(*tangent);
        STX_TRY(const auto colour, attributes_.get("COLOR_0", {"VEC3", "VEC4"}));
        STX_CHECK(checkCount(colour, count_, 3, where_, "COLOR_0"));
        if (colour) part().colours = vectors<glm::vec4>(*colour);
        if (colour && colour->components == 3)
            for (auto& c : part().colours) c.a = 1.0f;
        if (attributes_.has("COLOR_1")) ++dropped_["further vertex colours"];
        return {};
    }

    Result<std::vector<glm::vec2>> readUvs(const UvSource& source) {
        const auto name = fmt::format("TEXCOORD_{}", source.set);
        STX_TRY(const auto values, attributes_.get(name, {"VEC2"}));
        STX_CHECK(checkCount(values, count_, 2, where_, name));
        std::vector<glm::vec2> uvs;
        if (!values) return uvs;
        uvs = vectors<glm::vec2>(*values);
        for (auto& uv : uvs) uv = source.apply(uv);
        return uvs;
    }

    /// The material, and the texture coordinates of its maps.
    Result<void> readMaterial() {
        STX_TRY(const auto index, getUint(primitive_, "material", where_));
        STX_TRY(auto material, materials_.use(index, where_));
        STX_TRY(part().uvs, readUvs(material.baseColour));
        // Without a base colour's map, uvs serve the normal map alone.
        if (material.normal.used && !material.baseColour.used)
            STX_SET(part().uvs, readUvs(material.normal));
        else if (material.normal.used && !(material.normal == material.baseColour))
            STX_SET(part().normalUvs, readUvs(material.normal));
        TexturesKept kept;
        kept.baseColour = !material.baseColour.used || !part().uvs.empty();
        kept.normal = !material.normal.used || !(part().normalUvs.empty() && part().uvs.empty()) ||
                      count_ == 0;
        // Whether a map has coordinates: its own, which are read here, or the base colour's.
        const auto readOwn = [&](const UvSource& source,
                                 std::vector<glm::vec2>& own) -> Result<bool> {
            if (!source.used || source == material.baseColour) return kept.baseColour;
            STX_TRY(own, readUvs(source));
            return !own.empty();
        };
        STX_TRY(kept.metallicRoughness,
                readOwn(material.metallicRoughness, part().metallicRoughnessUvs));
        STX_TRY(kept.emissive, readOwn(material.emissive, part().emissiveUvs));
        if (kept != TexturesKept()) {
            model_.job().note(
                fmt::format("{} has a textured material but no texture coordinates for it; the "
                            "plain colour is used",
                            where_));
            material = materials_.withoutTextures(material, kept);
        }
        part().material = material.index;
        return {};
    }

    /// The bones that move it.
    Result<void> readInfluences() {
        for (int set = 0; set < 4; ++set) {
            STX_TRY(auto joints, attributes_.get(fmt::format("JOINTS_{}", set), {"VEC4"}));
            STX_TRY(auto weights, attributes_.get(fmt::format("WEIGHTS_{}", set), {"VEC4"}));
            if (!joints || !weights) break;
            STX_CHECK(checkCount(joints, count_, 4, where_, "JOINTS"));
            STX_CHECK(checkCount(weights, count_, 4, where_, "WEIGHTS"));
            result_.influences.push_back({std::move(*joints), std::move(*weights)});
        }
        return {};
    }

    /// Numbers of vertices; nothing where all count as they come.
    Result<std::optional<std::vector<std::uint32_t>>> readIndices() {
        STX_TRY(const auto accessor, getUint(primitive_, "indices", where_));
        if (!accessor) return std::nullopt;
        STX_TRY(auto indices, model_.indices(*accessor, where_ + " indices"));
        for (std::size_t i = 0; i < indices.size(); ++i)
            if (indices[i] >= count_)
                return fail(ErrorCode::invalidInput,
                            "accessors[{}] ({} indices): index {} is vertex {}, but there are "
                            "only {} vertices",
                            *accessor, where_, i, indices[i], count_);
        return indices;
    }

    Result<void> readPoints() {
        part().points = true;
        STX_TRY(const auto indices, readIndices());
        if (!indices) return {};
        std::vector<bool> named(count_);
        for (const auto i : *indices) named[i] = true;
        keepVertices(part(), named);
        for (auto& influence : result_.influences) {
            influence.joints.keep(named);
            influence.weights.keep(named);
        }
        return {};
    }

    Result<void> readTriangles() {
        if (attributes_.draco()) {
            part().triangles = attributes_.draco()->triangles();
            return {};
        }
        STX_TRY(const auto indices, readIndices());
        const auto count = indices ? indices->size() : count_;
        STX_CHECK(builder_.charge(count, sizeof(glm::uvec3), where_));
        part().triangles = assemble(mode_, count, [&](std::size_t i) {
            return indices ? (*indices)[i] : static_cast<std::uint32_t>(i);
        });
        return {};
    }

    GltfFile& model_;
    MeshBuilder& builder_;
    Materials& materials_;
    const Json& primitive_;
    const std::string& where_;
    std::map<std::string, int>& dropped_;
    Attributes attributes_;
    std::uint64_t mode_ = 4;
    std::size_t count_ = 0;  ///< of vertices
    Primitive result_;
};

}  // namespace

Result<Primitive> readPrimitive(GltfFile& model, MeshBuilder& builder, Materials& materials,
                                const Json& primitive, const std::string& where,
                                const std::vector<double>& morphWeights,
                                std::map<std::string, int>& dropped) {
    return PrimitiveReader(model, builder, materials, primitive, where, dropped).read(morphWeights);
}

}  // namespace stx::gltf
