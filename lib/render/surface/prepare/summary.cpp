#include "lib/render/surface/prepare/summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/render/surface/prepare/source.hpp"

namespace stx::surface {
namespace {

/// What counts as on the surface of a pixel may be farther by so many times its slopes, of both
/// ways, and all by this share: twice what any rule of the renderer allows.
constexpr float kFartherSlopes = 2.0f, kFartherShare = 0.1f;
/// Pixels around a block in which nothing may be missing: filters and votes look so far.
constexpr int kAroundBlock = 4;

/// No surface of a block is farther than this; infinite where some pixel of it has no depth.
float farthestOf(const Source& s, const ReferenceView& view, int bx, int by) {
    constexpr float kFar = std::numeric_limits<float>::infinity();
    const int x0 = std::max(bx * kBlock - kAroundBlock, 0);
    const int y0 = std::max(by * kBlock - kAroundBlock, 0);
    const int x1 = std::min((bx + 1) * kBlock + kAroundBlock, s.width);
    const int y1 = std::min((by + 1) * kBlock + kAroundBlock, s.height);
    const BlockRange& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
    float least = block.qMin - block.reach;
    for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
            const Place at = s.placeOf(x, y);
            const float q = s.qAt(at, 0, 0);
            if (!(q > 0) || view.texture.alpha(at.texel(0, 0)) < 1) return kFar;
            const glm::vec2 slope = s.gradientAt(at, 0, 0, x, y);
            least = std::min(least, q - kFartherSlopes * (std::abs(slope.x) + std::abs(slope.y)));
        }
    }
    return least > 0 ? 1.0f / (least * (1 - kFartherShare)) : kFar;
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

}  // namespace

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
    for (int by = 0; by < s.blocksY; ++by) {
        for (int bx = 0; bx < s.blocksX; ++bx) {
            const float farthest = farthestOf(s, view, bx, by);
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
