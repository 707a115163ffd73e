#include "formats/meshes/fbx_facts.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "formats/meshes/fbx_elements.hpp"

namespace stx {
namespace {

struct FbxObject {
    std::string_view kind, name, what;  ///< as `Model: 1, "Model::name", "Mesh"` has them
    bool visible = true, shown = true, inheritsVisibility = true;
    bool scaled = false, stretched = false;  ///< by another factor than 1; by several
    bool clampU = false, clampV = false;
    std::int64_t inheritType = 1;
    double emissiveFactor = 1, deformPercent = 0;
    std::string_view fileName, relativeName, colours;  ///< how vertex colours are mapped
    /// What is connected to it, in the order of the file, and by which property.
    std::vector<std::pair<std::int64_t, std::string_view>> sources;
};

/// Without the kind: in front of it in text, behind it in binary files.
std::string_view plainName(std::string_view name) {
    const auto end = name.find(std::string_view("\0\1", 2));
    if (end != std::string_view::npos) return name.substr(0, end);
    const auto kind = name.find("::");
    return kind == std::string_view::npos ? name : name.substr(kind + 2);
}

class FactsReader {
  public:
    FbxFacts read(ByteSpan bytes) {
        eachFbxElement(bytes, [&](const FbxElement& element) { take(element); });
        for (const auto& [from, to, property] : connections_)
            if (const auto known = objects_.find(to); known != objects_.end())
                known->second.sources.emplace_back(from, property);
        placeModels();
        for (std::size_t i = 0; i < ids_.size(); ++i) findBones(i);
        readMaterials();
        noteLost();
        return std::move(facts_);
    }

  private:
    struct Connection {
        std::int64_t from = 0, to = 0;
        std::string_view property;
    };

    void take(const FbxElement& element) {
        const auto& inside = element.inside;
        const auto& values = element.values;
        if (inside.size() == 1 && inside[0] == "Connections" && values.size() >= 3)
            connections_.push_back({values[1].integer, values[2].integer,
                                    values.size() > 3 ? values[3].text : std::string_view()});
        if (inside.empty() || inside[0] != "Objects") return;
        if (inside.size() == 1) {
            current_ = nullptr;
            if (values.size() < 3) return;
            const auto [at, isNew] = objects_.try_emplace(values[0].integer);
            if (!isNew) return;
            current_ = &at->second;
            order_.push_back(values[0].integer);
            current_->kind = element.name;
            current_->name = plainName(values[1].text);
            current_->what = values[2].text;
        }
        if (!current_ || values.empty()) return;
        if (inside.size() == 2) {
            if (element.name == "FileName") current_->fileName = values[0].text;
            if (element.name == "RelativeFilename") current_->relativeName = values[0].text;
            if (element.name == "DeformPercent") current_->deformPercent = values[0].number;
        } else if (inside.size() == 3 && inside[2] == "LayerElementColor") {
            if (element.name == "MappingInformationType") current_->colours = values[0].text;
        } else if (inside.size() == 3 && inside[2] == "Properties70" && values.size() >= 5) {
            takeProperty(values[0].text, values.subspan(4));
        }
    }

    void takeProperty(std::string_view name, std::span<const FbxValue> values) {
        const double first = values[0].number;
        if (name == "Visibility") current_->visible = first != 0;
        if (name == "Show") current_->shown = first != 0;
        if (name == "Visibility Inheritance") current_->inheritsVisibility = first != 0;
        if (name == "InheritType") current_->inheritType = values[0].integer;
        if (name == "WrapModeU") current_->clampU = first == 1;
        if (name == "WrapModeV") current_->clampV = first == 1;
        if (name == "EmissiveFactor") current_->emissiveFactor = first;
        if (name == "DeformPercent") current_->deformPercent = first;
        if (name == "Lcl Scaling" && values.size() >= 3) {
            const double x = first, y = values[1].number, z = values[2].number;
            current_->stretched = x != y || y != z;
            current_->scaled = current_->stretched || x != 1;
        }
    }

    [[nodiscard]] const FbxObject* find(std::int64_t id) const {
        const auto known = objects_.find(id);
        return known == objects_.end() ? nullptr : &known->second;
    }

    /// Calls use(id, object) for each object of a kind that is connected to this one as a whole.
    template <class Use>
    void eachSource(const FbxObject& object, std::string_view kind, const Use& use) const {
        for (const auto& [id, property] : object.sources)
            if (const FbxObject* source = find(id);
                property.empty() && source && source->kind == kind)
                use(id, *source);
    }

    void placeModels() {
        struct Visit {
            std::int64_t id = 0;
            bool hidden = false, out = false;  ///< out: whatever it says itself
            bool scaled = false, stretched = false;
        };
        std::vector<Visit> stack;
        FbxObject root;
        for (const auto& [from, to, property] : connections_)
            if (to == 0) root.sources.emplace_back(from, property);
        std::set<std::int64_t> seen;
        const auto addChildren = [&](const FbxObject& object, Visit of) {
            bool levels = object.what == "LodGroup";
            eachSource(object, "NodeAttribute", [&](std::int64_t, const FbxObject& attribute) {
                levels = levels || attribute.what == "LodGroup";
            });
            std::vector<Visit> children;
            eachSource(object, "Model", [&](std::int64_t id, const FbxObject&) {
                of.id = id;
                children.push_back(of);
                if (levels && children.size() > 1) children.back().out = true;
            });
            stack.insert(stack.end(), children.rbegin(), children.rend());
        };
        addChildren(root, {});
        while (!stack.empty()) {
            Visit visit = stack.back();
            stack.pop_back();
            if (!seen.insert(visit.id).second) continue;
            const FbxObject& object = *find(visit.id);
            // FbxTransform's kinds: 0, turned before the parent's scale, and 2, without it.
            if ((object.inheritType == 0 && visit.stretched) ||
                (object.inheritType == 2 && visit.scaled))
                ++unscaled_;
            visit.hidden =
                visit.out || !object.visible || (visit.hidden && object.inheritsVisibility);
            visit.scaled = visit.scaled || object.scaled;
            visit.stretched = visit.stretched || object.stretched;
            numbers_.emplace(visit.id, ids_.size());
            ids_.push_back(visit.id);
            facts_.models.push_back({std::string(object.name), visit.hidden || !object.shown, {}});
            addChildren(object, visit);
        }
    }

    void findBones(std::size_t model) {
        auto& bones = facts_.models[model].bones;
        eachSource(*find(ids_[model]), "Geometry", [&](std::int64_t, const FbxObject& geometry) {
            eachSource(geometry, "Deformer", [&](std::int64_t, const FbxObject& skin) {
                if (skin.what != "Skin") return;
                eachSource(skin, "Deformer", [&](std::int64_t, const FbxObject& cluster) {
                    eachSource(cluster, "Model", [&](std::int64_t id, const FbxObject& bone) {
                        if (const auto number = numbers_.find(id); number != numbers_.end())
                            bones.emplace(bone.name, number->second);
                    });
                });
            });
        });
    }

    void readMaterials() {
        for (const auto id : order_) {
            const FbxObject& object = *find(id);
            if (object.kind != "Material") continue;
            const auto [material, isNew] = facts_.materials.try_emplace(std::string(object.name));
            if (!isNew) continue;
            material->second.emissiveFactor = object.emissiveFactor;
            for (const auto& [from, property] : object.sources)
                if (const FbxObject* source = find(from); source && source->kind == "Texture")
                    material->second.textures.insert_or_assign(
                        std::string(property),
                        FbxFacts::Texture{
                            std::string(source->relativeName.empty() ? source->fileName : ""),
                            source->clampU, source->clampV});
        }
    }

    void noteLost() {
        std::size_t curved = 0, shapes = 0;
        std::map<std::int64_t, std::vector<std::int64_t>> firstMaterials;  // by geometry
        for (const auto id : order_) {
            const FbxObject& object = *find(id);
            if (object.kind == "Geometry" &&
                (object.what.starts_with("Nurbs") || object.what == "Patch"))
                ++curved;
            if (object.what == "BlendShapeChannel" && object.deformPercent != 0) ++shapes;
            if (object.colours == "ByPolygon" || object.colours == "AllSame")
                facts_.lost.push_back(fmt::format(
                    "geometry '{}': its vertex colours are mapped {} and not read; expected "
                    "ByPolygonVertex or ByVertice",
                    object.name, object.colours));
        }
        // Assimp 5.2.5 leaves the others' materials out, and its option to read all
        // (AI_CONFIG_IMPORT_FBX_READ_ALL_MATERIALS) fails at every file.
        std::set<std::int64_t> noted;
        for (const auto model : ids_) {
            std::vector<std::int64_t> materials;
            eachSource(*find(model), "Material",
                       [&](std::int64_t id, const FbxObject&) { materials.push_back(id); });
            eachSource(*find(model), "Geometry", [&](std::int64_t id, const FbxObject& geometry) {
                const auto [first, isNew] = firstMaterials.emplace(id, materials);
                if (!isNew && first->second != materials && noted.insert(id).second)
                    facts_.lost.push_back(fmt::format(
                        "geometry '{}' has other materials in other models; all have those of the "
                        "first",
                        geometry.name));
            });
        }
        const auto lose = [&](std::size_t count, std::string_view what) {
            if (count > 0) facts_.lost.push_back(fmt::format("dropped: {} ({})", what, count));
        };
        lose(curved, "NURBS and patches");
        lose(shapes, "blend shapes in effect");
        if (unscaled_ > 0)
            facts_.lost.push_back(fmt::format(
                "models that take over scale in another way (InheritType 0 or 2) are drawn as all "
                "others: {}",
                unscaled_));
    }

    FbxFacts facts_;
    std::map<std::int64_t, FbxObject> objects_;
    std::vector<std::int64_t> order_;  ///< as in the file
    std::vector<Connection> connections_;
    FbxObject* current_ = nullptr;
    std::vector<std::int64_t> ids_;  ///< of the models of facts_
    std::map<std::int64_t, std::size_t> numbers_;
    std::size_t unscaled_ = 0;
};

}  // namespace

FbxFacts fbxFacts(ByteSpan bytes) {
    return FactsReader().read(bytes);
}

}  // namespace stx
