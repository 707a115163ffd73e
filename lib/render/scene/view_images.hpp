#pragma once

#include "lib/refine/refine_depth.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// A view of a set as lib/refine takes it. Of one in rectangles `copy` keeps the images.
[[nodiscard]] RefineView viewImages(const PageSet& set, std::size_t number, ReferenceView& copy);

/// Puts the depth of a view where a rectangle of it is on a page, padding included.
void putDepth(const Image<float>& depth, const PageRectangle& r, Image<float>& page);

}  // namespace stx
