#pragma once

#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "lib/registration/refine_poses.hpp"

namespace stx::registration {

/// Two views, by index, that see common surface: points of `from` are looked up in `to`.
struct Pair {
    int from = 0;
    int to = 0;
    double overlap = 0;  ///< share of the pixels of `from` that `to` sees, too
};

/// Distance and its gradient (per pixel) of a depth image at a pixel position, bilinear; nothing
/// beside an edge or where a neighbour has no point.
struct DepthSample {
    double distance;
    glm::dvec2 gradient;
};
[[nodiscard]] std::optional<DepthSample> sampleDepth(const Image<float>& depth, double x, double y);

/// A view's camera, ready to be applied to many points.
struct Pose {
    glm::dmat3 worldFromCamera;
    glm::dvec3 position;
    explicit Pose(const Camera& camera)
        : worldFromCamera(glm::mat3_cast(camera.orientation)), position(camera.position) {}
    [[nodiscard]] glm::dvec3 toCamera(glm::dvec3 world) const {
        return (world - position) * worldFromCamera;
    }
};

/// Pairs of overlapping views, both directions, in order of `from`, the widest overlaps first.
[[nodiscard]] std::vector<Pair> overlappingPairs(const Bundle& bundle,
                                                 const PoseRefinementSettings& settings);

/// Median of the relative differences in depth, over the pairs.
[[nodiscard]] DepthDisagreement disagreement(const Bundle& bundle, const std::vector<Pair>& pairs,
                                             const PoseRefinementSettings& settings);

}  // namespace stx::registration
