#pragma once

#include <cstddef>
#include <cstdint>

#include "lib/render/surface/fill/fill.hpp"

namespace stx::surface {

/// A pixel covered by this share or more is not worth filling.
inline constexpr float kClosed = 0.999f;
/// A pixel open by more than this share takes the depth of what fills it.
inline constexpr float kMostlyOpen = 0.5f;
/// Distances to surface are counted up to this, pixels.
inline constexpr std::uint8_t kFarthestCounted = 255;

/// What is hidden is looked for up to twice the distance of what is seen, which is this share of q.
inline constexpr float kFarthestShare = 0.5f;

struct Hit {
    glm::vec3 colour;
    float q, distance;
};

struct FilledPixel {
    int x, y;
    glm::vec3 colour;
    float q;
    glm::vec3 normal{0.0f};  ///< zero where unknown
};

/// Puts a fill under what is in its pixel, by as much as that is open.
void putIn(OpenFrame& frame, const FilledPixel& fill);

/// Whether nothing needs to be filled at a pixel.
[[nodiscard]] inline bool closed(const OpenFrame& frame, int x, int y) {
    return frame.albedo.at(x, y).a >= kClosed && frame.q.at(x, y) > 0.0f;
}

/// The surface at a pixel, counted by rows.
[[nodiscard]] inline Hit hitAt(const OpenFrame& frame, std::ptrdiff_t pixel, float distance) {
    const glm::vec4 c = frame.albedo.data()[pixel];
    // Division by one is left out, since it changes nothing.
    return {c.a == 1.0f ? glm::vec3(c) : glm::vec3(c) / c.a, frame.q.data()[pixel], distance};
}

[[nodiscard]] inline Hit hitAt(const OpenFrame& frame, int x, int y, float distance) {
    return hitAt(frame, static_cast<std::ptrdiff_t>(y) * frame.q.width() + x, distance);
}

/// How far each pixel is from the nearest closed one, the larger of columns and rows, at most
/// kFarthestCounted; 0 for closed ones and no others.
[[nodiscard]] Image<std::uint8_t> distancesToSurface(const OpenFrame& frame);

}  // namespace stx::surface
