#pragma once

#include <optional>

#include "formats/mpeg4/scene/scene.hpp"

/// What moves a scene between its commands (ISO/IEC 14772-1, 6.48 and 4.6.8): TimeSensors send how
/// much of their cycle has passed along ROUTEs to interpolators, which send values to fields.
namespace stx::mpeg4 {

/// A clock's part of its cycle in [0, 1] at a time; nothing while it has never run. After its end:
/// where it stopped. `now` is in seconds of the scene.
[[nodiscard]] std::optional<float> fractionOf(const Node& timeSensor, double now);

/// When a clock that drives something begins, and the end of its first cycle; seconds.
struct ClockSpan {
    double begin = 0, end = 0;
    bool stops = false;  ///< at that end, which is held then
};
/// The spans of all clocks that a route leaves.
[[nodiscard]] std::vector<ClockSpan> clockSpans(const Scene& scene);

/// Sets the fields that routes reach as they are at `now`: Position-, Orientation-, Scalar-, Color-
/// and PositionInterpolator2D, and Valuator-free chains of routes behind them. Each route works
/// once, so that circles of routes end (ISO/IEC 14772-1, 4.10.4). Values of another type than the
/// field's, and interpolators whose keys and values do not fit each other, are passed over.
void applyInterpolators(Scene& scene, double now);

}  // namespace stx::mpeg4
