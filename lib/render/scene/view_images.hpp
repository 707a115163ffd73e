#pragma once

#include <algorithm>

#include "lib/refine/refine_depth.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// The images of a view as lib/refine takes them. A view in rectangles is copied to `copy`.
[[nodiscard]] RefineView viewImages(const PageSet& set, std::size_t number, ReferenceView& copy);

/// Puts an image of a view, which has this depth, where a rectangle of it is on a page, padding
/// included.
template <class T>
void putOnPage(const Image<T>& image, const Image<float>& depth, const PageRectangle& r,
               Image<T>& page) {
    const int x0 = std::max(r.x0 - PageSet::kPadding, 0),
              x1 = std::min(r.x1 + PageSet::kPadding, depth.width());
    const int y0 = std::max(r.y0 - PageSet::kPadding, 0),
              y1 = std::min(r.y1 + PageSet::kPadding, depth.height());
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) {
            const bool inside = x >= r.x0 && y >= r.y0 && x < r.x1 && y < r.y1;
            // Padding may repeat pixels that no rectangle shows.
            if (inside || hasPoint(depth.at(x, y))) page.data()[r.texel(x, y)] = image.at(x, y);
        }
}

}  // namespace stx
