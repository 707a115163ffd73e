#pragma once

#include <functional>
#include <memory>

#include "lib/render/api/renderer.hpp"

namespace stx {

/// A pixel covered by this share or more shows nothing of what is behind it.
inline constexpr float kCoveredInFull = 0.999f;

/// Whether nothing that is seen now says that a point of the background is not there: of pixel
/// (x, y), at a distance.
using MayStand = std::function<bool(int x, int y, float depth)>;

/// Lays a frame over another of the same camera that shows the background only: where the first is
/// open, by as much as it is open. Where the background has something clearly in front of the first
/// frame's surface, that hides it (the part of a pillar that somebody stands before, with the wall
/// behind it in sight) when it may stand there; else it is not there now, and left out.
void putBehind(Frame& front, const Frame& background, const MayStand& mayStand);

/// Pixels farther than half of `farAway` have no depth: nobody knows where they are. 0: all stay.
/// See PageSet::farAway().
void forgetFar(Image<float>& depth, double farAway);

/// A renderer that draws the background views where the other views show nothing. Both must draw
/// without filling holes. `farAway`: PageSet::farAway() of what is behind.
[[nodiscard]] std::unique_ptr<Renderer> withBackground(std::unique_ptr<Renderer> front,
                                                       std::unique_ptr<Renderer> background,
                                                       double farAway);

}  // namespace stx
