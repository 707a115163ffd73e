#pragma once

#include <memory>
#include <optional>

#include "lib/background/frame_warp.hpp"
#include "lib/background/temporal.hpp"

namespace stx::temporal {

/// What frames of a camera that moves show along the rays of one pose of its path: the background
/// of that pose. First every frame is seen, then every frame carves, in the same order:
///
///     KeyBackground key(view, settings);
///     for (each frame) {
///         const FrameGauge light = key.measure(view, camera, noise);
///         key.see(warpFrame(view, camera, noise), light, number, seconds);
///     }
///     for (each frame) key.carve(carveFrame(view, camera, emptyIsFar), noise);
///     BackgroundModel background = key.finish(...);
///
/// A pixel remembers layers of depth (depth_layers.hpp). A layer that frames look through is of
/// something that moved: free-space carving, as of Kutulakos and Seitz ("A theory of shape by
/// space carving", 2000), with votes. Of what is left the nearest is the background.
class KeyBackground {
  public:
    /// Memory of a pixel, with the pose's own frame: of 8-bit colour, and of linear light.
    static constexpr std::uint64_t kBytesPerPixel = 264, kBytesPerLinearPixel = 408;

    /// `key`: the frame of the pose, perspective; `support` as TemporalBackgroundSettings has it.
    KeyBackground(ReferenceView key, double support);
    KeyBackground(KeyBackground&&) noexcept;
    KeyBackground& operator=(KeyBackground&&) noexcept;
    ~KeyBackground();

    /// The light of a frame beside the pose's own, over what both see; adds to `noise` how far
    /// their depths disagree.
    [[nodiscard]] FrameGauge measure(const ReferenceView& view, const Camera& camera,
                                     DepthNoise& noise) const;
    void see(const WarpFrame& frame, const FrameGauge& light, const DepthNoise& noise,
             std::uint32_t number, float seconds);
    void carve(const WarpFrame& frame, const DepthNoise& noise);
    /// `frames`: all that were seen; `firstTime`: of the first, seconds. The view is marked as
    /// background; empty where nothing that stays was seen.
    [[nodiscard]] BackgroundModel finish(int frames, double firstTime, const DepthNoise& noise);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace stx::temporal
