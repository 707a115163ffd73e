#pragma once

#include <span>
#include <vector>

#include "formats/mpeg4/scene/scene.hpp"
#include "lib/model/reference_view.hpp"

/// PointTexture and PointTextureV2 (ISO/IEC 14496-16, 4.5.4): pixels from the lower left corner,
/// left to right and then up; for each a count and as many depth codes of depthNbBits+1 bits; one
/// colour (and normal, splatU, splatV) for each depth, in the same order.
namespace stx::mpeg4 {

/// The layers of a PointTexture: layer k holds the k-th depth of every pixel that has so many.
/// `view` gives camera (its size is set here), planes and name; layers after the first are named
/// name_1, ... Depths of 0 are not points. Colours are sRGB. A node without any depth gives one
/// empty layer. Errors: sizes, bits, counts or lists that do not fit each other.
[[nodiscard]] Result<std::vector<ReferenceView>> viewsFromPointTexture(const Node& node,
                                                                       const ReferenceView& view,
                                                                       const Limits& limits);

/// The same layers without their images. The lists are checked as far as their lengths go.
[[nodiscard]] Result<std::vector<ReferenceView>> headersFromPointTexture(const Node& node,
                                                                         const ReferenceView& view,
                                                                         const Limits& limits);

/// Whether a view can be layer `k` of one: all that is said of them is the same, but for its name,
/// which is the one that viewsFromPointTexture() gives. Points of a pixel move to the first layers,
/// so that nothing could be said of one layer alone.
[[nodiscard]] bool isLayerOf(const ReferenceView& view, const ReferenceView& first, std::size_t k);

/// A PointTexture (or V2, which has normals and splats in scene units) of layers that isLayerOf()
/// holds for; codes of `bits` (8 or 16) with the planes of `code`. Coverage has no place in it.
[[nodiscard]] NodePtr pointTextureFromViews(std::span<const ReferenceView* const> layers,
                                            const DepthCode& code, int bits, bool v2);

}  // namespace stx::mpeg4
