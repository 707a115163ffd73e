#pragma once

#include <vector>

#include "lib/base/image.hpp"
#include "lib/model/reference_view.hpp"

namespace stx {

/// A rectangle of a view, pixels.
struct Patch {
    int x = 0, y = 0, width = 0, height = 0;

    bool operator==(const Patch&) const = default;
};

/// The rectangles that hold all content (points, and pixels with partial coverage) of a view: its
/// bounding box, cut from side to side again and again in the way that takes the least room on an
/// atlas, padding included. They do not overlap; none for an empty view. Pixels of full alpha
/// without a depth are not content: nothing is known of them but that the object is there.
[[nodiscard]] std::vector<Patch> contentPatches(const ReferenceView& view, int padding);

}  // namespace stx
