#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "lib/render/api/renderer.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx::gl {

/// The points of all views as vertex arrays in system memory.
struct PointArrays {
    glm::dvec3 centre{0};              ///< positions are relative to it, so that floats suffice
    double radius = 0;                 ///< of a ball around it that holds all points
    std::vector<glm::vec3> positions;  ///< world axes, scene units
    std::vector<glm::u8vec4> colours;  ///< 8-bit bundles without lights
    std::vector<glm::vec4> coloursF;   ///< all others: linear light
    std::vector<glm::vec3> normals;    ///< world; only for lights
    std::vector<float> spacings;       ///< scene units between neighbouring samples
    bool linear = false;               ///< the bundle's colours are, and so are those of the frame
    bool decoded = false;  ///< coloursF are 8-bit sRGB codes decoded; frames are coded again

    [[nodiscard]] bool inFloats() const { return linear || decoded; }
};

/// All points at least half covered. `lit`: with normals, and colours as linear light, in which
/// alone lights add up.
[[nodiscard]] PointArrays makePointArrays(const PageSet& set, bool lit);

/// Points of one size, as a run of PointGroups::indices.
struct PointGroup {
    int size = 1;  ///< pixels
    std::size_t first = 0, count = 0;
};
struct PointGroups {
    std::vector<std::uint32_t> indices;
    std::vector<PointGroup> groups;
    double nearest = 0, farthest = 0;  ///< planar distances of the points in front of the camera
};

/// Splat sizes of all points for a camera, whole pixels of 1 to `largest`, computed on the CPU and
/// sorted by size. Points behind the camera are left out.
void groupPoints(const PointArrays& points, const RenderSettings& settings, const Camera& camera,
                 int largest, PointGroups& out);

}  // namespace stx::gl
