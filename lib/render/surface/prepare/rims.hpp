#pragma once

#include "lib/render/surface/prepare/draft.hpp"

namespace stx::surface {

/// Finds the pixels of a source at edges inside of the object whose whole square belongs to their
/// surface (SourceBlock::rims): they do not have the colour of what is behind in part. Where
/// colours are too alike to tell, all do. Where the source's links and edges are known.
void findRims(Source& source, const Draft& draft);

}  // namespace stx::surface
