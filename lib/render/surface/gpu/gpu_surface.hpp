#pragma once

#include <memory>

#include "lib/render/api/renderer.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx::gpu {

/// Surface mode on a GPU, every Quality: the sources are prepared by the processor once, uploaded,
/// and drawn, fused, checked and shaded in compute shaders; holes are filled and lights applied by
/// the processor, as makeCpuSurfaceRenderer() does. The bundle must outlive the renderer. Errors:
/// unsupported (no device, with what was tried; views that the device's textures cannot take),
/// memory.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeGpuSurfaceRenderer(
    const PageSet& set, const RenderSettings& settings, int device, Job& job);

}  // namespace stx::gpu
