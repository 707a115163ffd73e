#pragma once

#include "formats/imagesets/set_view.hpp"

namespace stx::imagesets {

/// Distances from here on are those of nothing: Blender's is 1e10, others' infinity.
inline constexpr float kDistanceOfNothing = 1e9f;

/// Makes pixels without a point transparent, unless their distance may be unknown. Partly covered
/// pixels of the set's own alpha stay: they are the silhouette of points beside them.
void coverOnlyPoints(Texture& texture, Image<float>& depth, bool ownAlpha, bool mayBeUnknown);

/// What pixels without a distance are. Depth that holds the distance of nothing somewhere, which
/// becomes transparent, means something else by 0 and NaN. A picture that has alpha or a mask says
/// where nothing is: they are empty there, and where it is fully opaque without a distance
/// somewhere they are not known. Pixels of alpha below full are nothing either way.
[[nodiscard]] NoDepth noDepthOf(const SetView& set, const ImageSetOptions& options,
                                StoredView& stored);

/// Whether the picture has no pixel that is covered in full: nothing was in front of its camera, by
/// its alpha or by the depth of nothing that noDepthOf() found.
[[nodiscard]] bool openEverywhere(const StoredView& stored);

/// Distances that are floats in scene units: NaN, 0 and negative values (not known), infinity and
/// huge values (1e9 and more: nothing is there) are none.
void dropImpossible(Image<float>& distances);

}  // namespace stx::imagesets
