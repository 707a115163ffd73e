#pragma once

#include "lib/model/bundle.hpp"

namespace stx {

/// Scenes that are exact formulas: inputs of the benchmark and truth for tests, with no file.
enum class AnalyticScene {
    object,  ///< a ring with bumps and stripes, about 15 % of its views
    room,    ///< a closed room with balls: every pixel of a view is a point
};

/// One picture of a scene with exact depth and normals. Colour and coverage are the mean of
/// samples x samples rays a pixel, depth and normal belong to the pixel's centre.
[[nodiscard]] ReferenceView viewOfAnalyticScene(AnalyticScene scene, const Camera& camera,
                                                int samples = 1);

/// Camera number `index` of `count` reference cameras: around the object (256x256), or side by side
/// in the room (1024x768). `index` may lie between them (0.5 = half way from the first to the
/// second).
[[nodiscard]] Camera analyticCamera(AnalyticScene scene, double index, int count);

/// `references` views by those cameras: Lee & Park's test data in kind and number of points.
[[nodiscard]] Bundle analyticBundle(AnalyticScene scene, int references, int samples = 1);

}  // namespace stx
