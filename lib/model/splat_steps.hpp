#pragma once

#include <cstdint>

#include <glm/glm.hpp>

namespace stx {

/// Half axes of splats that are coded in even steps: whether these are too coarse for most of them.
class SplatSteps {
  public:
    /// Share of a half axis, which reaches about to the next sample, that a step may be: rounding
    /// to half a step moves the end of a splat by a two hundredth of a sample then, which no
    /// picture of these samples shows. SPZ rounds sizes by 3 %.
    static constexpr double kMostStep = 0.01;

    /// `step`: of each component, scene units.
    explicit SplatSteps(double step) : least_(step / kMostStep) {}

    /// Adds an axis; zero is none.
    void add(glm::dvec3 axis) {
        const double square = glm::dot(axis, axis);
        if (!(square > 0)) return;
        ++axes_;
        shorter_ += square < least_ * least_ ? 1 : 0;
    }
    /// Whether a step is more than kMostStep of the median axis.
    [[nodiscard]] bool tooCoarse() const { return 2 * shorter_ > axes_; }

  private:
    double least_ = 0;  ///< length of the shortest axis that the steps are fine enough for
    std::int64_t axes_ = 0, shorter_ = 0;
};

}  // namespace stx
