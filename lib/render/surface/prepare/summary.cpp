#include "lib/render/surface/prepare/summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {
namespace {

/// What counts as on the surface of a pixel may be farther by so many times its slopes, of both
/// ways, and all by this share: twice what any rule of the renderer allows.
constexpr float kFartherSlopes = 2.0f, kFartherShare = 0.1f;
/// Pixels around a block in which nothing may be missing: filters and votes look so far.
constexpr int kAroundBlock = 4;

/// By tiles of kAroundBlock pixels a side, row by row: the least q that something on the surface of
/// a pixel of it may have; below all numbers where some pixel has no depth. Blocks and what is
/// around them are whole tiles.
class LeastOfTiles {
  public:
    LeastOfTiles(const Source& s, const Texture& texture)
        : size_((s.width + kAroundBlock - 1) / kAroundBlock,
                (s.height + kAroundBlock - 1) / kAroundBlock),
          tiles_(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y),
                 std::numeric_limits<float>::max()) {
        parallelFor(0, size_.y, [&](std::int64_t row) {
            const int y0 = static_cast<int>(row) * kAroundBlock;
            for (int y = y0; y < std::min(y0 + kAroundBlock, s.height); ++y)
                addRow(s, texture, y, tiles_.data() + row * size_.x);
        });
    }
    /// Of a block and what is around it.
    [[nodiscard]] float around(int bx, int by) const {
        constexpr int kTiles = kBlock / kAroundBlock;
        float least = std::numeric_limits<float>::max();
        for (int y = std::max(by * kTiles - 1, 0); y < std::min((by + 1) * kTiles + 1, size_.y);
             ++y)
            for (int x = std::max(bx * kTiles - 1, 0); x < std::min((bx + 1) * kTiles + 1, size_.x);
                 ++x)
                least = std::min(least, tiles_[static_cast<std::size_t>(y * size_.x + x)]);
        return least;
    }

  private:
    static void addRow(const Source& s, const Texture& texture, int y, float* tiles) {
        const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width);
        const float* q = s.whole->q.data() + first;
        const std::uint8_t* info = s.whole->info.data() + first;
        for (int x = 0; x < s.width; ++x) {
            float& least = tiles[x / kAroundBlock];
            if (!(q[x] > 0) || texture.alpha(first + static_cast<std::size_t>(x)) < 1) {
                least = std::numeric_limits<float>::lowest();
                continue;
            }
            const glm::vec2 slope = gradientFrom(q + x, info + x, 1, s.width, x > 0, y > 0);
            least =
                std::min(least, q[x] - kFartherSlopes * (std::abs(slope.x) + std::abs(slope.y)));
        }
    }

    glm::ivec2 size_;
    std::vector<float> tiles_;
};
static_assert(kBlock % kAroundBlock == 0);

/// No surface of a block is farther than this; infinite where some pixel in it or around it has no
/// depth.
float farthestOf(const Source& s, const LeastOfTiles& tiles, int bx, int by) {
    const BlockRange& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
    const float least = std::min(block.qMin - block.reach, tiles.around(bx, by));
    return least > 0 ? 1.0f / (least * (1 - kFartherShare))
                     : std::numeric_limits<float>::infinity();
}

/// Whether splats of a block are not covered in full; see splat::BlockInfo.
bool isFaint(const ReferenceView& view, int bx, int by) {
    bool drawn = false, faint = false;
    for (int y = by * kBlock; y < std::min((by + 1) * kBlock, view.depth.height()); ++y) {
        for (int x = bx * kBlock; x < std::min((bx + 1) * kBlock, view.depth.width()); ++x) {
            if (!hasPoint(view.depth.at(x, y))) continue;
            const float alpha =
                view.texture.alpha(static_cast<std::size_t>(y) * view.depth.width() + x);
            drawn = drawn || alpha > 0;
            faint = faint || !(alpha >= 1);
        }
    }
    return drawn && faint;
}

/// Whether no pixel of a view is farther than its cells say, nor one without a depth in a cell that
/// ends.
bool isWithinCells(const ViewSummary& summary, const ReferenceView& view) {
    // As farthestOf() has it, and what rounding may add.
    constexpr float kLeastShare = 1 - kFartherShare, kRounding = 1e-5f;
    constexpr int kCells = ViewSummary::kCells;
    const int width = view.depth.width(), height = view.depth.height();
    std::vector<float> columns(static_cast<std::size_t>(width));
    for (int row = 0; row < kCells; ++row) {
        // By columns: compilers make vectors of it.
        std::ranges::fill(columns, 0.0f);
        for (int y = row * height / kCells; y < (row + 1) * height / kCells; ++y) {
            const float* depth = view.depth.row(y).data();
            float* most = columns.data();
            for (int x = 0; x < width; ++x) most[x] = depth[x] > most[x] ? depth[x] : most[x];
        }
        for (int cell = 0; cell < kCells; ++cell) {
            const float most = std::accumulate(columns.begin() + cell * width / kCells,
                                               columns.begin() + (cell + 1) * width / kCells, 0.0f,
                                               [](float a, float b) { return std::max(a, b); });
            const float said = summary.farthest[static_cast<std::size_t>(row * kCells + cell)];
            if (!(most * (1 - kRounding) <= said * kLeastShare)) return false;
        }
    }
    return true;
}

/// Whether a point of each block, where it has one, is within the bounds.
bool isWithinBounds(const ViewSummary& summary, const ReferenceView& view) {
    constexpr double kRounding = 1e-6;
    for (int y = kBlock / 2; y < view.depth.height(); y += kBlock) {
        for (int x = kBlock / 2; x < view.depth.width(); x += kBlock) {
            if (!hasPoint(view.depth.at(x, y)) || !(view.depth.at(x, y) > 0)) continue;
            if (summary.bounds.empty()) return false;
            const glm::dvec3 p = view.worldPoint(x, y);
            const double slack =
                kRounding * (static_cast<double>(view.depth.at(x, y)) + glm::length(p));
            for (int k = 0; k < 3; ++k)
                if (!(p[k] >= summary.bounds.min[k] - slack &&
                      p[k] <= summary.bounds.max[k] + slack))
                    return false;
        }
    }
    return true;
}

/// Whether some pixel is not covered in full.
bool isOpen(const Texture& texture) {
    if (const auto* bytes = texture.rgba8()) {
        std::uint8_t least = 255;
        for (const glm::u8vec4 p : bytes->pixels()) least = std::min(least, p.a);
        return least < 255;
    }
    return std::ranges::any_of(texture.rgbaFloat()->pixels(),
                               [](const glm::vec4& p) { return !(p.a >= 1.0f); });
}

}  // namespace

bool mayBeSummaryOf(const ViewSummary& summary, const ReferenceView& view) {
    if (summary.points != view.pointCount() || summary.open != isOpen(view.texture)) return false;
    return view.camera.orthographic ||
           (isWithinCells(summary, view) && isWithinBounds(summary, view));
}

ViewSummary summaryOf(const ReferenceView& view) {
    Bundle alone;
    ReferenceView& copy = alone.views.emplace_back();
    static_cast<ViewHeader&>(copy) = view;
    copy.texture = view.texture;
    copy.depth = view.depth;
    const PageSet set(alone);
    RenderSettings settings;
    settings.without.add(Stage::creases);
    settings.without.add(Stage::rims);
    const SurfaceScene scene(set, settings);
    const Source& s = scene.sources.front();

    ViewSummary out;
    out.points = view.pointCount();
    out.validShare = s.validShare;
    out.border = borderCoverage(s);
    out.open = s.hasAlpha;
    (void)set.solid(out.translucent);
    addBounds(s, out.bounds);
    const LeastOfTiles tiles(s, view.texture);
    for (int by = 0; by < s.blocksY; ++by) {
        for (int bx = 0; bx < s.blocksX; ++bx) {
            const float farthest = farthestOf(s, tiles, bx, by);
            out.faint = out.faint || isFaint(view, bx, by);
            // All cells that some of it is in.
            const auto cell = [](int pixel, int size) {
                return std::min(pixel, size - 1) * ViewSummary::kCells / size;
            };
            const int lastX = cell((bx + 1) * kBlock - 1, s.width);
            const int lastY = cell((by + 1) * kBlock - 1, s.height);
            for (int y = cell(by * kBlock, s.height); y <= lastY; ++y)
                for (int x = cell(bx * kBlock, s.width); x <= lastX; ++x) {
                    float& most =
                        out.farthest[static_cast<std::size_t>(y * ViewSummary::kCells + x)];
                    most = std::max(most, farthest);
                }
        }
    }
    return out;
}

}  // namespace stx::surface
