#pragma once

#include "lib/render/api/extent.hpp"
#include "lib/render/api/frame.hpp"

namespace stx {

/// Closes single pixels that splats left open where a surface bends away between samples: pixels
/// without depth of whose eight neighbours at least seven have one get the mean of those at the
/// back, and so do single faint pixels among eight that are covered in full, which show a point of
/// a rim that belongs to nothing beside it. Slits and larger gaps stay open: they may be real.
/// Deterministic on any number of threads.
///
/// `pruned`: the views were pruned. Then each piece of surface has the samples of one view only,
/// which leave open slits a pixel or two wide where the others would have helped out: those close,
/// too (five neighbours are enough, twice). Where that fills the corner of a silhouette,
/// Silhouettes takes it away again. All that was drawn lies in `drawn`.
void closePinholes(Frame& frame, bool pruned, const Extent& drawn = {});

}  // namespace stx
