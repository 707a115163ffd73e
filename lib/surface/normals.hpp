#pragma once

#include <cmath>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

struct BakeSettings {
    enum class Method {
        paper,   ///< differences to the 4 neighbours (Lee & Park, section 3.2)
        robust,  ///< respects creases, depth edges and the depth code's step: stairs are fitted
                 ///< away
    };
    Method method = Method::robust;
    /// Neighbours whose distances differ by more than this share of the nearer one, beyond what the
    /// slope explains, lie across a depth discontinuity. 0 < discontinuity <= 1.
    double discontinuity = 0.01;
    /// Leave normals that a view already has (captured from a mesh); splat axes are made in any
    /// case.
    bool keepNormals = false;
};

/// Adds normals (world, unit, towards the camera) and splat axes splatU, splatV (world, scene
/// units) to each view of a bundle: SimpleTexture becomes SimpleTextureV2. Points with no usable
/// neighbour face the camera.
///
/// The splat is the ellipse { P + u U + v V : u^2 + v^2 <= 1 } in the tangent plane: U and V follow
/// the image's x and y axes on the surface (conjugate half axes), each half a sample step times
/// sqrt(2), so that the ellipse passes through the corners of its pixel's footprint and just closes
/// the lattice. Where the surface is nearly edge-on they are held to kMaxSplatTilt times their
/// length on a surface that faces the camera.
///
/// Errors: a bundle that fails check(), settings out of range, cancelled, memory over the limit.
[[nodiscard]] Result<void> bake(Bundle& bundle, const BakeSettings& settings, Job& job);
/// Makes what a view has of normals and splat axes follow its depth where that is not `was` any
/// more: as bake() makes them of the view as it is now; zero, and
/// its material, too, where the point is gone. All else stays, to the bit: normals of a mesh are
/// better than those of depth.
void renewSurface(ReferenceView& view, const Image<float>& was);
/// The same of views one by one. `takes` is what the memory of a view must have room for: also what
/// is done with it then. Errors (usage): settings out of range.
[[nodiscard]] Result<ViewChange> bakeOfViews(const BakeSettings& settings,
                                             const PeakMemory& takes = peak::kBake);

/// See bake(): an axis six times as long is that of a surface tilted by about 80 degrees.
inline constexpr double kMaxSplatTilt = 6.0;

/// Normal <-> RGB: n = 2 * c / max - 1 per component, made unit again; (0,0,0) is "no normal".
[[nodiscard]] glm::u8vec3 rgbFromNormal(glm::vec3 normal);
[[nodiscard]] glm::vec3 normalFromRgb(glm::u8vec3 rgb);

/// How far from 1 the length of a normal may be (rule 6007 of the validator). In 8 bits it is off
/// by up to 0.007: half a code on each axis.
inline constexpr double kNormalLengthSlack = 0.05;
/// False of NaN, too.
inline bool hasNormalLength(glm::dvec3 normal) {
    return std::abs(glm::length(normal) - 1.0) <= kNormalLengthSlack;
}

}  // namespace stx
