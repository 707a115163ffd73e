#pragma once

#include <cstdint>
#include <vector>

#include "lib/model/bundle.hpp"

namespace stx::bench {

/// The yardstick of all measurements: what anybody would write first to draw a bundle. One thread
/// projects every point of four views of 1024x768 (an analytic room, so that no file is needed) and
/// keeps the nearest of each pixel in a buffer of floats.
class Yardstick {
  public:
    Yardstick();

    /// Draws one frame; seconds.
    double draw();
    /// Points of a frame.
    [[nodiscard]] double points() const;

  private:
    void splat(const ReferenceView& view);

    Bundle bundle_;
    Camera novel_;
    std::vector<float> nearest_;
    std::vector<std::uint32_t> picture_;
};

}  // namespace stx::bench
