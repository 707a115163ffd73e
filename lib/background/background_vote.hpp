#pragma once

#include "lib/background/depth_layers.hpp"
#include "lib/background/frame_gauge.hpp"
#include "lib/background/temporal.hpp"

namespace stx::temporal {

/// Samples beside depth edges count this share of others; found by trial.
inline constexpr double kWeakShare = 0.25;

/// Whether a scene is all around, not an object in empty space, as so many points in so many pixels
/// tell: a sensor misses a quarter of a room.
[[nodiscard]] inline bool fillsFrame(std::int64_t points, double pixels) {
    return static_cast<double>(points) > 0.5 * pixels;
}

/// Inverse distances of what a pixel showed before its background, 0 = nothing.
using InFront = Image<glm::vec2>;

/// Which of a pixel's layers is the background, and of what colour.
struct Vote {
    int frames = 0;
    double support = 0.04;
    bool fillsFrame = true;  ///< emptiness is what the sensor missed, not what is behind all
    glm::vec3 gain{1.0f};    ///< of the light that the model gets
    float noise = 0;         ///< how much brightness differs from frame to frame, steps of 0..255
    double firstTime = 0;

    /// Sets a pixel of the model; leaves it empty when the background was not seen there.
    template <class Sample>
    void decide(const PixelLayers<Sample>& layers, std::size_t pixel, BackgroundModel& model,
                InFront& inFront) const;
    /// Makes this layer the pixel's background.
    template <class Sample>
    void set(const Layer<Sample>& layer, std::size_t pixel, BackgroundModel& model) const;
};

/// Drops parts of moving things that never left their place and so look like background, as the
/// middle of somebody who turns: a surface whose outline goes on in what other pixels had before
/// their background.
void dropGhosts(BackgroundModel& model, const InFront& inFront, const DepthNoise& noise,
                float step);

/// Drops pixels that no neighbour agrees with, and closes single open ones between equal depths.
void checkNeighbours(BackgroundModel& model, const DepthNoise& noise, float step);

}  // namespace stx::temporal
