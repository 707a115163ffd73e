#include "lib/base/parallel.hpp"
#include "lib/packing/layout.hpp"
#include "lib/packing/patches.hpp"
#include "lib/packing/rectangles.hpp"

namespace stx {

Result<AtlasLayout> tightLayout(const Bundle& bundle, const PackSettings& settings, int maxPages) {
    std::vector<std::vector<Patch>> patches(bundle.views.size());
    parallelFor(0, static_cast<std::int64_t>(patches.size()), [&](std::int64_t i) {
        patches[i] = contentPatches(bundle.views[i], settings.padding);
    });
    AtlasLayout layout;
    std::vector<glm::ivec2> sizes;
    for (std::size_t i = 0; i < patches.size(); ++i) {
        for (const auto& p : patches[i]) {
            AtlasRectangle r;
            r.view = static_cast<int>(i);
            r.viewX = p.x;
            r.viewY = p.y;
            r.width = p.width;
            r.height = p.height;
            layout.rectangles.push_back(r);
            sizes.push_back(glm::ivec2(p.width, p.height) + 2 * settings.padding);
        }
    }
    RectangleLimits limits;
    limits.maxSize = settings.maxSize;
    limits.maxPages = maxPages;
    auto packing = packRectangles(sizes, limits);
    if (!packing) {
        packing.error().message +=
            "; use fewer or smaller views, prune them, or allow larger textures (--max-size)";
        return propagate(packing);
    }
    layout.width = packing->width;
    layout.height = packing->height;
    layout.pages = packing->pages;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const auto& place = packing->places[i];
        auto& r = layout.rectangles[i];
        r.page = place.page;
        r.atlasX = place.x + settings.padding;
        r.atlasY = place.y + settings.padding;
        r.turned = place.turned;
    }
    return layout;
}

}  // namespace stx
