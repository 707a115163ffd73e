#include "formats/mpeg4/scene/scene_walk.hpp"

#include <unordered_map>

namespace stx::mpeg4 {
namespace {

class Walker {
  public:
    Walker(const Limits& limits, ShownScene& scene) : limits_(limits), scene_(scene) {}

    Result<void> visit(const NodePtr& node, const glm::dmat4& world, int parent, int depth) {
        if (!node) return {};
        path_.push_back(node.get());
        auto done = visitNode(node, world, parent, depth);
        path_.pop_back();
        return done;
    }

  private:
    Result<void> visitNode(const NodePtr& node, const glm::dmat4& world, int parent, int depth) {
        // A few nodes that USE each other in turn can be shown in any number of places.
        if (++visits_ > kMaxVisits)
            return fail(ErrorCode::invalidInput,
                        "the scene shows more than {} nodes, counting each USE; that is not read",
                        kMaxVisits);
        if (depth > limits_.maxNesting)
            return fail(ErrorCode::invalidInput, "nodes nest deeper than {}", limits_.maxNesting);
        const std::string& type = node->info->name;
        if (node->proto) {
            if (holdsClock(*node->proto)) scene_.withClocks.insert(type);
            std::size_t copied = 0;
            const NodePtr body = bodyOf(*node, copied);
            visits_ += static_cast<std::int64_t>(copied);
            if (body) return visit(body, world, parent, depth + 1);
            scene_.leftOut.insert(type);
        } else if (type == "DepthImage" || type == "DepthImageV2" || type == "OctreeImage") {
            if (scene_.nodes.size() >= static_cast<std::size_t>(limits_.maxViews))
                return fail(ErrorCode::invalidInput, "the scene shows more than {} views",
                            limits_.maxViews);
            scene_.nodes.push_back({node, world, parent});
            scene_.above.insert(path_.begin(), path_.end());
        } else if (type == "Background") {
            scene_.backgrounds.push_back({node, turn_});
        } else if (type == "WorldInfo") {
            const auto& title = node->get<std::string>("title");
            if (scene_.title.empty()) scene_.title = title;
            scene_.infos.push_back({node->get<std::vector<std::string>>("info"), world, parent});
        } else if (type == "Switch") {
            const auto& choice = node->get<NodeList>("choice");
            const auto chosen = node->get<std::int32_t>("whichChoice");
            if (chosen >= 0 && static_cast<std::size_t>(chosen) < choice.size())
                return visit(choice[chosen], world, ++groups_, depth + 1);
        } else if (type == "LOD") {
            const auto& levels = node->get<NodeList>("level");
            if (!levels.empty()) return visitAsGroup(*node, {levels[0]}, world, depth);
        } else if (const auto* children = childrenOf(*node)) {
            if (!isPlainGroup(type)) return visitAsGroup(*node, *children, world, depth);
            glm::dmat4 here = world;
            const glm::dquat turn = turn_;
            if (type == "Transform") {
                turn_ = turn_ * quatFromAxisAngle(axisAngle(node->get<Rotation>("rotation")));
                here = world * transformMatrix(node->get<glm::vec3>("center"),
                                               axisAngle(node->get<Rotation>("rotation")),
                                               node->get<glm::vec3>("scale"),
                                               axisAngle(node->get<Rotation>("scaleOrientation")),
                                               node->get<glm::vec3>("translation"));
            }
            auto done = visitAll(*children, here, depth);
            turn_ = turn;
            return done;
        } else if (!isSetting(type)) {
            scene_.leftOut.insert(type);
            if (type == "Shape")
                if (const NodePtr& geometry = node->get<NodePtr>("geometry"))
                    scene_.leftOut.insert(geometry->info->name);
        }
        return {};
    }

    /// Whether a TimeSensor is in a PROTO or in those that it uses.
    bool holdsClock(const Proto& proto) {
        const auto known = clocks_.try_emplace(&proto, false);
        bool& holds = known.first->second;
        if (!known.second) return holds;
        std::vector<const Proto*> open{&proto};
        std::unordered_set<const Proto*> seen{&proto};
        while (!open.empty()) {
            const Proto& next = *open.back();
            open.pop_back();
            for (const NodePtr& node : next.body)
                forEachNode(node, [&](const NodePtr& inside) {
                    ++visits_;
                    if (inside->is("TimeSensor")) holds = true;
                    if (inside->proto && seen.insert(inside->proto.get()).second)
                        open.push_back(inside->proto.get());
                });
        }
        return holds;
    }

    /// Settings, clocks and what they drive show nothing by themselves.
    static bool isSetting(std::string_view type) {
        for (const std::string_view setting : {"QuantizationParameter", "Viewpoint", "Viewport",
                                               "NavigationInfo", "TimeSensor", "Valuator"})
            if (type == setting) return true;
        return type.find("Interpolator") != std::string_view::npos;
    }
    /// Groups whose children are where they would be without it, but for Transform.
    static bool isPlainGroup(std::string_view type) {
        for (const std::string_view group :
             {"Group", "OrderedGroup", "Transform", "Layer2D", "Layer3D", "Anchor", "Collision"})
            if (type == group) return true;
        return false;
    }
    static const NodeList* childrenOf(const Node& node) {
        const int index = node.info->find("children");
        return index < 0 ? nullptr : std::get_if<NodeList>(&node.value(index));
    }

    Result<void> visitAll(const NodeList& children, const glm::dmat4& world, int depth) {
        const int group = ++groups_;
        for (const NodePtr& child : children) STX_CHECK(visit(child, world, group, depth + 1));
        return {};
    }

    Result<void> visitAsGroup(const Node& node, const NodeList& children, const glm::dmat4& world,
                              int depth) {
        const std::size_t before = scene_.nodes.size();
        STX_CHECK(visitAll(children, world, depth));
        if (scene_.nodes.size() > before) scene_.asGroups.insert(node.info->name);
        return {};
    }

    static constexpr std::int64_t kMaxVisits = 1 << 21;
    const Limits& limits_;
    ShownScene& scene_;
    std::vector<const Node*> path_;        ///< from the root to the node that is visited
    glm::dquat turn_{1.0, 0.0, 0.0, 0.0};  ///< of all Transforms above the node that is visited
    std::int64_t visits_ = 0;
    std::unordered_map<const Proto*, bool> clocks_;  ///< whether one is inside
    int groups_ = 0;
};

}  // namespace

Result<ShownScene> shownScene(const NodePtr& root, const Limits& limits) {
    ShownScene scene;
    STX_CHECK(Walker(limits, scene).visit(root, glm::dmat4(1.0), 0, 1));
    return scene;
}

}  // namespace stx::mpeg4
