#pragma once

#include <functional>
#include <memory>
#include <string>

#include "lib/base/job.hpp"
#include "lib/render/surface/plan/plan.hpp"

namespace stx::surface {

/// What drawing gives, before holes are filled. All images have the frame's size and are cleared.
struct DrawnFrame {
    Image<glm::vec4>& colour;  ///< premultiplied
    Image<float>& q;           ///< of the main surface of each pixel, 0 = none
    /// Source (-1 = none) and position in it that the main surface takes its colour from; empty
    /// unless wanted.
    Image<glm::vec3>& origin;
};

/// Draws the tiles of frames: everything between the prepared sources and the holes.
class SurfaceBackend {
  public:
    virtual ~SurfaceBackend() = default;
    /// Called once, before any frame. The scene outlives the backend.
    [[nodiscard]] virtual Result<void> prepare(const SurfaceScene& scene, const Effort& effort,
                                               Job& job) = 0;
    /// Starts a frame; at most two are under way. It must live, where it is, until finish() or
    /// drop().
    [[nodiscard]] virtual Result<void> begin(const SurfaceFrame& frame) = 0;
    /// Completes the frame begun first of those under way, whether or not that succeeds.
    [[nodiscard]] virtual Result<void> finish(DrawnFrame out) = 0;
    /// Gives up the frame begun first of those under way.
    virtual void drop() = 0;
    /// A frame that has begun is drawn while the processor does something else.
    [[nodiscard]] virtual bool drawsAhead() const = 0;
    /// "cpu" or "gpu".
    [[nodiscard]] virtual std::string name() const = 0;
    /// See Renderer::device().
    [[nodiscard]] virtual std::string device() const = 0;
};

/// Surface mode with a backend: each reference is warped as a surface, the surfaces are fused and
/// checked against what the other references see, and each pixel's colour is fitted to the samples
/// of the references that see it. Prepares every view. A camera that is exactly that of a reference
/// gets that reference's pixels. Where the set has views behind it, another backend draws these.
/// Errors: the backends'.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeSurfaceRenderer(
    const PageSet& set, const RenderSettings& settings, Job& job,
    const std::function<Result<std::unique_ptr<SurfaceBackend>>()>& makeBackend);

}  // namespace stx::surface
