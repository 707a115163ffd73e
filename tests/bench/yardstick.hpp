#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lib/model/bundle.hpp"

namespace stx::bench {

/// The nearest point of each pixel.
struct NearestPoints {
    std::vector<float> depth;  ///< infinity = none
    std::vector<std::uint32_t> colour;

    void clear(std::size_t pixels);
};

/// The yardsticks of all measurements: what anybody would write first to draw a bundle, and what
/// anybody would make of it next. Every point of four views of 1024x768 (an analytic room, so that
/// no file is needed) is projected, and the nearest of each pixel is kept in a buffer of floats.
class Yardstick {
  public:
    Yardstick();

    /// Draws one frame, one point after another on one thread; seconds.
    double draw();
    /// The same with as many points at once as a vector takes, on all threads. Each has a buffer of
    /// its own, and the nearest of them is kept in the end; seconds.
    double drawInVectors();
    /// Points of a frame.
    [[nodiscard]] double points() const;
    /// What the last call drew.
    [[nodiscard]] const NearestPoints& drawn() const { return nearest_; }

  private:
    void splat(const ReferenceView& view);

    Bundle bundle_;
    Camera novel_;
    NearestPoints nearest_;
    std::vector<NearestPoints> ofThreads_;
};

/// Draws rows [from, to) of a view.
void splatRows(const ReferenceView& view, const Camera& novel, int from, int to,
               NearestPoints& nearest);
/// Keeps the nearest of all in the first of them, pixels [from, to).
void keepNearest(std::span<NearestPoints> all, std::size_t from, std::size_t to);

}  // namespace stx::bench
