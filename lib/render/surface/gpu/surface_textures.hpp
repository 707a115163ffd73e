#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/render/device/egl_context.hpp"
#include "lib/render/device/gl_object.hpp"
#include "lib/render/surface/source.hpp"

namespace stx::gpu {

/// What each pixel of a source is to the shaders: see shaders/shared/surface_cells.glsl.
[[nodiscard]] Image<std::uint32_t> cellCodes(const surface::Source& source);

/// Prepared sources in video memory: one layer of each texture a source.
struct GpuSurfaceScene {
    GlTexture surfaces;                    ///< RGBA32UI: bits of q, dq/dx, dq/dy; cell code
    GlTexture colours;                     ///< RGBA8 as coded, or RGBA32F of linear bundles
    GlBuffer leaves;                       ///< std430: bits of q0, qx, qy; x | y << 16
    std::vector<std::uint32_t> firstLeaf;  ///< of each source in `leaves`

    /// Uploads; the context must be current. Errors: views larger or more than the device's
    /// textures take, memory.
    [[nodiscard]] static Result<GpuSurfaceScene> upload(std::span<const surface::Source> sources,
                                                        const EglContext& context, Job& job);
};

}  // namespace stx::gpu
