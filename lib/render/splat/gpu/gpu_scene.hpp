#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/render/device/egl_context.hpp"
#include "lib/render/device/gl_object.hpp"
#include "lib/render/splat/view.hpp"

namespace stx::gpu {

/// A bundle in video memory: the reference views merged into at most four textures (Lee & Park,
/// section 3.1), each a grid of cells in an array of layers.
struct GpuScene {
    GlTexture colour;  ///< RGBA8 as coded, or RGBA16F of linear bundles
    GlTexture depth;   ///< R32F distances, infinity = no point
    GlTexture normal;  ///< RGBA8_SNORM, world; only when wanted
    GlTexture slope;   ///< RG16I tilts as splat::Slope, or RGBA16I with sizes

    bool linear = false;       ///< colours are linear light
    bool translucent = false;  ///< some point is not fully covered
    bool hasSizes = false;     ///< `slope` holds sizes
    float maxColour = 1.0f;    ///< of linear bundles
    /// Blocks and cameras; slopes, normals and sizes are in the textures and empty here.
    std::vector<splat::ViewInfo> views;
    std::vector<glm::ivec3> cells;  ///< per view: x, y, layer in the textures
    std::int64_t points = 0;
    std::int64_t textureBytes = 0;

    /// Uploads a bundle; the context must be current. Errors: a view larger than the device's
    /// textures, memory.
    [[nodiscard]] static Result<GpuScene> upload(const Bundle& bundle, const EglContext& context,
                                                 bool withNormals, Job& job);
};

}  // namespace stx::gpu
