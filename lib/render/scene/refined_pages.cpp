#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <utility>

#include "lib/base/parallel.hpp"
#include "lib/refine/refine_depth.hpp"
#include "lib/render/scene/view_images.hpp"
#include "lib/surface/normals.hpp"

namespace stx {
namespace {

/// Normals and splat axes of pages, where they follow the depth of refined views.
class RenewedPages {
  public:
    explicit RenewedPages(const PageSet& set) : set_(set) {}

    /// Of a view with a header and a depth that are new.
    void renew(std::size_t number, const ViewHeader& header, const Image<float>& was,
               const Image<float>& depth) {
        if (!set_.views()[number].hasNormals && !set_.views()[number].hasSplats) return;
        set_.settle();
        ReferenceView view = set_.copyOfView(number);
        static_cast<ViewHeader&>(view) = header;
        view.texture = {};
        view.depth = depth;
        renewSurface(view, was);
        const std::array images = {&view.normal, &view.splatU, &view.splatV};
        for (std::size_t k = 0; k < images.size(); ++k) {
            if (images[k]->empty()) continue;
            for (const PageRectangle& r : set_.rectanglesOf(number))
                putOnPage(*images[k], depth, r, pageOf(r.page, k));
        }
    }

    void giveTo(std::vector<Page>& pages,
                std::vector<std::shared_ptr<const Image<glm::vec3>>>& keeps) {
        for (auto& [at, image] : images_) {
            pages[at.first].*kKinds[at.second] = image.get();
            keeps.push_back(std::move(image));
        }
    }

  private:
    static constexpr const Image<glm::vec3>* Page::*kKinds[] = {&Page::normal, &Page::splatU,
                                                                &Page::splatV};

    Image<glm::vec3>& pageOf(int page, std::size_t kind) {
        auto& image = images_[{page, kind}];
        if (!image) {
            image = std::make_shared<Image<glm::vec3>>(*(set_.pages()[page].*kKinds[kind]));
            image->moveTo(set_.spool());
        }
        return *image;
    }

    const PageSet& set_;
    std::map<std::pair<int, std::size_t>, std::shared_ptr<Image<glm::vec3>>> images_;
};

}  // namespace

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
    RenewedPages renewed(*this);
    for (std::size_t i = 0; i < better.size(); ++i) {
        found.record(better[i].refined);
        better[i].giveTo(data->views[i]);
        if (!better[i].depth) continue;
        renewed.renew(i, data->views[i], *given[i].depth, *better[i].depth);
        for (const PageRectangle& r : rectanglesOf(i)) {
            auto& depth = depths[r.page];
            const auto page = static_cast<std::size_t>(r.page);
            if (views()[i].whole) {
                depth = std::make_shared<Image<float>>(std::move(*better[i].depth));
                break;
            }
            if (!depth) depth = std::make_shared<Image<float>>(*data_->pages[page].depth);
            putOnPage(*better[i].depth, *better[i].depth, r, *depth);
        }
    }
    renewed.giveTo(data->pages, data->renewed);
    return withDepths(std::move(data), std::move(depths));
}

}  // namespace stx
