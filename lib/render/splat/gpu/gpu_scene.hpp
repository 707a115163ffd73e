#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/render/device/egl_context.hpp"
#include "lib/render/device/gl_object.hpp"
#include "lib/render/splat/prepared.hpp"

namespace stx::gpu {

/// A PageSet in video memory: at most four textures (Lee & Park, section 3.1), each an array of
/// layers. The pages of an atlas are layers as they are; those of a bundle, one a view, are merged
/// into a grid of cells.
struct GpuScene {
    GlTexture colour;  ///< RGBA8 as coded, or RGBA16F of linear bundles
    GlTexture depth;   ///< R32F distances, infinity = no point
    GlTexture normal;  ///< RGBA8_SNORM, world; only when wanted
    GlTexture slope;   ///< RG16I tilts as splat::Slope, or RGBA16I with sizes

    bool linear = false;       ///< colours are linear light
    bool translucent = false;  ///< some point is not fully covered
    bool hasSizes = false;     ///< `slope` holds sizes
    float maxColour = 1.0f;    ///< of linear bundles
    std::vector<splat::PreparedRectangle> rectangles;
    std::vector<glm::ivec3> places;  ///< per rectangle: x, y, layer of its first texel
    double radius = 0;               ///< as in PreparedPages
    std::int64_t points = 0;
    std::int64_t textureBytes = 0;

    /// Uploads the pages, which must outlive this; the context must be current. `leaveOut`: finds
    /// out which parts of blocks other views show, too (splat::findOthers()). Errors: a page larger
    /// than the device's textures, memory.
    [[nodiscard]] static Result<GpuScene> upload(const PageSet& set, const EglContext& context,
                                                 bool withNormals, bool leaveOut, Job& job);
};

}  // namespace stx::gpu
