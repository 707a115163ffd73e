#include "formats/mpeg4/mapping/octree.hpp"

#include <bit>
#include <cmath>

#include "lib/geometry/depth_code.hpp"

namespace stx::mpeg4 {

Result<Octree> Octree::parse(std::span<const std::int32_t> octree, std::int32_t octreeResolution,
                             const Limits& limits) {
    if (octreeResolution < 1 || octreeResolution > 65536)
        return fail(ErrorCode::invalidInput,
                    "OctreeImage.octreeResolution is {}; 1 to 65536 voxels are possible",
                    octreeResolution);
    if (auto ok = limits.checkAllocation(octree.size(), sizeof(Node), "the octree"); !ok)
        return propagate(ok);
    Octree tree;
    while ((1 << tree.levels_) < octreeResolution) ++tree.levels_;

    tree.nodes_.reserve(octree.size());
    std::size_t at = 0;
    std::uint64_t width = tree.levels_ > 0 ? 1 : 0;  // inner nodes of the level
    if (octree.empty()) width = 0;
    for (int level = 0; level < tree.levels_ && width > 0; ++level) {
        if (octree.size() - at < width)
            return fail(
                ErrorCode::invalidInput,
                "OctreeImage.octree has {} bytes, but level {} of the tree has {} inner nodes "
                "from byte {} on",
                octree.size(), level, width, at);
        std::uint64_t below = 0;
        for (std::uint64_t i = 0; i < width; ++i, ++at) {
            const std::int32_t byte = octree[at];
            if (byte < 0 || byte > 255)
                return fail(ErrorCode::invalidInput,
                            "OctreeImage.octree[{}] is {}; bytes are 0..255", at, byte);
            Node node;
            node.children = static_cast<std::uint8_t>(byte);
            node.first = static_cast<std::uint32_t>(tree.nodes_.size() + (width - i) + below);
            below += std::popcount(node.children);
            tree.nodes_.push_back(node);
        }
        if (level + 1 == tree.levels_) tree.voxels_ = static_cast<std::int64_t>(below);
        width = below;
    }
    if (tree.levels_ == 0) tree.voxels_ = 1;  // the whole cube is one voxel
    tree.unused_ = octree.size() - at;
    return tree;
}

double Octree::firstHit(glm::dvec3 origin, glm::dvec3 direction, glm::ivec3* voxel) const {
    // Children are tried in the order in which the line passes them: nearest octant first.
    const int nearest =
        (direction.x < 0 ? 1 : 0) | (direction.y < 0 ? 2 : 0) | (direction.z < 0 ? 4 : 0);
    if (levels_ > 0 && nodes_.empty()) return kNoDepth;
    return hit(0, 0, glm::dvec3(-0.5), 1.0, origin, direction, nearest, voxel);
}

double Octree::hit(std::uint32_t node, int level, glm::dvec3 low, double side, glm::dvec3 origin,
                   glm::dvec3 direction, int nearest, glm::ivec3* voxel) const {
    double enter = -std::numeric_limits<double>::infinity();
    double leave = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        const double a = low[axis] - origin[axis];
        const double b = a + side;
        if (std::abs(direction[axis]) < 1e-12) {
            // Half open, so that a line between two voxels meets exactly one of them.
            if (!(a <= 0 && 0 < b)) return kNoDepth;
            continue;
        }
        const double t0 = a / direction[axis], t1 = b / direction[axis];
        enter = std::max(enter, std::min(t0, t1));
        leave = std::min(leave, std::max(t0, t1));
    }
    if (!(enter <= leave)) return kNoDepth;
    if (level == levels_) {
        if (voxel) *voxel = glm::ivec3(glm::round((low + 0.5) * static_cast<double>(1 << levels_)));
        return enter;
    }

    const Node& here = nodes_[node];
    const double half = side / 2;
    for (int step = 0; step < 8; ++step) {
        const int child = step ^ nearest;
        if (!(here.children >> child & 1)) continue;
        const auto before =
            std::popcount(static_cast<unsigned>(here.children & ((1u << child) - 1)));
        const glm::dvec3 corner =
            low + half * glm::dvec3(child & 1, child >> 1 & 1, child >> 2 & 1);
        const double found =
            hit(here.first + before, level + 1, corner, half, origin, direction, nearest, voxel);
        if (found < kNoDepth) return found;
    }
    return kNoDepth;
}

}  // namespace stx::mpeg4
