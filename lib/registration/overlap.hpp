#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "lib/geometry/near_views.hpp"
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

/// What a view shows on a grid of its pixels: all that is looked at of it to find out what another
/// one sees of the same.
struct GridOfPoints {
    struct Point {
        std::uint16_t x, y;  ///< its pixel
        float own;           ///< distance
        float right, below;  ///< of the pixels beside it, where they are on one surface
        bool onSurface;      ///< they are
    };
    std::vector<Point> points;  ///< pixels of the grid that have one, row by row
};
/// `perAxis`: about so many pixels along either side.
[[nodiscard]] GridOfPoints gridOfPoints(const Image<float>& depth, int perAxis);
/// Around the points of a view with that camera.
[[nodiscard]] ShownSphere sphereAround(const GridOfPoints& grid, const Camera& camera);

/// What two views both show, on a grid of pixels of the first.
struct CommonPoints {
    struct CommonPoint {
        double own;    ///< its distance from the view it is of
        double at;     ///< from the other one
        double shown;  ///< what the other one shows there
        double bent;   ///< by how much that may be off, where its surface bends between pixels
    };
    int asked = 0;  ///< pixels of the grid that have a point
    int faced = 0;  ///< of these whose side the other one would see, where it has a surface
    /// Of these that are before that surface, by a larger share than the tolerance: the other one
    /// sees past them, which nothing in front of them can explain.
    int past = 0;
    std::vector<CommonPoint> points;

    [[nodiscard]] double overlap() const {
        return asked > 0 ? static_cast<double>(points.size()) / asked : 0;
    }
};
/// Two views, by index, of which one has points where the other has surfaces.
struct SeenPast {
    int from = 0;
    int to = 0;
    bool most = false;  ///< `to` sees past more than half of them
};
/// The fewest points of a pair that say something.
inline constexpr std::size_t kFewestPoints = 30;

/// Points of the grid of a view with that camera that are apart by a larger share than `tolerance`,
/// or that are seen from the other side, are not the same.
[[nodiscard]] CommonPoints commonPoints(const GridOfPoints& from, const Camera& own,
                                        const DepthView& to, double tolerance);

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

/// Points a side by which it is found who overlaps, among so many views.
[[nodiscard]] int probesAmong(std::size_t views);
/// Points a side by which a pair is measured.
inline constexpr int kMeasured = 80;

/// What a pair disagrees by.
struct OfPair {
    bool told = false;
    double relative = 0, oneSurface = 0;  ///< as in ViewDisagreement
};
/// `from`: the grid of kMeasured of a view with that header.
[[nodiscard]] OfPair measurePair(const GridOfPoints& from, const ViewHeader& own,
                                 const DepthView& to, double tolerance);
/// Adds what the common points of two views say of that, if they are enough.
void addSeenPast(int from, int to, const CommonPoints& common, const OverlapSettings& settings,
                 std::vector<SeenPast>& past);
/// Of pairs in the order of overlappingPairs(), and as many views; `past` in any order.
[[nodiscard]] DepthDisagreement togetherOf(const std::vector<Pair>& pairs,
                                           const std::vector<OfPair>& found, std::size_t views,
                                           const std::vector<SeenPast>& past,
                                           const OverlapSettings& settings);

/// Pairs of overlapping views, both directions, in order of `from`, the widest overlaps first. Each
/// is looked for in kMostCompared others at most: viewsThatMayShow(). `past` gets what these say of
/// each other.
[[nodiscard]] std::vector<Pair> overlappingPairs(std::span<const DepthView> views,
                                                 const OverlapSettings& settings,
                                                 std::vector<SeenPast>* past = nullptr);

/// What the pairs and their views disagree by.
[[nodiscard]] DepthDisagreement disagreement(std::span<const DepthView> views,
                                             const std::vector<Pair>& pairs,
                                             const OverlapSettings& settings,
                                             const std::vector<SeenPast>& past = {});

}  // namespace stx::registration
