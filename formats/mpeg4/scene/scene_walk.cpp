#include "formats/mpeg4/scene/scene_walk.hpp"

namespace stx::mpeg4 {
namespace {

class Walker {
  public:
    Walker(const Limits& limits, ShownScene& scene) : limits_(limits), scene_(scene) {}

    Result<void> visit(const NodePtr& node, const glm::dmat4& world, int parent, int depth) {
        if (!node) return {};
        // A few nodes that USE each other in turn can be shown in any number of places.
        if (++visits_ > kMaxVisits)
            return fail(ErrorCode::invalidInput,
                        "the scene shows more than {} nodes, counting each USE; that is not read",
                        kMaxVisits);
        if (depth > limits_.maxNesting)
            return fail(ErrorCode::invalidInput, "nodes nest deeper than {}", limits_.maxNesting);
        const std::string& type = node->info->name;
        if (type == "DepthImage" || type == "DepthImageV2" || type == "OctreeImage") {
            if (scene_.nodes.size() >= static_cast<std::size_t>(limits_.maxViews))
                return fail(ErrorCode::invalidInput, "the scene shows more than {} views",
                            limits_.maxViews);
            scene_.nodes.push_back({node, world, parent});
        } else if (type == "WorldInfo") {
            const auto& title = node->get<std::string>("title");
            if (scene_.title.empty()) scene_.title = title;
            scene_.infos.push_back({node->get<std::vector<std::string>>("info"), world});
        } else if (type == "Shape") {
            scene_.hasShapes = true;
        } else if (type == "Switch") {
            const auto& choice = node->get<NodeList>("choice");
            const auto chosen = node->get<std::int32_t>("whichChoice");
            if (chosen >= 0 && static_cast<std::size_t>(chosen) < choice.size())
                return visit(choice[static_cast<std::size_t>(chosen)], world, ++groups_, depth + 1);
        } else if (const int index = node->info->find("children"); index >= 0) {
            glm::dmat4 here = world;
            if (type == "Transform") {
                here = world * transformMatrix(node->get<glm::vec3>("center"),
                                               axisAngle(node->get<Rotation>("rotation")),
                                               node->get<glm::vec3>("scale"),
                                               axisAngle(node->get<Rotation>("scaleOrientation")),
                                               node->get<glm::vec3>("translation"));
            }
            const int group = ++groups_;
            const auto* children = std::get_if<NodeList>(&node->value(index));
            if (!children) return {};
            for (const NodePtr& child : *children) STX_CHECK(visit(child, here, group, depth + 1));
        }
        return {};
    }

  private:
    static constexpr std::int64_t kMaxVisits = 1 << 21;
    const Limits& limits_;
    ShownScene& scene_;
    std::int64_t visits_ = 0;
    int groups_ = 0;
};

}  // namespace

Result<ShownScene> shownScene(const NodePtr& root, const Limits& limits) {
    ShownScene scene;
    STX_CHECK(Walker(limits, scene).visit(root, glm::dmat4(1.0), 0, 1));
    return scene;
}

}  // namespace stx::mpeg4
