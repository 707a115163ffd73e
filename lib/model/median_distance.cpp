#include "lib/model/median_distance.hpp"

#include <algorithm>
#include <iterator>
#include <span>
#include <vector>

#include "lib/base/median.hpp"

namespace stx {
namespace {

void addDistances(std::span<const float> row, std::vector<float>& distances) {
    std::ranges::copy_if(row, std::back_inserter(distances), hasPoint);
}

}  // namespace

double medianDistance(const ReferenceView& view) {
    std::vector<float> distances;
    addDistances(view.depth.pixels(), distances);
    return medianOf(std::move(distances));
}

double medianDistance(const Atlas& atlas, std::size_t view) {
    std::vector<float> distances;
    for (const AtlasRectangle& r : atlas.rectangles) {
        if (r.view != static_cast<int>(view)) continue;
        const Image<float>& depth = atlas.pages[r.page].depth;
        for (int y = r.atlasY; y < r.atlasY + r.atlasHeight(); ++y)
            addDistances(depth.row(y).subspan(static_cast<std::size_t>(r.atlasX),
                                              static_cast<std::size_t>(r.atlasWidth())),
                         distances);
    }
    return medianOf(std::move(distances));
}

}  // namespace stx
