#pragma once

#include "lib/render/api/frame.hpp"
#include "lib/render/outline/outlines.hpp"

namespace stx {

/// Gives pixels that are covered in part, where a surface turns away at the outline of the object,
/// the share that lies within the outermost points of all views: alpha, premultiplied colour and
/// albedo; what is left with no coverage gets empty. Each view sees such a surface end somewhere
/// else, so that together they draw it too large. Rims of sheets and creases, which all views see
/// end in the same place, stay as they are. The same on any number of threads.
void cutRoundOutlines(Outlines& outlines, const Camera& camera, Frame& frame);

/// Sets the coverage of a pixel, 0..1, as above.
void setCoverage(Frame& frame, int x, int y, float share);

}  // namespace stx
