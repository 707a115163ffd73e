#include "formats/viewer/coarse_views.hpp"

#include <algorithm>

#include "lib/render/scene/coarse_pages.hpp"

namespace stx {

bool mayHaveCoarse(std::span<const ReferenceView> views) {
    return std::ranges::any_of(views, [&](const ReferenceView& coarse) {
        return std::ranges::any_of(views, [&](const ReferenceView& fine) {
            return fine.background == coarse.background && isClearlyFiner(fine, coarse);
        });
    });
}

void takeCoarseAway(Bundle& bundle) {
    // All are found before any is taken: what is coarse may be finer than a third.
    std::vector<Image<std::uint8_t>> coarse;
    const PageSet set(bundle);
    for (std::size_t i = 0; i < bundle.views.size(); ++i) coarse.push_back(coarsePoints(set, i));
    std::vector<ReferenceView> left;
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        ReferenceView& view = bundle.views[i];
        if (!coarse[i].empty()) {
            for (std::size_t p = 0; p < coarse[i].count(); ++p)
                if (coarse[i].data()[p]) view.depth.data()[p] = kNoDepth;
            if (view.pointCount() == 0) continue;
        }
        left.push_back(std::move(view));
    }
    bundle.views = std::move(left);
}

}  // namespace stx
