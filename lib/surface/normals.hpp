#pragma once

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

struct BakeSettings {
    enum class Method {
        paper,   ///< differences to the 4 neighbours (Lee & Park, section 3.2)
        robust,  ///< local plane fit that respects edges and the depth code's step
    };
    Method method = Method::robust;
    /// Neighbours whose distances differ by more than this share of the nearer one, beyond what the
    /// slope explains, lie across a depth discontinuity.
    double discontinuity = 0.01;
};

/// Adds normals (world, unit, towards the camera) and splat axes splatU, splatV (world, scene units,
/// half axes of an ellipse that just closes the gaps to the neighbouring samples) to each view of a
/// bundle: SimpleTexture becomes SimpleTextureV2. Points with no usable neighbour face the camera.
[[nodiscard]] Result<void> bake(Bundle& bundle, const BakeSettings& settings, Job& job);

/// Normal <-> RGB: n = 2 * c / max - 1 per component; (0,0,0) is "no normal".
[[nodiscard]] glm::u8vec3 rgbFromNormal(glm::vec3 normal);
[[nodiscard]] glm::vec3 normalFromRgb(glm::u8vec3 rgb);

}  // namespace stx
