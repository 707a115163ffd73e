#pragma once

#include <memory>

#include "lib/render/renderer.hpp"

namespace stx::gpu {

/// How splats get into the frame.
enum class Pipeline {
    automatic,  ///< compute: it is the faster one on llvmpipe and on data-centre GPUs
    raster,  ///< the paper's: points drawn with vertex texture fetch, visibility pass, blended pass
    compute,  ///< atomic depth minimum, then weighted accumulation
};

/// Splat mode on a GPU (RenderMode::splat, every SplatRule). The bundle's images are uploaded and
/// not looked at again. Errors: unsupported (no device, with what was tried), a view larger than
/// the device's textures, memory.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeGpuSplatRenderer(
    const Bundle& bundle, const RenderSettings& settings, int device, Job& job,
    Pipeline pipeline = Pipeline::automatic);

}  // namespace stx::gpu
