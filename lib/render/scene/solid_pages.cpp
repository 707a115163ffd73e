#include "lib/model/translucent.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

PageSet PageSet::solid(bool& changed) const {
    changed = false;
    std::shared_ptr<Data> data;
    for (std::size_t i = 0; i < data_->pages.size(); ++i) {
        const Page& page = data_->pages[i];
        if (page.depth->empty()) continue;
        settle();
        const auto solid = translucentSurfaces(*page.texture, *page.depth);
        if (solid.empty()) continue;
        if (!data) data = std::make_shared<Data>(*data_);
        const auto opaque = [&](const Texture& from) {
            auto texture = std::make_shared<Texture>(from);
            for (std::size_t p = 0; p < solid.count(); ++p) {
                if (solid.data()[p] == 0) continue;
                if (auto* image = texture->rgba8()) image->data()[p].w = 255;
                if (auto* image = texture->rgbaFloat()) image->data()[p].w = 1.0f;
            }
            texture->moveTo(spool());
            data->changed.push_back(texture);
            return texture.get();
        };
        data->pages[i].texture = opaque(*page.texture);
        // What was matched to others is opaque in its own colours, too.
        if (!data->captured.empty())
            data->captured[i] = data_->captured[i] == page.texture ? data->pages[i].texture
                                                                   : opaque(*data_->captured[i]);
    }
    if (!data) return *this;
    changed = true;
    PageSet set(std::move(data));
    set.behind_ = behind_;
    return set;
}

}  // namespace stx
