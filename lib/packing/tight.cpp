#include <algorithm>
#include <bit>

#include "lib/base/parallel.hpp"
#include "lib/packing/layout.hpp"
#include "lib/packing/patches.hpp"
#include "lib/packing/rectangles.hpp"

namespace stx {

int powerOfTwoFrom(int size) {
    return static_cast<int>(std::bit_ceil(static_cast<unsigned>(size)));
}

glm::ivec2 mostPage(const PackSettings& settings) {
    if (settings.size.x > 0) return settings.size;
    const auto side = [&](int most) {
        const int size = most > 0 ? std::min(most, settings.maxSize) : settings.maxSize;
        return settings.powerOfTwo ? static_cast<int>(std::bit_floor(static_cast<unsigned>(size)))
                                   : size;
    };
    return {side(settings.maxPage.x), side(settings.maxPage.y)};
}

RectangleLimits rectangleLimits(const PackSettings& settings, int maxPages) {
    RectangleLimits limits;
    limits.maxSize = settings.maxSize;
    limits.size = settings.size;
    limits.maxPage = settings.maxPage;
    limits.powerOfTwo = settings.powerOfTwo;
    limits.maxPages = maxPages;
    return limits;
}

Result<RectanglePacking> packForAtlas(const std::vector<glm::ivec2>& sizes,
                                      const RectangleLimits& limits) {
    auto packing = packRectangles(sizes, limits);
    if (packing) return packing;
    packing.error().message +=
        fmt::format("; use fewer or smaller views, prune them, or allow larger textures ({})",
                    limits.size.x > 0 ? "--size" : "--max-size");
    return packing;
}

Result<AtlasLayout> tightLayout(const ViewTable& table, const PackSettings& settings, int maxPages,
                                Job& job) {
    std::vector<std::vector<Patch>> patches(table.count());
    STX_CHECK(forEachView(
        table, {"an atlas", 0}, job,
        [&](std::size_t i, const std::shared_ptr<const ReferenceView>& view) -> Result<void> {
            patches[i] = contentPatches(*view, settings.padding);
            return {};
        }));
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
    STX_TRY(const auto packing, packForAtlas(sizes, rectangleLimits(settings, maxPages)));
    layout.width = packing.width;
    layout.height = packing.height;
    layout.pages = packing.pages;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const auto& place = packing.places[i];
        auto& r = layout.rectangles[i];
        r.page = place.page;
        r.atlasX = place.x + settings.padding;
        r.atlasY = place.y + settings.padding;
        r.turned = place.turned;
    }
    return layout;
}

}  // namespace stx
