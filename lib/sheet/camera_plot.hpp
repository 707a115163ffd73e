#pragma once

#include <string>
#include <vector>

#include "lib/geometry/bounds.hpp"
#include "lib/geometry/camera.hpp"

namespace stx {

/// A camera of a plot, in the world.
struct PlottedCamera {
    std::string name;
    Camera camera;
};

/// An SVG picture of cameras around an object, from above and from the side, both at one scale:
/// viewpoints with their numbers, what each sees (the beginning of its pyramid; orthographic: its
/// window), the object's box, the axes and a scale. Up is upOfCameras(); from above the front is at
/// the bottom, from the side it is towards the viewer. Numbers that would cover others are left
/// out; pointing at a camera shows its name. `object` may be empty. `title`: any text.
[[nodiscard]] std::string cameraPlot(const std::vector<PlottedCamera>& cameras,
                                     const Bounds& object, const std::string& title);

}  // namespace stx
