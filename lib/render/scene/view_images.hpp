#pragma once

#include "lib/refine/refine_depth.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// The images of a view as lib/refine takes them. A view in rectangles is copied to `copy`.
[[nodiscard]] RefineView viewImages(const PageSet& set, std::size_t number, ReferenceView& copy);

/// Puts the depth of a view where a rectangle of it is on a page, padding included.
void putDepth(const Image<float>& depth, const PageRectangle& r, Image<float>& page);

}  // namespace stx
