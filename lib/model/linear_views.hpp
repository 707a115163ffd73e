#pragma once

#include "lib/model/reference_view.hpp"

namespace stx {

/// Colours of 8-bit sRGB become linear light, from which srgb8FromLinear() gives the same codes;
/// linear ones stay.
void makeLinear(ReferenceView& view);

}  // namespace stx
