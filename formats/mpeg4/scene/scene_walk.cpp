#include "formats/mpeg4/scene/scene_walk.hpp"

#include <algorithm>
#include <optional>
#include <unordered_map>

namespace stx::mpeg4 {
namespace {

/// What a type of node is to the walk.
enum class Role {
    view,
    background,
    info,
    choice,
    levels,
    transform,
    group,       ///< whose children are where they would be without it
    otherGroup,  ///< that turns, moves or chooses its children by itself
    setting,     ///< shows nothing, as clocks and what they drive
    shape,
    other,
};

Role roleOf(const NodeInfo& type) {
    static const std::unordered_map<std::string_view, Role> kRoles = {
        {"DepthImage", Role::view},
        {"DepthImageV2", Role::view},
        {"OctreeImage", Role::view},
        {"Background", Role::background},
        {"WorldInfo", Role::info},
        {"Switch", Role::choice},
        {"LOD", Role::levels},
        {"Transform", Role::transform},
        {"Group", Role::group},
        {"OrderedGroup", Role::group},
        {"Layer2D", Role::group},
        {"Layer3D", Role::group},
        {"Anchor", Role::group},
        {"Collision", Role::group},
        {"Viewpoint", Role::setting},
        {"Viewport", Role::setting},
        {"NavigationInfo", Role::setting},
        {"QuantizationParameter", Role::setting},
        {"TimeSensor", Role::setting},
        {"Valuator", Role::setting},
        {"Shape", Role::shape}};
    if (const auto found = kRoles.find(type.name); found != kRoles.end()) return found->second;
    const int children = type.find("children");
    if (children >= 0 && type.fields[children].type == FieldType::MFNode) return Role::otherGroup;
    return type.name.find("Interpolator") != std::string::npos ? Role::setting : Role::other;
}

/// Where a node is. Its matrix is made when something is met that has a place: most Transforms of
/// a scene may have no view in them.
class Place {
  public:
    Place() : worldFromLocal_(1.0), turn_(glm::dquat(1.0, 0.0, 0.0, 0.0)) {}  // the world itself
    Place(Place& above, const Node& transform) : above_(&above), transform_(&transform) {}

    const glm::dmat4& worldFromLocal() {
        if (!worldFromLocal_)
            worldFromLocal_ =
                above_->worldFromLocal() *
                transformMatrix(transform_->get<glm::vec3>("center"),
                                axisAngle(transform_->get<Rotation>("rotation")),
                                transform_->get<glm::vec3>("scale"),
                                axisAngle(transform_->get<Rotation>("scaleOrientation")),
                                transform_->get<glm::vec3>("translation"));
        return *worldFromLocal_;
    }
    /// Of all Transforms above, without what they scale and move.
    const glm::dquat& turn() {
        if (!turn_)
            turn_ = above_->turn() *
                    quatFromAxisAngle(axisAngle(transform_->get<Rotation>("rotation")));
        return *turn_;
    }

  private:
    Place* above_ = nullptr;
    const Node* transform_ = nullptr;
    std::optional<glm::dmat4> worldFromLocal_;
    std::optional<glm::dquat> turn_;
};

/// A node that is where its type may not be; empty where there is none. Any node may be given to a
/// PROTO, and be the first in one.
std::string misfitIn(const NodePtr& root) {
    std::string found;
    forEachNode(root, [&](const NodePtr& parent) {
        for (const Node::SetField& field : parent->setFields) {
            const FieldInfo& info = parent->info->fields[field.index];
            const auto check = [&](const NodePtr& child) {
                if (!mayStandIn(child.get(), info.nodeType))
                    found = fmt::format("{} into {}.{}", child->info->name, parent->info->name,
                                        info.name);
            };
            if (const NodePtr* node = std::get_if<NodePtr>(&field.value)) check(*node);
            if (const NodeList* list = std::get_if<NodeList>(&field.value))
                for (const NodePtr& node : *list) check(node);
        }
    });
    return found;
}

class Walker {
  public:
    Walker(const Limits& limits, ShownScene& scene) : limits_(limits), scene_(scene) {}

    Result<void> visit(const NodePtr& node, Place& place, int parent, int depth) {
        if (!node) return {};
        path_.push_back(node.get());
        auto done = visitNode(node, place, parent, depth);
        path_.pop_back();
        return done;
    }

    /// Finds the Switches that settle what is shown: those that have something in them that counts,
    /// or of which nothing was said.
    void settleChoices() {
        std::unordered_set<const Node*> idle;
        for (const NodePtr& choice : choices_) {
            if (scene_.settledBy.contains(choice.get())) continue;
            bool counts = false;
            NodeList inside;
            walkNodes(choice, [&](const NodePtr& node) {
                if (counts || idle.contains(node.get())) return false;
                inside.push_back(node);
                counts = node->proto || isNews(*node);
                return isEntered(typeOf(*node->info).role);
            });
            if (counts) scene_.settledBy.insert(choice.get());
            if (!counts)
                for (const NodePtr& node : inside) idle.insert(node.get());
        }
    }

  private:
    /// Whether a node of this role may have others in it that are shown.
    static bool isEntered(Role role) {
        return role == Role::choice || role == Role::levels || role == Role::transform ||
               role == Role::group || role == Role::otherGroup;
    }
    Result<void> visitNode(const NodePtr& node, Place& place, int parent, int depth) {
        // A few nodes that USE each other in turn can be shown in any number of places.
        --visitsLeft_;
        STX_CHECK(checkVisits());
        if (depth > limits_.maxNesting)
            return fail(ErrorCode::invalidInput, "nodes nest deeper than {}", limits_.maxNesting);
        const std::string& type = node->info->name;
        if (node->proto) {
            noteInstance(*node);
            std::size_t copied = 0;
            const NodeList body = bodyOf(*node, copied);
            visitsLeft_ -= static_cast<std::int64_t>(copied);
            if (!body.empty()) return visit(body.front(), place, parent, depth + 1);
            scene_.leftOut.insert(type);
            return {};
        }
        const Type& known = typeOf(*node->info);
        switch (known.role) {
            case Role::view: {
                if (scene_.nodes.size() >= static_cast<std::size_t>(limits_.maxViews))
                    return fail(ErrorCode::invalidInput, "the scene shows more than {} views",
                                limits_.maxViews);
                STX_TRY(const NodePtr view, asShown(node));
                scene_.nodes.push_back({view, place.worldFromLocal(), parent});
                scene_.above.insert(path_.begin(), path_.end());
                return {};
            }
            case Role::background:
                scene_.backgrounds.push_back({node, place.turn()});
                scene_.settledBy.insert(path_.begin(), path_.end());
                return {};
            case Role::info: {
                const auto& title = node->get<std::string>("title");
                if (scene_.title.empty()) scene_.title = title;
                scene_.infos.push_back(
                    {node->get<std::vector<std::string>>("info"), place.worldFromLocal(), parent});
                scene_.settledBy.insert(path_.begin(), path_.end());
                return {};
            }
            case Role::choice: {
                choices_.push_back(node);
                const auto& choice = node->get<NodeList>("choice");
                const auto chosen = node->get<std::int32_t>("whichChoice");
                if (chosen < 0 || static_cast<std::size_t>(chosen) >= choice.size()) return {};
                return visit(choice[chosen], place, ++groups_, depth + 1);
            }
            case Role::levels: {
                const auto& levels = node->get<NodeList>("level");
                if (levels.empty()) return {};
                return visitAsGroup(*node, {levels[0]}, place, depth);
            }
            case Role::group:
                return visitAll(childrenOf(*node, known), place, depth);
            case Role::transform: {
                Place here(place, *node);
                return visitAll(childrenOf(*node, known), here, depth);
            }
            case Role::otherGroup:
                return visitAsGroup(*node, childrenOf(*node, known), place, depth);
            case Role::setting:
                return {};
            case Role::shape:
            case Role::other:
                forEachLeftOut(*node,
                               [&](const std::string& name) { scene_.leftOut.insert(name); });
        }
        return {};
    }

    /// Names what a node that is not a view has: its type, and that of the geometry of a Shape.
    template <class Take>
    static void forEachLeftOut(const Node& node, const Take& take) {
        take(node.info->name);
        const NodePtr* geometry = node.is("Shape") ? &node.get<NodePtr>("geometry") : nullptr;
        if (geometry != nullptr && *geometry) take((*geometry)->info->name);
    }

    [[nodiscard]] Result<void> checkVisits() const {
        if (visitsLeft_ >= 0) return {};
        return fail(ErrorCode::invalidInput,
                    "the scene shows more than {} nodes, counting each USE; that is not read",
                    kMaxVisits);
    }

    void noteInstance(const Node& instance) {
        scene_.settledBy.insert(&instance);
        if (holdsClock(*instance.proto)) scene_.withClocks.insert(instance.info->name);
    }

    /// A view with what it shows in place of instances of PROTOs in it.
    Result<NodePtr> asShown(const NodePtr& node) {
        const auto [entry, fresh] = shown_.try_emplace(node);
        if (!fresh) return entry->second;
        NodeList instances;
        NodePtr view = withoutInstances(node, visitsLeft_, instances);
        STX_CHECK(checkVisits());
        for (const NodePtr& instance : instances) {
            noteInstance(*instance);
            if (instance->proto->body.empty()) scene_.leftOut.insert(instance->info->name);
        }
        const bool ofProto =
            !instances.empty() ||
            std::ranges::any_of(path_, [](const Node* above) { return above->proto != nullptr; });
        if (const std::string wrong = ofProto ? misfitIn(view) : ""; !wrong.empty())
            return fail(ErrorCode::invalidInput,
                        "a PROTO brings {}, where it is not allowed; put another node there",
                        wrong);
        entry->second = view;
        return view;
    }

    /// Whether it would say or show something that the scene does not yet.
    bool isNews(const Node& node) {
        switch (typeOf(*node.info).role) {
            case Role::view:
            case Role::background:
            case Role::info:
                return true;
            case Role::shape:
            case Role::other: {
                bool news = false;
                forEachLeftOut(node, [&](const std::string& name) {
                    news = news || !scene_.leftOut.contains(name);
                });
                return news;
            }
            default:
                return false;
        }
    }

    /// Whether a TimeSensor is in a PROTO or in those that it uses.
    bool holdsClock(const Proto& proto) {
        const auto known = clocks_.try_emplace(&proto, false);
        bool& holds = known.first->second;
        if (!known.second) return holds;
        forEachNodeOf(proto, [&](const NodePtr& inside) {
            --visitsLeft_;
            if (inside->is("TimeSensor")) holds = true;
        });
        return holds;
    }

    struct Type {
        Role role = Role::other;
        int children = -1;  ///< the field
    };
    const Type& typeOf(const NodeInfo& info) {
        const auto [entry, fresh] = types_.try_emplace(&info);
        if (fresh) entry->second = {roleOf(info), info.find("children")};
        return entry->second;
    }
    static const NodeList& childrenOf(const Node& node, const Type& type) {
        return std::get<NodeList>(node.value(type.children));
    }

    Result<void> visitAll(const NodeList& children, Place& place, int depth) {
        const int group = ++groups_;
        for (const NodePtr& child : children) STX_CHECK(visit(child, place, group, depth + 1));
        return {};
    }

    Result<void> visitAsGroup(const Node& node, const NodeList& children, Place& place, int depth) {
        const std::size_t before = scene_.nodes.size();
        STX_CHECK(visitAll(children, place, depth));
        if (scene_.nodes.size() > before) scene_.asGroups.insert(node.info->name);
        return {};
    }

    static constexpr std::int64_t kMaxVisits = 1 << 21;
    const Limits& limits_;
    ShownScene& scene_;
    std::vector<const Node*> path_;  ///< from the root to the node that is visited
    std::int64_t visitsLeft_ = kMaxVisits;
    std::unordered_map<NodePtr, NodePtr> shown_;  ///< of views; their addresses are not used again
    NodeList choices_;                            ///< Switches
    std::unordered_map<const Proto*, bool> clocks_;  ///< whether one is inside
    std::unordered_map<const NodeInfo*, Type> types_;
    int groups_ = 0;
};

}  // namespace

Result<ShownScene> shownScene(const NodePtr& root, const Limits& limits) {
    ShownScene scene;
    Place world;
    Walker walker(limits, scene);
    STX_CHECK(walker.visit(root, world, 0, 1));
    walker.settleChoices();
    return scene;
}

bool ShownScene::isStillOf(const Scene& scene) const {
    return !scene.restructured && std::ranges::none_of(scene.changed, [&](const Node* node) {
        return above.contains(node) || settledBy.contains(node);
    });
}

}  // namespace stx::mpeg4
