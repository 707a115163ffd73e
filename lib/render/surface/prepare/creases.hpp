#pragma once

#include "lib/render/surface/prepare/draft.hpp"

namespace stx::surface {

/// Marks the pixels of a source that a crease runs through (Info::kCrease): two faces have a part
/// in their colour, as at edges, but depth goes on. Where the source's links, noise and depth code
/// are known.
void findCreases(const Source& source, Draft& draft);

}  // namespace stx::surface
