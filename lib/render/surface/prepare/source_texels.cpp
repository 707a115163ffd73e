#include <algorithm>

#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {

Place Source::placeAmongRectangles(int x, int y) const {
    const int x0 = std::max(x, 0), y0 = std::max(y, 0);
    const int x1 = std::min(x + 1, width - 1), y1 = std::min(y + 1, height - 1);
    // Better one that shows a pixel more around, so that gradients can be read where there are
    // points; in the padding beyond there are none.
    const int left = std::max(x0 - 1, 0), right = std::min(x1 + 1, width - 1);
    const int above = std::max(y0 - 1, 0), below = std::min(y1 + 1, height - 1);
    const PageRectangle* found = nullptr;
    for (const std::uint32_t candidate : set->near(number, x0, y0)) {
        const PageRectangle& r = set->rectangles()[candidate];
        if (set->reads(r, left, above, right, below)) {
            found = &r;
            break;
        }
        if (!found && set->reads(r, x0, y0, x1, y1)) found = &r;
    }
    if (found) return placeIn(*found, x, y);
    Place none;
    for (int j = y0; j <= y1; ++j)
        for (int i = x0; i <= x1; ++i)
            if (set->objectOutside(number, i, j)) none.outside |= 1u << (i - x + 2 * (j - y));
    return none;
}

TapPlace Source::tapsInRectangles(int x, int y) const {
    if (view->unread) return {};
    const int x0 = std::max(x, 0), y0 = std::max(y, 0);
    const int x1 = std::min(x + 3, width - 1), y1 = std::min(y + 3, height - 1);
    const PageRectangle* r = set->find(number, x0, y0, x1, y1);
    // Beside a rectangle only those of its padding; what lies beyond has no point.
    if (!r)
        r = set->find(number, std::clamp(x + 1, 0, width - 1), std::clamp(y + 1, 0, height - 1));
    if (!r)
        r = set->find(number, std::clamp(x + 2, 0, width - 1), std::clamp(y + 2, 0, height - 1));
    if (!r) return {};
    constexpr int kAround = PageSet::kPadding;
    return {{pages + r->page, r->first + x * r->stepX + y * r->stepY, r->stepX, r->stepY, 0},
            std::max(r->x0 - kAround, 0),
            std::max(r->y0 - kAround, 0),
            std::min(r->x1 + kAround, width),
            std::min(r->y1 + kAround, height)};
}

BlockTexels blockTexels(const Source& s, int x0, int y0, BlockBuffer& buffer) {
    if (s.whole) {
        const std::size_t first = static_cast<std::size_t>(y0) * s.width + x0;
        return {s.whole->q.data() + first, s.whole->info.data() + first, s.width};
    }
    constexpr int kSide = BlockBuffer::kSide;
    buffer.q.fill(0.0f);
    buffer.info.fill(0);
    for (const std::uint32_t number : s.set->near(s.number, x0, y0)) {
        const PageRectangle& r = s.set->rectangles()[number];
        const PreparedPage& page = s.pages[r.page];
        for (int y = std::max(r.y0, y0 - 1); y < std::min(r.y1, y0 + kBlock + 1); ++y) {
            for (int x = std::max(r.x0, x0 - 1); x < std::min(r.x1, x0 + kBlock + 1); ++x) {
                const std::size_t at = static_cast<std::size_t>((y - y0 + 1) * kSide + x - x0 + 1);
                const std::size_t texel = r.texel(x, y);
                buffer.q[at] = page.q.data()[texel];
                buffer.info[at] = page.info.data()[texel];
            }
        }
    }
    return {buffer.q.data() + kSide + 1, buffer.info.data() + kSide + 1, kSide};
}

void addBounds(const Source& s, Bounds& bounds) {
    if (const ViewSummary* unread = s.view->unread) {
        if (unread->bounds.empty()) return;
        bounds.add(unread->bounds.min);
        bounds.add(unread->bounds.max);
        return;
    }
    for (int by = 0; by < s.blocksY; ++by) {
        for (int bx = 0; bx < s.blocksX; ++bx) {
            const SourceBlock& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
            if (!(block.qMax > 0)) continue;
            for (int corner = 0; corner < 8; ++corner) {
                const double x = std::min((bx + (corner & 1)) * kBlock, s.width);
                const double y = std::min((by + (corner >> 1 & 1)) * kBlock, s.height);
                const double q = (corner & 4) ? block.qMax : block.qMin;
                const glm::dvec4 p = s.space.worldFromPixel * glm::dvec4(x, y, q, 1.0);
                bounds.add(glm::dvec3(p) / p.w);
            }
        }
    }
}

double borderCoverage(const Source& s) {
    if (s.view->unread) return s.view->unread->border;
    std::int64_t points = 0, all = 0;
    const auto count = [&](int x, int y) {
        ++all;
        // Full alpha without a depth is a pixel whose distance is unknown: it was pruned, or a
        // sensor missed it. The scene goes on there all the same.
        points += s.q(x, y) > 0.0f || s.alpha(x, y) >= 1.0f;
    };
    for (int x = 0; x < s.width; ++x) {
        count(x, 0);
        count(x, s.height - 1);
    }
    for (int y = 0; y < s.height; ++y) {
        count(0, y);
        count(s.width - 1, y);
    }
    return static_cast<double>(points) / static_cast<double>(all);
}

}  // namespace stx::surface
