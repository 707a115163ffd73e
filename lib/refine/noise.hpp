#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/geometry/pixel_space.hpp"

namespace stx {

/// What smoothing leaves counts as so many of its standard deviations.
inline constexpr float kDoubt = 2.0f;

/// The mean of values that were summed row by row, so that it is the same on any number of threads:
/// a sum and a number of values for each row. Nothing when there are no values.
[[nodiscard]] std::optional<double> meanOfRows(const std::vector<double>& sums,
                                               const std::vector<std::int64_t>& counts);

/// How noisy the depth of a view is: the standard deviation of what each pixel has of its own, as a
/// share of q; 0 when nothing can be told. `q` is as in PreparedPage. From second differences along
/// four directions: at edges and creases one of them runs along the edge, noise is in all. Of depth
/// in steps (disparities of a Kinect, millimetres) noise of more than about two steps, or what is
/// seen of less; exact depth in steps has none.
[[nodiscard]] float depthNoise(const Image<float>& q, const DepthAxis& axis);

/// Whether there is more noise than a code's rounding. `noise` is depthNoise().
[[nodiscard]] bool isNoisy(float noise, const DepthAxis& axis);

/// The surface of noisy depth, point by point. Each is on the plane that fits its surroundings,
/// without what is on another surface; its window grows until its estimates disagree
/// (Goldenshluger & Nemirovski 1997: intersection of confidence intervals), so that creases and
/// leaves stay.
class SmoothSurface {
  public:
    /// Bands around a plane in which points are on it, standard deviations: with the first window,
    /// which measures from the point itself, and with those after.
    struct Bands {
        float first, then;
    };
    struct Point {
        float q;
        glm::vec2 slope;  ///< q per pixel along x and along y
        float doubt;      ///< standard deviation of q
    };
    /// `q` is as in PreparedPage and must outlive this; `noise`: depthNoise(), above 0.
    SmoothSurface(const Image<float>& q, const DepthAxis& axis, float noise);
    /// At a pixel with a point.
    [[nodiscard]] Point at(int x, int y) const;
    [[nodiscard]] const Bands& bands() const { return bands_; }

  private:
    const Image<float>& q_;
    DepthAxis axis_;
    float noise_;
    Bands bands_;
};

/// Replaces each point, when isNoisy(), by the mean of what the planes of its SmoothSurface around
/// it say of it (Foi, Katkovnik & Egiazarian 2007); else leaves all as they are. `noise` is
/// depthNoise(). Gives how far off points may be then, a share of q; 0 when nothing was done. The
/// same on any number of threads. `surface`, if any, gets NoisyView::surface when something was
/// done.
float smoothDepth(Image<float>& q, const DepthAxis& axis, float noise,
                  Image<glm::vec3>* surface = nullptr);

}  // namespace stx
