#pragma once

#include <optional>
#include <vector>

#include "lib/model/view_table.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/rectangles.hpp"

namespace stx {

/// Where everything goes, before pixels are moved.
struct AtlasLayout {
    int width = 0, height = 0;  ///< pixels of each page
    int pages = 1;
    std::vector<AtlasRectangle> rectangles;
};

/// Points, and pixels of full alpha without a distance.
[[nodiscard]] std::int64_t objectPixels(const ReferenceView& view);

/// Whether pixels of full alpha without a distance are such as nobody took away: the view fills its
/// frame, its missing depth is unknown, and it is neither pruned nor background. `masked`: what
/// lacksDepthByMask() says, where that is known.
[[nodiscard]] bool mayBeUnmeasured(const ReferenceView& view, std::optional<bool> masked = {});

/// The least power of two that is not below, of 1 .. 2^30.
[[nodiscard]] int powerOfTwoFrom(int size);
/// The largest page that the settings allow.
[[nodiscard]] glm::ivec2 mostPage(const PackSettings& settings);
[[nodiscard]] RectangleLimits rectangleLimits(const PackSettings& settings, int maxPages);
/// packRectangles(), with what to change in its errors.
[[nodiscard]] Result<RectanglePacking> packForAtlas(const std::vector<glm::ivec2>& sizes,
                                                    const RectangleLimits& limits);

/// Whole views in equal cells, see PackSettings::Layout::grid. `maxPages` >= 1.
[[nodiscard]] Result<AtlasLayout> gridLayout(const Bundle& bundle, const PackSettings& settings,
                                             int maxPages);

/// Content only, see PackSettings::Layout::tight. Views without content get no rectangle. Errors:
/// also those of the views.
[[nodiscard]] Result<AtlasLayout> tightLayout(const ViewTable& table, const PackSettings& settings,
                                              int maxPages, Job& job);

}  // namespace stx
