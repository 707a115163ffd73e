#pragma once

#include <memory>

#include "lib/render/api/renderer.hpp"
#include "lib/render/device/egl_context.hpp"
#include "lib/render/scene/page_set.hpp"
#include "lib/render/splat/gpu/splat_pipeline.hpp"

namespace stx::gpu {

/// Which pipeline a device gets when nobody asks for one, and why.
struct PipelineChoice {
    GpuPipeline pipeline = GpuPipeline::raster;
    const char* reason = "";
};
[[nodiscard]] PipelineChoice choosePipeline(const Device& device,
                                            const ContextAbilities& abilities);

/// Splat mode on a GPU (RenderMode::splat, every SplatRule). The bundle's images are uploaded and
/// not looked at again. Errors: unsupported (no device, with what was tried; a pipeline that the
/// device cannot run), a view larger than the device's textures, memory.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeGpuSplatRenderer(const PageSet& set,
                                                                     const RenderSettings& settings,
                                                                     int device, Job& job);

/// Blocks of the frame drawn last, of a renderer that makeGpuSplatRenderer() made; zero of others.
[[nodiscard]] SplatCounts lastSplatCounts(Renderer& renderer);

}  // namespace stx::gpu
