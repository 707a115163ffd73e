#pragma once

#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "lib/registration/disagreement.hpp"

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

/// What two views both show, on a grid of pixels of the first.
struct CommonPoints {
    struct CommonPoint {
        double own;    ///< its distance from the view it is of
        double at;     ///< from the other one
        double shown;  ///< what the other one shows there
    };
    int asked = 0;  ///< pixels of the grid that have a point
    std::vector<CommonPoint> points;

    [[nodiscard]] double overlap() const {
        return asked > 0 ? static_cast<double>(points.size()) / asked : 0;
    }
};
/// `perAxis`: about so many pixels of `from` along either side. Points that are apart by a larger
/// share than `tolerance`, or that are seen from the other side, are not the same.
[[nodiscard]] CommonPoints commonPoints(const DepthView& from, const DepthView& to, int perAxis,
                                        double tolerance);

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
[[nodiscard]] std::vector<Pair> overlappingPairs(std::span<const DepthView> views,
                                                 const OverlapSettings& settings);

/// What the pairs and their views disagree by.
[[nodiscard]] DepthDisagreement disagreement(std::span<const DepthView> views,
                                             const std::vector<Pair>& pairs,
                                             const OverlapSettings& settings);

}  // namespace stx::registration
