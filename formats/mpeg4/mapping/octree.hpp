#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"

namespace stx::mpeg4 {

/// The voxels of an OctreeImage (ISO/IEC 14496-16, 4.5.4): a cube of side 1 around the origin, cut
/// in half along each axis at each level. There is one byte for each inner node, breadth first; its
/// bit i says that child i exists. Which octant bit i means is shown by a figure only; here it is
/// x = i & 1, y = (i >> 1) & 1, z = (i >> 2) & 1, upwards along the axes.
class Octree {
  public:
    /// `octree` and `octreeResolution` as in the node. Levels = the least with 2^levels >=
    /// resolution. Errors: a resolution outside 1..65536, values outside 0..255, fewer bytes than
    /// the tree names inner nodes. Bytes behind the tree are counted in unusedBytes().
    [[nodiscard]] static Result<Octree> parse(std::span<const std::int32_t> octree,
                                              std::int32_t octreeResolution, const Limits& limits);

    [[nodiscard]] int levels() const { return levels_; }
    [[nodiscard]] std::size_t unusedBytes() const { return unused_; }
    /// Voxels that exist at the finest level.
    [[nodiscard]] std::int64_t voxelCount() const { return voxels_; }

    /// Distance along `direction` (unit) from `origin` to the first voxel that the whole line
    /// meets, which may be negative; kNoDepth when it meets none. `voxel` becomes which one it is,
    /// counted from the lower corner of the cube.
    [[nodiscard]] double firstHit(glm::dvec3 origin, glm::dvec3 direction,
                                  glm::ivec3* voxel = nullptr) const;

  private:
    struct Node {
        std::uint8_t children = 0;
        std::uint32_t first = 0;  ///< index of the first child that exists
    };
    double hit(std::uint32_t node, int level, glm::dvec3 low, double side, glm::dvec3 origin,
               glm::dvec3 direction, int nearest, glm::ivec3* voxel) const;

    int levels_ = 0;
    std::vector<Node> nodes_;  ///< inner nodes, breadth first
    std::size_t unused_ = 0;
    std::int64_t voxels_ = 0;
};

}  // namespace stx::mpeg4
