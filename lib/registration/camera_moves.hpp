#pragma once

#include <span>

#include "lib/model/reference_view.hpp"

/// Cameras that registration moved, and those that were given beside them.
namespace stx {

/// How a camera got from one pose to the other.
[[nodiscard]] CameraMove moveBetween(const Camera& from, const Camera& to);
/// Moves a view's camera, and keeps how, beside earlier moves (Refined::moved).
void moveCamera(ViewHeader& view, const CameraMove& move);
/// Bounds of what a view shows, which had these bounds before its camera moved: of their corners.
[[nodiscard]] Bounds movedBounds(const Bounds& bounds, const Camera& from, const Camera& to);

/// A view's camera among others, some of which moved.
struct MovedCamera {
    Camera camera;    ///< as it is now
    CameraMove move;  ///< how it got there; none: it stayed
    double distance;  ///< of what it shows, scene units

    [[nodiscard]] static MovedCamera of(const ViewHeader& view);
};
/// A camera that was given beside those of the views, as a file of cameras of the same recording
/// has it, moved as those near it were: what it shows is seen from where it was taken. Errors of
/// trackers drift, so that cameras near each other share them: the mean of their moves, weighted by
/// one over the square of how far they are apart (the angle between the directions they look in,
/// and what their distance covers of what they show), as Shepard (1968) interpolates. A
/// camera given as a view's moves as that view did. Where no view moved it stays, to the bit.
[[nodiscard]] Camera alignedAmong(const Camera& camera, std::span<const MovedCamera> views);

}  // namespace stx
