#include <algorithm>
#include <atomic>

#include "lib/base/parallel.hpp"
#include "lib/refine/refine_depth.hpp"
#include "lib/render/scene/view_images.hpp"

namespace stx {

RefineView viewImages(const PageSet& set, std::size_t number, ReferenceView& copy) {
    const PageView& view = set.views()[number];
    if (view.whole) {
        const Page& page = set.pages()[set.rectanglesOf(number)[0].page];
        return {&view, page.texture, page.depth};
    }
    copy.texture = set.textureOfView(number);
    copy.depth = Image<float>(view.camera.width, view.camera.height, kNoDepth);
    for (const PageRectangle& r : set.rectanglesOf(number)) {
        const float* depth = set.pages()[r.page].depth->data();
        for (int y = r.y0; y < r.y1; ++y)
            for (int x = r.x0; x < r.x1; ++x) copy.depth.at(x, y) = depth[r.texel(x, y)];
    }
    return {&view, &copy.texture, &copy.depth};
}

void putDepth(const Image<float>& depth, const PageRectangle& r, Image<float>& page) {
    const int x0 = std::max(r.x0 - PageSet::kPadding, 0),
              x1 = std::min(r.x1 + PageSet::kPadding, depth.width());
    const int y0 = std::max(r.y0 - PageSet::kPadding, 0),
              y1 = std::min(r.y1 + PageSet::kPadding, depth.height());
    for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) {
            const bool inside = x >= r.x0 && y >= r.y0 && x < r.x1 && y < r.y1;
            // Padding may repeat pixels that no rectangle shows.
            if (inside || hasPoint(depth.at(x, y))) page.data()[r.texel(x, y)] = depth.at(x, y);
        }
}

bool PageSet::mayRefine(const RefineSettings& settings) const {
    RefineSettings left = settings;
    for (const PageView& view : views()) left = left.after(view.refined);
    if (!left.any()) return false;
    std::vector<RefineNeeds> ofViews(views().size(), RefineNeeds(left));
    std::atomic<bool> enough = false;  // some view tells for all
    const auto look = [&](std::size_t i) {
        if (enough) return;
        settle();
        ReferenceView copy;
        ofViews[i].add(viewImages(*this, i, copy));
        if (ofViews[i].surely()) enough = true;
    };
    // Views in rectangles are copied; one at a time, since a copy takes the memory of a whole view.
    if (views().front().whole)
        parallelFor(0, ofViews.size(), [&](std::size_t i) { look(i); });
    else
        for (std::size_t i = 0; i < ofViews.size(); ++i) look(i);
    RefineNeeds needs(left);
    for (const RefineNeeds& found : ofViews) needs.add(found);
    return needs.any();
}

PageSet PageSet::withDepths(std::shared_ptr<Data> data,
                            std::vector<std::shared_ptr<Image<float>>> depths) const {
    for (std::size_t i = 0; i < depths.size(); ++i) {
        if (!depths[i]) continue;
        depths[i]->moveTo(spool());
        data->pages[i].depth = depths[i].get();
        data->refined.push_back(std::move(depths[i]));
    }
    PageSet set(std::move(data));
    set.behind_ = behind_;
    return set;
}

PageSet PageSet::refined(const RefineSettings& settings, RefineReport* report,
                         std::int64_t atOnce) const {
    RefineReport own;
    RefineReport& found = report ? *report : own;
    found = {};
    RefineSettings left = settings;
    for (const PageView& view : views()) left = left.after(view.refined);
    if (!left.any() || views().empty()) return *this;
    const bool whole =
        std::all_of(views().begin(), views().end(), [](const PageView& v) { return v.whole; });
    if (!whole && !mayRefine(left)) return *this;
    std::vector<ReferenceView> copies(views().size());
    std::vector<RefineView> given(views().size());
    parallelFor(0, given.size(), [&](std::size_t number) {
        given[number] = viewImages(*this, number, copies[number]);
    });
    auto better = refineDepth(given, left, found, {spool(), atOnce});
    if (!found.changed()) return *this;
    auto data = std::make_shared<Data>(*data_);
    std::vector<std::shared_ptr<Image<float>>> depths(data->pages.size());
    for (std::size_t i = 0; i < better.size(); ++i) {
        found.record(better[i].refined);
        better[i].giveTo(data->views[i]);
        if (!better[i].depth) continue;
        for (const PageRectangle& r : rectanglesOf(i)) {
            auto& depth = depths[r.page];
            const auto page = static_cast<std::size_t>(r.page);
            if (views()[i].whole) {
                depth = std::make_shared<Image<float>>(std::move(*better[i].depth));
                break;
            }
            if (!depth) depth = std::make_shared<Image<float>>(*data_->pages[page].depth);
            putDepth(*better[i].depth, r, *depth);
        }
    }
    return withDepths(std::move(data), std::move(depths));
}

}  // namespace stx
