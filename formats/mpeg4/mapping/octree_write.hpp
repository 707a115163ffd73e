#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"

namespace stx::mpeg4 {

/// Most levels of an octree: 65536 voxels on a side.
inline constexpr int kMaxOctreeLevels = 16;

/// What an OctreeImage (ISO/IEC 14496-16, 4.5.4) of a bundle holds. The cube of the octree has side
/// 1 around the origin of its own frame; in the world it is `side` large around `centre`.
struct OctreeParts {
    glm::dvec3 centre{0.0};
    double side = 1;  ///< scene units
    Bounds used;      ///< of the voxels that are there, in the world
    int resolution = 1;
    std::vector<std::int32_t> octree;  ///< a byte for each inner node, breadth first
    std::int64_t voxels = 0;

    /// One for each view: a picture without depth.
    struct Picture {
        std::string name;
        Camera camera;  ///< in the frame of the cube, orthographic
        Rgba8Image colour;
    };
    std::vector<Picture> pictures;

    /// The cube is its own frame: no Transform is needed.
    [[nodiscard]] bool isUnitCube() const { return side == 1.0 && centre == glm::dvec3(0.0); }
};

/// Voxels wherever a view has a point; between neighbouring pixels of one surface, too. The cube is
/// fitted to the points; to orthographic views, such that what was read as an OctreeImage gives the
/// same voxels again. Orthographic views keep their pictures, but where alpha is 0 those
/// of their pixels that show a voxel get its colour; of a perspective view, the picture is what the
/// voxels look like along its axis, a pixel a voxel. `levels`: 1 to kMaxOctreeLevels. Errors:
/// (usage) other levels; (invalidInput) a bundle without a point, or with a wrong depth;
/// (unsupported) pictures that become too large; memory over the limit; cancelled.
[[nodiscard]] Result<OctreeParts> octreeFromBundle(const Bundle& bundle, int levels, Job& job);

}  // namespace stx::mpeg4
