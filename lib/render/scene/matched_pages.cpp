#include "lib/base/cpu_clock.hpp"
#include "lib/refine/exposure.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

PageSet PageSet::inOneLight(const RefineSettings& settings, RefineStepReport& report) const {
    RefineSettings left = settings;
    for (const PageView& view : views()) left = left.after(view.refined);
    if (!left.on(RefineStep::exposure) || views().size() < 2) return *this;
    const double start = processMilliseconds();
    std::vector<Camera> cameras;
    for (const PageView& view : views()) cameras.push_back(view.camera);
    const auto maps = exposureMaps(cameras, [this](std::size_t v, int x0, int y0, int x1, int y1) {
        const PageRectangle* r = find(v, x0, y0, x1, y1);
        if (!r) return PixelPart();
        const Page& page = pages()[r->page];
        return PixelPart{page.texture, page.depth, r->first, r->stepX, r->stepY};
    });
    std::vector<std::shared_ptr<Texture>> textures(data_->pages.size());
    for (std::size_t i = 0; i < maps.size(); ++i) {
        if (maps[i].changesNothing()) continue;
        ++report.views;
        for (const PageRectangle& r : rectanglesOf(i)) {
            const auto page = static_cast<std::size_t>(r.page);
            auto& texture = textures[page];
            if (!texture) texture = std::make_shared<Texture>(*data_->pages[page].texture);
            applyMap(maps[i], r.pageX - r.left, r.pageY - r.top, r.pageX + r.width + r.right,
                     r.pageY + r.height + r.bottom, *texture, report);
        }
    }
    report.milliseconds += processMilliseconds() - start;
    if (report.views == 0) return *this;
    auto data = std::make_shared<Data>(*data_);
    data->captured.clear();
    for (std::size_t i = 0; i < textures.size(); ++i) {
        data->captured.push_back(&captured(i));
        if (!textures[i]) continue;
        textures[i]->moveTo(spool());
        data->pages[i].texture = textures[i].get();
        data->changed.push_back(std::move(textures[i]));
    }
    PageSet set(std::move(data));
    set.behind_ = behind_;
    return set;
}

}  // namespace stx
