#pragma once

#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "formats/mpeg4/scene/placement.hpp"
#include "formats/mpeg4/scene/scene.hpp"

namespace stx::mpeg4 {

/// A DepthImage or OctreeImage that is shown, and where.
struct ShownNode {
    /// DepthImage, DepthImageV2 or OctreeImage, with no instance of a PROTO in it; a copy where
    /// there is one.
    NodePtr node;
    glm::dmat4 worldFromLocal{1.0};  ///< of all Transforms above it
    int parent = 0;                  ///< the same for nodes under the very same grouping node's use
};

/// The strings of a WorldInfo, and where they are said.
struct ShownInfo {
    std::vector<std::string> text;
    glm::dmat4 worldFromLocal{1.0};  ///< of all Transforms above it
    int parent = 0;                  ///< as that of nodes is
};

/// A Background, and how the nodes above it turn it: nothing else of theirs counts (VRML97, 6.5).
struct ShownBackground {
    NodePtr node;
    glm::dquat worldFromLocal{1.0, 0.0, 0.0, 0.0};
};

/// What a scene shows, from top to bottom: all children of grouping nodes, only the chosen one of a
/// Switch and the finest of a LOD; a node that is used twice appears twice. Errors when that is
/// more than `limits` allow.
struct ShownScene {
    std::vector<ShownNode> nodes;
    std::string title;             ///< of the first WorldInfo with one
    std::vector<ShownInfo> infos;  ///< of each WorldInfo
    /// The Backgrounds in the order they are met; the first is bound.
    std::vector<ShownBackground> backgrounds;
    std::unordered_set<const Node*> above;  ///< the nodes that one of `nodes` is in
    /// Other nodes whose fields say what is shown and where: those that a WorldInfo or Background
    /// is in, instances of PROTOs, and Switches that have such or views in them.
    std::unordered_set<const Node*> settledBy;
    std::set<std::string> leftOut;  ///< types of nodes that are no views, groups or settings
    /// Types of grouping nodes that turn, move or choose their children; read as plain groups.
    std::set<std::string> asGroups;
    /// PROTOs of which instances are shown, and that have TimeSensors inside.
    std::set<std::string> withClocks;

    /// Whether this is what the scene shows still, of which it was made when its changes were last
    /// cleared.
    [[nodiscard]] bool isStillOf(const Scene& scene) const;
};
[[nodiscard]] Result<ShownScene> shownScene(const NodePtr& root, const Limits& limits);

[[nodiscard]] inline glm::dvec4 axisAngle(const Rotation& r) {
    return {r.axis.x, r.axis.y, r.axis.z, r.angle};
}

}  // namespace stx::mpeg4
