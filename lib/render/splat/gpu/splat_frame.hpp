#pragma once

#include <cstddef>
#include <vector>

#include <glm/glm.hpp>

#include "lib/geometry/camera.hpp"
#include "lib/render/api/renderer.hpp"
#include "lib/render/splat/gpu/gpu_scene.hpp"
#include "shaders/shared/language.hpp"

namespace stx::gpu {

/// The structs of splat mode's buffers, one definition for C++ and the shaders.
namespace buffers {
using namespace glsl;
#include "shaders/shared/splat_structs.glsl"
}  // namespace buffers
using buffers::FrameUniforms;
using buffers::LightEntry;
using buffers::TaskEntry;
using buffers::ViewEntry;

// As std140 and std430 lay them out, and as texture buffers of four numbers take them.
static_assert(sizeof(FrameUniforms) == 10 * 16 && offsetof(FrameUniforms, specular) == 9 * 16);
static_assert(sizeof(ViewEntry) == 6 * 16 && sizeof(LightEntry) == 2 * 16);
static_assert(offsetof(TaskEntry, slopeX) == 16 && offsetof(TaskEntry, quality) == 32 &&
              offsetof(TaskEntry, vDown) == 48 && sizeof(TaskEntry) == 64);

/// All that a frame needs beside the scene: computed on the CPU, uploaded once a frame.
struct SplatFrame {
    FrameUniforms uniforms{};
    std::vector<ViewEntry> views;
    /// Blocks of small splats that share a tilt; then blocks of small ones; then all others.
    std::vector<TaskEntry> tasks;
    int uniformTasks = 0, smallTasks = 0;
    std::vector<LightEntry> lights;
};

/// Culls the blocks (outside, facing away), chooses their kernels as the CPU renderer does, and
/// works out the matrices. `lights`: the pose that lights move with; `largest`: how far splats
/// reach at most, pixels (splat::largestSplat()); `margin` = pixels around the frame of the raster
/// targets.
[[nodiscard]] SplatFrame planSplatFrame(const GpuScene& scene, const RenderSettings& settings,
                                        const Camera& novel, const Camera& lights, float largest,
                                        int margin);

}  // namespace stx::gpu
