#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "lib/geometry/camera.hpp"
#include "lib/render/renderer.hpp"
#include "lib/render/splat/gpu/gpu_scene.hpp"

namespace stx::gpu {

/// FrameBlock of shaders/splat/splat_frame.glsl (std140).
struct FrameUniforms {
    glm::ivec4 frameSize{0};
    glm::ivec4 counts{0};
    glm::vec4 novelLens{0};
    glm::vec4 novelAxisX{0}, novelAxisY{0}, novelAxisZ{0}, novelPosition{0};
    glm::vec4 scales{0};
    glm::vec4 ambient{0}, specular{0};
};

/// View of shaders/splat/splat_frame.glsl (std430).
struct ViewEntry {
    glm::vec4 a0, au, av, b0, bu, bv;
};

/// Task of shaders/splat/splat_points.glsl (std430): a block to be drawn in this frame.
struct TaskEntry {
    std::uint32_t uv, count, atlasXY, viewLayer;
    float slopeX, slopeY, core2, tolerance, quality;
    float uAcross, vAcross, uDown, vDown;
    std::uint32_t tilesFrom, tilesTo;  ///< tiles of kCullTile pixels that it may touch
    float nearest;                     ///< splat::BlockTask::nearest
};

/// PhongLight of shaders/shared/phong.glsl (std430).
struct LightEntry {
    glm::vec4 vector, colour;
};

/// All that a frame needs beside the scene: computed on the CPU, uploaded once a frame.
struct SplatFrame {
    FrameUniforms uniforms;
    std::vector<ViewEntry> views;
    /// Blocks of small splats that share a tilt; then blocks of small ones; then all others.
    std::vector<TaskEntry> tasks;
    int uniformTasks = 0, smallTasks = 0;
    std::vector<LightEntry> lights;
};

/// Culls the blocks (outside, facing away), chooses their kernels as the CPU renderer does, and
/// works out the matrices. `margin` = pixels around the frame of the raster targets.
[[nodiscard]] SplatFrame planSplatFrame(const GpuScene& scene, const RenderSettings& settings,
                                        const Camera& novel, int margin);

}  // namespace stx::gpu
