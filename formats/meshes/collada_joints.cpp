#include "formats/meshes/collada_joints.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "formats/files/text_encoding.hpp"
#include "formats/meshes/collada_tags.hpp"

namespace stx {

void ColladaJoints::read(std::string_view text, std::size_t at) {
    text_ = text.data();
    const auto tag = text.substr(at);
    const auto name = collada::nameOf(tag);
    const auto reference = [](std::string_view id) {
        return id.starts_with('#') ? id.substr(1) : id;
    };
    if (name == "node") {
        nodes_.push_back(
            {collada::attributeOf(tag, "id"), collada::attributeOf(tag, "sid"), open_});
        nodes_.back().end = nodes_.size();
        if (!text.substr(0, collada::endOfTag(text, at)).ends_with("/>")) open_ = nodes_.size() - 1;
    } else if (name == "/node") {
        if (open_ == kNowhere) return;
        nodes_[open_].end = nodes_.size();
        open_ = nodes_[open_].parent;
    } else if (name == "controller") {
        controller_ = collada::attributeOf(tag, "id");
    } else if (name == "/controller") {
        controller_ = {};
    } else if (name == "skin") {
        skin_ = at;
    } else if (name == "bind_shape_matrix") {
        skin_ = kNowhere;
    } else if (name == "/skin") {
        if (skin_ != kNowhere) withoutShape_.insert(skin_);
        skin_ = kNowhere;
    } else if (name == "Name_array" && !controller_.empty()) {
        auto& names = skins_[controller_].names;
        if (names.empty()) names = collada::contentOf(tag, name);
    } else if (name == "instance_controller") {
        instance_ = reference(collada::attributeOf(tag, "url"));
    } else if (name == "skeleton") {
        const auto root = reference(trimmed(collada::contentOf(tag, name)));
        auto& skeleton = skins_[instance_].skeleton;
        if (!skeleton) skeleton = root;
        if (*skeleton != root && twoSkeletons_.empty()) twoSkeletons_ = instance_;
    }
}

void ColladaJoints::resolve() {
    std::map<std::string_view, std::vector<std::size_t>> nodesOf;
    std::map<std::string_view, std::size_t> byId;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        if (!nodes_[i].sid.empty()) nodesOf[nodes_[i].sid].push_back(i);
        byId.emplace(nodes_[i].id, i);
    }
    for (const auto& [id, skin] : skins_) {
        std::string array;
        bool changed = false;
        const auto root = byId.find(skin.skeleton.value_or(std::string_view()));
        for (auto rest = trimmed(skin.names); !rest.empty();) {
            const auto joint = rest.substr(0, rest.find_first_of(" \t\r\n"));
            rest = trimmed(rest.substr(joint.size()));
            const auto known = nodesOf.find(joint);
            std::string name(joint);
            if (known != nodesOf.end() && known->second.size() > 1) {
                auto node = known->second.front();
                if (root != byId.end()) {
                    // Nodes below one are those behind it, up to its end.
                    const auto below = std::ranges::lower_bound(known->second, root->second);
                    if (below != known->second.end() && *below < nodes_[root->second].end)
                        node = *below;
                }
                name = fmt::format("{}.{}", joint, node);
                sids_[static_cast<std::size_t>(nodes_[node].sid.data() - text_)] = name;
                changed = true;
            }
            array += name + ' ';
        }
        if (changed) arrays_[static_cast<std::size_t>(skin.names.data() - text_)] = array;
    }
}

std::optional<ColladaJoints::Replaced> ColladaJoints::replacedAt(std::string_view text,
                                                                 std::size_t at) const {
    const auto tag = text.substr(at);
    const auto name = collada::nameOf(tag);
    if (name == "skin" && withoutShape_.contains(at)) {
        const auto inside = collada::endOfTag(text, at);
        return Replaced{inside, inside,
                        "<bind_shape_matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</bind_shape_matrix>"};
    }
    const bool isNode = name == "node";
    if (!isNode && name != "Name_array") return std::nullopt;
    const auto old = isNode ? collada::attributeOf(tag, "sid") : collada::contentOf(tag, name);
    if (old.empty()) return std::nullopt;
    const auto& all = isNode ? sids_ : arrays_;
    const auto known = all.find(static_cast<std::size_t>(old.data() - text.data()));
    if (known == all.end()) return std::nullopt;
    return Replaced{known->first, known->first + old.size(), known->second};
}

}  // namespace stx
