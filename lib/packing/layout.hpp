#pragma once

#include <vector>

#include "lib/packing/packing.hpp"

namespace stx {

/// Where everything goes, before pixels are moved.
struct AtlasLayout {
    int width = 0, height = 0;  ///< pixels of each page
    int pages = 1;
    std::vector<AtlasRectangle> rectangles;
};

/// Whole views in equal cells, see PackSettings::Layout::grid. `maxPages` >= 1.
[[nodiscard]] Result<AtlasLayout> gridLayout(const Bundle& bundle, const PackSettings& settings,
                                             int maxPages);

/// Content only, see PackSettings::Layout::tight. Views without content get no rectangle.
[[nodiscard]] Result<AtlasLayout> tightLayout(const Bundle& bundle, const PackSettings& settings,
                                              int maxPages);

}  // namespace stx
