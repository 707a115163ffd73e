#pragma once

#include <cstddef>
#include <vector>

#include "lib/model/reference_view.hpp"

/// Cameras that registration moved, and those that were given beside them.
namespace stx {

/// How a camera got from one pose to the other.
[[nodiscard]] CameraMove moveBetween(const Camera& from, const Camera& to);
/// Moves a view's camera, and keeps how, beside earlier moves (Refined::moved).
void moveCamera(ViewHeader& view, const CameraMove& move);
/// The same of a view with its images: normals and splat axes, which are in the world, turn along.
void moveCamera(ReferenceView& view, const CameraMove& move);
/// Bounds of what a view shows, which had these bounds before its camera moved: of their corners.
[[nodiscard]] Bounds movedBounds(const Bounds& bounds, const Camera& from, const Camera& to);

/// A view's camera among others, some of which moved.
struct MovedCamera {
    Camera camera;    ///< as it is now
    CameraMove move;  ///< how it got there; none: it stayed
    double distance;  ///< of what it shows, scene units

    [[nodiscard]] static MovedCamera of(const ViewHeader& view);
};
/// Moves cameras that were given beside those of the views, as a file of cameras of the same
/// recording has them, as the views near them moved: what they show is seen from where it was
/// taken. Errors of trackers drift, so that cameras near each other share them: the mean of their
/// moves, weighted by one over the square of how far they are apart (the angle between the
/// directions they look in, and what their distance covers of what they show), as Shepard (1968)
/// interpolates. Errors that each camera has by itself say nothing of another's: the mean counts by
/// the share of the views' own moves that their neighbours' tell, each view left out in turn. A
/// camera given as a view's moves as that view did. Where no view moved all stay, to the bit.
class MovesOfNeighbours {
  public:
    MovesOfNeighbours() = default;
    explicit MovesOfNeighbours(std::vector<MovedCamera> views);
    [[nodiscard]] Camera aligned(const Camera& camera) const;
    /// How much of the views' moves their neighbours tell, 0 to 1.
    [[nodiscard]] double share() const { return share_; }

  private:
    struct Mean {
        glm::dvec3 shift{0.0}, turn{0.0};
        double nearest = 0;  ///< how far the nearest view is apart
    };
    [[nodiscard]] Mean meanFor(const Camera& camera, std::size_t without) const;
    std::vector<MovedCamera> views_;
    bool still_ = true;  ///< no view moved
    double share_ = 1;
    double usualGap_ = 0;  ///< from a view to the nearest other, the median
};

}  // namespace stx
