#include <algorithm>

#include "lib/base/parallel.hpp"
#include "lib/model/translucent.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

/// How far full alpha reaches from points inside of glass, pixels: over its border.
constexpr int kReach = 4;

/// 1 for all pixels within kReach of those of 1, along both axes.
Image<std::uint8_t> widened(const Image<std::uint8_t>& from) {
    const int w = from.width(), h = from.height();
    Image<std::uint8_t> across(w, h, std::uint8_t{0}), out(w, h, std::uint8_t{0});
    const auto spread = [&](const Image<std::uint8_t>& in, Image<std::uint8_t>& to, int stepX,
                            int stepY) {
        parallelFor(0, h, [&](int y) {
            for (int x = 0; x < w; ++x) {
                std::uint8_t any = 0;
                for (int k = -kReach; k <= kReach; ++k) {
                    const int px = x + k * stepX, py = y + k * stepY;
                    if (px >= 0 && py >= 0 && px < w && py < h) any |= in.at(px, py);
                }
                to.at(x, y) = any;
            }
        });
    };
    spread(from, across, 1, 0);
    spread(across, out, 0, 1);
    return out;
}

}  // namespace

PageSet PageSet::solid(bool& changed) const {
    changed = false;
    std::shared_ptr<Data> data;
    for (std::size_t i = 0; i < data_->pages.size(); ++i) {
        const Page& page = data_->pages[i];
        if (page.depth->empty()) continue;
        settle();
        const auto inside = translucentInside(*page.texture, *page.depth);
        if (std::none_of(inside.pixels().begin(), inside.pixels().end(),
                         [](std::uint8_t v) { return v != 0; }))
            continue;
        if (!data) data = std::make_shared<Data>(*data_);
        const auto near = widened(inside);
        const auto opaque = [&](const Texture& from) {
            auto texture = std::make_shared<Texture>(from);
            for (std::size_t p = 0; p < near.count(); ++p) {
                if (near.data()[p] == 0 || !hasPoint(page.depth->data()[p])) continue;
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
