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

/// What a pixel is to the shaders, in 32 bits: how the cell to its lower right is drawn, and what
/// the pixel itself is.
struct CellCode {
    /// Bits 0..3.
    enum Shape : std::uint32_t {
        nothing = 0,
        leaf = 1,          ///< part of a planar piece
        quad = 2,          ///< flat enough for one piece
        fallingSplit = 3,  ///< two triangles along the diagonal from the upper left
        risingSplit = 4,
        upperLeft = 5,  ///< one triangle around this corner
        upperRight = 6,
        lowerRight = 7,
        lowerLeft = 8,
    };
    static constexpr std::uint32_t kNearEdge = 1u << 4;  ///< the cell is
    static constexpr std::uint32_t kEdge = 1u << 5;      ///< the pixel lays out an extension
    static constexpr std::uint32_t kBesideBackground = 1u << 6;
    static constexpr int kDistanceShift = 8;  ///< distance to the nearest edge
    static constexpr int kLeafShift = 16;     ///< the leaf's number in its block
};

/// The codes of all pixels of a source.
[[nodiscard]] Image<std::uint32_t> cellCodes(const surface::Source& source);

/// Prepared sources in video memory: one layer of each texture a source.
struct GpuSurfaceScene {
    GlTexture surfaces;                    ///< RGBA32UI: bits of q, dq/dx, dq/dy; CellCode
    GlTexture colours;                     ///< RGBA8 as coded, or RGBA32F of linear bundles
    GlBuffer leaves;                       ///< std430: bits of q0, qx, qy; x | y << 16
    std::vector<std::uint32_t> firstLeaf;  ///< of each source in `leaves`

    /// Uploads; the context must be current. Errors: views larger or more than the device's
    /// textures take, memory.
    [[nodiscard]] static Result<GpuSurfaceScene> upload(std::span<const surface::Source> sources,
                                                        const EglContext& context, Job& job);
};

}  // namespace stx::gpu
