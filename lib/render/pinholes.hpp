#pragma once

#include "lib/render/frame.hpp"

namespace stx {

/// Closes single pixels that splats left open where a surface bends away between samples: pixels
/// without depth of whose eight neighbours at least seven have one get the mean of those at the
/// back. Slits and larger gaps stay open: they may be real. Deterministic on any number of threads.
void closePinholes(Frame& frame);

}  // namespace stx
