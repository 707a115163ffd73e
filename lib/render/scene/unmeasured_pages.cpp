#include <algorithm>

#include "lib/refine/unmeasured.hpp"
#include "lib/render/scene/page_set.hpp"
#include "lib/render/scene/view_images.hpp"

namespace stx {

PageSet PageSet::withUnmeasured(const PageSet& captured, std::int64_t& pixels) const {
    pixels = 0;
    std::vector<bool> wanted;
    for (const PageView& v : captured.views()) wanted.push_back(mayHaveUnmeasured(v));
    if (std::ranges::find(wanted, true) == wanted.end()) return *this;
    std::vector<ReferenceView> copies(views().size());
    std::vector<RefineView> given;
    for (std::size_t i = 0; i < views().size(); ++i)
        given.push_back(viewImages(*this, i, copies[i]));
    UnmeasuredDepth found = unmeasuredDepth(given, wanted);
    pixels = found.placed + found.far;
    if (pixels == 0) return *this;
    auto data = std::make_shared<Data>(*data_);
    data->bounds = {};
    data->pruned = false;
    data->farAway = found.farAway;
    std::vector<std::shared_ptr<Image<float>>> depths(data->pages.size());
    std::vector<bool> kept;
    for (std::size_t i = 0; i < views().size(); ++i) {
        kept.push_back(!found.depth[i].empty());
        if (!kept[i]) continue;
        PageView& view = data->views[i];
        view.noDepth = NoDepth::unknown;
        view.pruned = false;
        view.depthBits = 32;
        view.refined = {};
        view.hasNormals = view.hasSplats = false;
        for (const PageRectangle& r : rectanglesOf(i)) {
            const auto page = static_cast<std::size_t>(r.page);
            auto& depth = depths[page];
            if (view.whole) {
                depth = std::make_shared<Image<float>>(std::move(found.depth[i]));
                break;
            }
            const Page& own = data_->pages[page];
            if (!depth) depth = std::make_shared<Image<float>>(own.width(), own.height(), kNoDepth);
            putOnPage(found.depth[i], found.depth[i], r, *depth);
        }
    }
    for (std::size_t i = 0; i < depths.size(); ++i) {
        if (!depths[i]) continue;
        depths[i]->moveTo(spool());
        data->pages[i] = {data->pages[i].texture, depths[i].get(), nullptr, nullptr, nullptr};
        data->refined.push_back(std::move(depths[i]));
    }
    PageSet layer = PageSet(std::move(data)).only(kept);
    return before(behind_ ? behind_->before(std::move(layer)) : std::move(layer));
}

}  // namespace stx
