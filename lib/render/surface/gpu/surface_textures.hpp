#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/render/device/egl_context.hpp"
#include "lib/render/device/gl_object.hpp"
#include "lib/render/surface/prepare/source.hpp"

namespace stx::gpu {

/// What each pixel of a source is to the shaders: see shaders/shared/surface_cells.glsl.
[[nodiscard]] Image<std::uint32_t> cellCodes(const surface::Source& source);

/// Where the rectangles of sources are on the pages, as shaders/surface/surface_common.glsl looks
/// them up.
struct PlaceTable {
    /// Of each source from `SourceEntry::place` on: for each of its blocks, and after the last, the
    /// index of its list of rectangles. A list holds indices of rectangles: first and last pixel in
    /// the source, padding included, the latter one past (x0, y0, x1, y1), texel of pixel (0, 0)
    /// (x, y), layer, 1 = turned. Then a bit for each pixel that is outside of all rectangles where
    /// the object is.
    std::vector<std::uint32_t> words;
    std::vector<glm::ivec4> places;  ///< SourceEntry::place of each source

    explicit PlaceTable(const surface::SurfaceScene& scene);
};

/// A prepared scene in video memory: one layer of each texture a page.
struct GpuSurfaceScene {
    GlTexture surfaces;                    ///< RGBA32UI: bits of q, dq/dx, dq/dy; cell code
    GlTexture colours;                     ///< RGBA8 as coded, or RGBA32F of linear bundles
    GlBuffer leaves;                       ///< std430: bits of q0, qx, qy; x | y << 16
    std::vector<std::uint32_t> firstLeaf;  ///< of each source in `leaves`
    GlBuffer table;                        ///< std430: PlaceTable::words
    std::vector<glm::ivec4> places;        ///< see PlaceTable

    /// Uploads; the context must be current. Errors: pages larger or more than the device's
    /// textures take, memory.
    [[nodiscard]] static Result<GpuSurfaceScene> upload(const surface::SurfaceScene& from,
                                                        const EglContext& context, Job& job);
};

}  // namespace stx::gpu
