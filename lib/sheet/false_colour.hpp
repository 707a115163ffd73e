#pragma once

#include <limits>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/sheet/canvas.hpp"

namespace stx {

/// The colour of 0..1 (clamped; NaN is 0) on the map viridis by Smith, van der Walt and Firing
/// (CC0): equal steps look equally large, and brightness rises from end to end, so that it reads in
/// grey and for colour-blind people, too.
[[nodiscard]] glm::u8vec3 viridis(double t);

/// From the least to the largest of some values; empty until one was added.
struct ValueRange {
    double least = std::numeric_limits<double>::infinity();
    double most = -std::numeric_limits<double>::infinity();

    /// Values that are not finite do not count.
    void add(double value);
    void add(const ValueRange& other);
    [[nodiscard]] bool empty() const { return !(least <= most); }
    /// Where a value lies, 0 at `least` and 1 at `most`; 0.5 when both are the same.
    [[nodiscard]] double place(double value) const;
};

/// Of all finite values.
[[nodiscard]] ValueRange rangeOf(const Image<float>& values);

/// Each value by its place in the range, `empty` where it is not finite.
[[nodiscard]] Rgb8Image falseColour(const Image<float>& values, const ValueRange& range,
                                    glm::u8vec3 empty);

}  // namespace stx
