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

}  // namespace

Result<AtlasLayout> gridLayout(const Bundle& bundle, const PackSettings& settings, int maxPages) {
    int width = 0, height = 0;
    for (const auto& view : bundle.views) {
        width = std::max(width, view.camera.width);
        height = std::max(height, view.camera.height);
    }
    const std::int64_t cellWidth = width + 2ll * settings.padding;
    const std::int64_t cellHeight = height + 2ll * settings.padding;
    const auto views = static_cast<std::int64_t>(bundle.views.size());
    const std::int64_t mostColumns = settings.maxSize / cellWidth;
    const std::int64_t mostRows = settings.maxSize / cellHeight;
    for (int pages = 1; pages <= maxPages; ++pages) {
        const std::int64_t perPage = ceilDiv(views, pages);
        if (perPage > mostColumns * mostRows) continue;
        // Square in views unless a side would be too long.
        std::int64_t columns = std::min(ceilSqrt(perPage), mostColumns);
        if (ceilDiv(perPage, columns) > mostRows) columns = ceilDiv(perPage, mostRows);
        const std::int64_t rows = ceilDiv(perPage, columns);
        AtlasLayout layout;
        layout.width = static_cast<int>(columns * cellWidth);
        layout.height = static_cast<int>(rows * cellHeight);
        layout.pages = static_cast<int>(ceilDiv(views, perPage));
        for (std::int64_t i = 0; i < views; ++i) {
            const auto& camera = bundle.views[i].camera;
            const std::int64_t cell = i % perPage;
            AtlasRectangle r;
            r.view = static_cast<int>(i);
            r.page = static_cast<int>(i / perPage);
            r.width = camera.width;
            r.height = camera.height;
            r.atlasX = static_cast<int>(cell % columns * cellWidth) + settings.padding;
            r.atlasY = static_cast<int>(cell / columns * cellHeight) + settings.padding;
            layout.rectangles.push_back(r);
        }
        return layout;
    }
    const std::int64_t columns = ceilSqrt(ceilDiv(views, maxPages));
    const std::int64_t rows = ceilDiv(ceilDiv(views, maxPages), columns);
    return fail(
        ErrorCode::invalidInput,
        "{} views of {}x{} with {} pixels of padding need {} of {}x{}, but textures are at most "
        "{}x{}; use the tight layout, fewer or smaller views, or larger textures (--max-size)",
        views, width, height, settings.padding,
        maxPages > 1 ? fmt::format("{} pages", maxPages) : "a grid", columns * cellWidth,
        rows * cellHeight, settings.maxSize, settings.maxSize);
}

}  // namespace stx
