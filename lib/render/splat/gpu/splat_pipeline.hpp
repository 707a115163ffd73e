#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include <glm/glm.hpp>

#include "lib/render/api/renderer.hpp"
#include "lib/render/device/egl_context.hpp"
#include "lib/render/splat/gpu/gpu_scene.hpp"
#include "lib/render/splat/gpu/splat_frame.hpp"
#include "lib/render/splat/gpu/splat_shaders.hpp"

namespace stx::gpu {

/// Largest piece of a frame drawn at once, pixels a side; bigger frames are drawn in pieces.
inline constexpr int kLargestPiece = 4096;

/// A finished picture in memory that the processor may read, row 0 on top, rows close together.
struct SplatPlanes {
    const glm::vec4* colour = nullptr;
    const float* depth = nullptr;
    const glm::vec3* normal = nullptr;  ///< null when frames carry none
    const glm::vec4* albedo = nullptr;  ///< null when frames carry none

    /// The planes as pipelines write them one after the other: colour, albedo, depth, normal; the
    /// second and the last where frames carry `normals`.
    [[nodiscard]] static SplatPlanes in(const std::byte* at, std::int64_t pixels, bool normals) {
        SplatPlanes out;
        out.colour = reinterpret_cast<const glm::vec4*>(at);
        at += sizeof(glm::vec4) * pixels;
        if (normals) {
            out.albedo = reinterpret_cast<const glm::vec4*>(at);
            at += sizeof(glm::vec4) * pixels;
        }
        out.depth = reinterpret_cast<const float*>(at);
        at += sizeof(float) * pixels;
        if (normals) out.normal = reinterpret_cast<const glm::vec3*>(at);
        return out;
    }
};

/// Blocks that reached a frame's second pass, and those of them that it left out.
struct SplatCounts {
    int tasks = 0;
    int hidden = 0;
    Sums sums = Sums::integers;  ///< how the compute pipeline added up
};

/// One way of getting splats into a picture. All calls with the context current. Two pictures may
/// be under way, in slots 0 and 1.
class SplatPipeline {
  public:
    virtual ~SplatPipeline() = default;
    /// Starts to draw a picture of frame.uniforms.frameSize and to bring it back. Errors: memory, a
    /// lost device.
    [[nodiscard]] virtual Result<void> draw(SplatFrame& frame, int slot) = 0;
    /// Waits for the picture of a slot; it can be read until unmap(). Errors: a lost device.
    [[nodiscard]] virtual Result<SplatPlanes> map(int slot) = 0;
    virtual void unmap(int slot) = 0;
    /// Margin of the targets around the frame, pixels, as planSplatFrame() wants it.
    [[nodiscard]] virtual int margin() const = 0;
    /// Longest side of what can be drawn at once, pixels.
    [[nodiscard]] virtual int largestPiece() const = 0;
    /// Of the picture drawn last; waits for it.
    [[nodiscard]] virtual SplatCounts counts() { return {}; }
};

/// Draws the tasks of a frame, those of one shape at once: draw(shape, first task, tasks).
template <class Draw>
[[nodiscard]] Result<void> drawRuns(const SplatFrame& frame, SplatRule rule, const Draw& draw) {
    const int large = frame.uniformTasks + frame.smallTasks;
    const int rest = static_cast<int>(frame.tasks.size()) - large;
    if (frame.uniformTasks > 0) STX_CHECK(draw(uniformShape(rule), 0, frame.uniformTasks));
    if (frame.smallTasks > 0)
        STX_CHECK(draw(SplatShape::small, frame.uniformTasks, frame.smallTasks));
    if (rest > 0) STX_CHECK(draw(SplatShape::ellipse, large, rest));
    return {};
}

/// Pipelines over a scene, which must outlive them. A note tells of atomics that the driver names
/// and does not compile. Errors: the driver's, about its shaders.
[[nodiscard]] Result<std::unique_ptr<SplatPipeline>> makeComputeSplats(const EglContext& context,
                                                                       const GpuScene& scene,
                                                                       const RenderSettings& s,
                                                                       Job& job);
[[nodiscard]] Result<std::unique_ptr<SplatPipeline>> makeRasterSplats(const EglContext& context,
                                                                      const GpuScene& scene,
                                                                      const RenderSettings& s,
                                                                      Job& job);

}  // namespace stx::gpu
