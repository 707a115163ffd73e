#include "lib/packing/layout.hpp"

#include <algorithm>

namespace stx {
namespace {

std::int64_t ceilDiv(std::int64_t a, std::int64_t b) {
    return (a + b - 1) / b;
}

/// The least whole number whose square is at least n, so that N x N views get N columns.
std::int64_t ceilSqrt(std::int64_t n) {
    std::int64_t root = 1;
    while (root * root < n) ++root;
    return root;
}

/// Views in equal cells.
struct CellGrid {
    glm::i64vec2 cell{0};  ///< pixels, padding included
    std::int64_t columns = 1;

    /// Of views first .. first + count - 1.
    CellGrid(const Bundle& bundle, int padding, std::int64_t first, std::int64_t count) {
        for (std::int64_t i = first; i < first + count; ++i) {
            const auto& camera = bundle.views[i].camera;
            cell = glm::max(cell, glm::i64vec2(camera.width, camera.height));
        }
        cell += 2 * padding;
    }
    /// Chooses the columns for so many views on a page of at most this size: square in views,
    /// unless a side would be too long. False: they are too many.
    bool fit(std::int64_t views, glm::ivec2 most) {
        const auto cells = glm::i64vec2(most) / cell;
        if (views > cells.x * cells.y) return false;
        columns = std::min(ceilSqrt(views), cells.x);
        if (ceilDiv(views, columns) > cells.y) columns = ceilDiv(views, cells.y);
        return true;
    }
    [[nodiscard]] glm::i64vec2 sizeOf(std::int64_t views) const {
        return glm::i64vec2(columns, ceilDiv(views, columns)) * cell;
    }
    /// The rectangle of view `number` of a grid that begins at `corner` of a page.
    [[nodiscard]] AtlasRectangle place(const Camera& camera, std::int64_t number, glm::ivec2 corner,
                                       int padding) const {
        AtlasRectangle r;
        r.width = camera.width;
        r.height = camera.height;
        r.atlasX = corner.x + static_cast<int>(number % columns * cell.x) + padding;
        r.atlasY = corner.y + static_cast<int>(number / columns * cell.y) + padding;
        return r;
    }
};

/// The smallest page of sides 2^N that holds so many views, of equal ones the squarest and then the
/// wider, and the columns for it. They must fit on `most`, which has such sides.
glm::ivec2 powerOfTwoPage(std::int64_t views, glm::ivec2 most, CellGrid& grid) {
    for (int bits = 0;; ++bits) {
        for (int more = bits % 2; more <= bits; more += 2) {
            const std::int64_t longer = std::int64_t{1} << (bits + more) / 2,
                               shorter = std::int64_t{1} << (bits - more) / 2;
            for (const glm::i64vec2 size :
                 {glm::i64vec2(longer, shorter), glm::i64vec2(shorter, longer)}) {
                if (size.x > most.x || size.y > most.y) continue;
                if (grid.fit(views, size)) return size;
            }
        }
    }
}

/// A grid for each object, each on one page.
Result<AtlasLayout> gridsLayout(const Bundle& bundle, const PackSettings& settings, int maxPages) {
    constexpr std::int64_t kMostSide = 65535;
    std::vector<CellGrid> grids;
    std::vector<glm::ivec2> sizes;
    for (const AtlasObject& o : *settings.objects) {
        CellGrid& grid = grids.emplace_back(bundle, settings.padding, o.firstView, o.views);
        if (!grid.fit(o.views, mostPage(settings))) grid.columns = ceilSqrt(o.views);
        sizes.emplace_back(glm::min(grid.sizeOf(o.views), glm::i64vec2(kMostSide + 1)));
    }
    RectangleLimits limits = rectangleLimits(settings, maxPages);
    limits.mayTurn = false;
    STX_TRY(const auto packing, packForAtlas(sizes, limits));
    AtlasLayout layout{packing.width, packing.height, packing.pages, {}};
    for (std::size_t o = 0; o < grids.size(); ++o) {
        const auto& place = packing.places[o];
        for (int i = 0; i < (*settings.objects)[o].views; ++i) {
            const auto view = layout.rectangles.size();
            AtlasRectangle r =
                grids[o].place(bundle.views[view].camera, i, {place.x, place.y}, settings.padding);
            r.view = static_cast<int>(view);
            r.page = place.page;
            layout.rectangles.push_back(r);
        }
    }
    return layout;
}

}  // namespace

Result<AtlasLayout> gridLayout(const Bundle& bundle, const PackSettings& settings, int maxPages) {
    if (settings.objects) return gridsLayout(bundle, settings, maxPages);
    const auto views = static_cast<std::int64_t>(bundle.views.size());
    const glm::ivec2 most = mostPage(settings);
    const bool exact = settings.size.x > 0;
    CellGrid grid(bundle, settings.padding, 0, views);
    for (int pages = 1; pages <= maxPages; ++pages) {
        const std::int64_t perPage = ceilDiv(views, pages);
        if (!grid.fit(perPage, most)) continue;
        const glm::ivec2 size = exact                 ? settings.size
                                : settings.powerOfTwo ? powerOfTwoPage(perPage, most, grid)
                                                      : glm::ivec2(grid.sizeOf(perPage));
        AtlasLayout layout;
        layout.width = size.x;
        layout.height = size.y;
        layout.pages = static_cast<int>(ceilDiv(views, perPage));
        for (std::int64_t i = 0; i < views; ++i) {
            AtlasRectangle r =
                grid.place(bundle.views[i].camera, i % perPage, {0, 0}, settings.padding);
            r.view = static_cast<int>(i);
            r.page = static_cast<int>(i / perPage);
            layout.rectangles.push_back(r);
        }
        return layout;
    }
    const std::int64_t perPage = ceilDiv(views, maxPages);
    grid.columns = ceilSqrt(perPage);
    const auto needed = grid.sizeOf(perPage);
    return fail(
        ErrorCode::invalidInput,
        "{} views of {}x{} with {} pixels of padding need {} of {}x{}, but textures are {}{}x{}; "
        "use the tight layout, fewer or smaller views, or larger textures ({})",
        views, grid.cell.x - 2 * settings.padding, grid.cell.y - 2 * settings.padding,
        settings.padding, maxPages > 1 ? fmt::format("{} pages", maxPages) : "a grid", needed.x,
        needed.y, exact ? "" : "at most ", most.x, most.y, exact ? "--size" : "--max-size");
}

}  // namespace stx
