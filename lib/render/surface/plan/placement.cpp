#include "lib/render/surface/plan/placement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace stx::surface {
namespace {

/// How far a block may reach out of its range, as a part of SourceBlock::reach, and the share of q
/// that rounding may add.
constexpr float kBlockMargin = 1.05f, kBlockRounding = 1e-5f;
/// What rounding may add to the terms that tell which way a block faces.
constexpr double kFacingRounding = 1e-3;
/// A block that is in part behind the camera is cut off at this share of its largest w: far below
/// where a part of it is (kNearestShare).
constexpr float kNearestOfBlock = 1e-4f;

/// Whether the frame's camera sees all that is drawn of a block from behind. `eye` is where that
/// camera is, in the space of the source's pixels, homogeneous.
bool isTurnedAway(const Source& s, const BlockRange& block, int x, int y, const glm::dvec4& eye) {
    // The eye is in front of a plane q = q0 + gx (x - x0) + gy (y - y0) where
    // gx (x - x0) + gy (y - y0) < q - q0, with the eye as (x, y, q). Over the block each term has a
    // range.
    struct Range {
        double low, high;
        [[nodiscard]] double size() const { return std::max(std::abs(low), std::abs(high)); }
    };
    const auto between = [](double a, double b) { return Range{std::min(a, b), std::max(a, b)}; };
    const auto product = [&](Range a, Range b) {
        const double all[] = {a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high};
        return Range{*std::min_element(all, all + 4), *std::max_element(all, all + 4)};
    };
    const double margin =
        kBlockMargin * block.reach + kBlockRounding * s.space.axis.relativeScale(block.qMax);
    const auto along = [&](double at, double from, float least, float most) {
        return product({least, most},
                       between(at - (from - 1.0) * eye.w, at - (from + kBlock + 2.0) * eye.w));
    };
    const Range ofX = along(eye.x, x, block.leastSlope.x, block.mostSlope.x);
    const Range ofY = along(eye.y, y, block.leastSlope.y, block.mostSlope.y);
    const Range depth =
        between(eye.z - (block.qMin - margin) * eye.w, eye.z - (block.qMax + margin) * eye.w);
    return ofX.low + ofY.low - depth.high >
           kFacingRounding * (ofX.size() + ofY.size() + depth.size());
}

/// The eight corners of the box around what is drawn of a block, in the frame. Arrays of each
/// coordinate, so that compilers make vectors of the loops.
struct Corners {
    std::array<float, 8> x, y, w;  ///< homogeneous
    struct DrawnBounds {
        float x0 = std::numeric_limits<float>::max(), y0 = x0, x1 = -x0, y1 = -x0;

        void add(float x, float y) {
            x0 = std::min(x0, x);
            x1 = std::max(x1, x);
            y0 = std::min(y0, y);
            y1 = std::max(y1, y);
        }
    };

    /// Of the box of `side` x `side` pixels from (left, top) on, between two depths.
    Corners(const Warp& warp, float left, float top, float side, float qNear, float qFar) {
        const auto& m = warp.m;
        for (std::size_t k = 0; k < 8; ++k) {
            const float u = (k & 1) ? left + side + 1.5f : left - 0.5f;
            const float v = (k & 2) ? top + side + 1.5f : top - 0.5f;
            const float q = (k & 4) ? qNear : qFar;
            x[k] = m[0] * u + m[1] * v + m[2] * q + m[3];
            y[k] = m[4] * u + m[5] * v + m[6] * q + m[7];
            w[k] = m[12] * u + m[13] * v + m[14] * q + m[15];
        }
    }
    /// The box around all corners, when all are in front of the camera.
    [[nodiscard]] DrawnBounds all() const {
        std::array<float, 8> u, v;
        for (std::size_t k = 0; k < 8; ++k) {
            u[k] = x[k] / w[k];
            v[k] = y[k] / w[k];
        }
        const auto [x0, x1] = std::ranges::minmax(u);
        const auto [y0, y1] = std::ranges::minmax(v);
        return {x0, y0, x1, y1};
    }
    /// The box around the part that is in front of the camera. Edges that go on behind the camera
    /// end where their w is `cut`.
    [[nodiscard]] DrawnBounds inFront(float cut) const {
        DrawnBounds box;
        for (std::size_t k = 0; k < 8; ++k) {
            if (w[k] > 0) box.add(x[k] / w[k], y[k] / w[k]);
            for (const std::size_t bit : {1u, 2u, 4u}) {
                const std::size_t to = k ^ bit;
                if (!(w[k] > cut && w[to] < cut)) continue;
                const float along = (w[k] - cut) / (w[k] - w[to]);
                const float at = w[k] + (w[to] - w[k]) * along;
                box.add((x[k] + (x[to] - x[k]) * along) / at, (y[k] + (y[to] - y[k]) * along) / at);
            }
        }
        return box;
    }
};

/// Places squares of a source's pixels in a frame.
struct Placer {
    const Source& source;
    Warp warp;
    glm::vec2 first, limit;  ///< where the tiles begin and how far they reach from there, pixels

    Placer(const FrameSource& f, const TileGrid& tiles)
        : source(*f.source),
          warp(warpFrom(f.pixelFromSource)),
          first(tiles.first),
          limit(tiles.size * kTile) {}

    struct Placed {
        TileRange tiles;
        bool partlyBehind;
    };
    /// The tiles that `side` x `side` pixels from (x, y) on may be drawn in, if any.
    [[nodiscard]] std::optional<Placed> place(const BlockRange& range, int x, int y,
                                              int side) const {
        const float margin = kBlockMargin * range.reach +
                             kBlockRounding * source.space.axis.relativeScale(range.qMax);
        const Corners corners(warp, static_cast<float>(x), static_cast<float>(y),
                              static_cast<float>(side), range.qMax + margin,
                              std::max(range.qMin - margin, 0.5f * range.qMin));
        const auto [least, most] = std::ranges::minmax(corners.w);
        if (!(most > 0)) return std::nullopt;
        const bool behind = !(least > 0);
        const auto box = behind ? corners.inFront(kNearestOfBlock * most) : corners.all();
        const float x0 = std::max(box.x0 - first.x - 0.5f, 0.0f);
        const float x1 = std::min(box.x1 - first.x + 0.5f, limit.x - 0.5f);
        const float y0 = std::max(box.y0 - first.y - 0.5f, 0.0f);
        const float y1 = std::min(box.y1 - first.y + 0.5f, limit.y - 0.5f);
        if (!(x0 <= x1 && y0 <= y1)) return std::nullopt;
        return Placed{{static_cast<int>(x0) / kTile, static_cast<int>(y0) / kTile,
                       static_cast<int>(x1) / kTile, static_cast<int>(y1) / kTile},
                      behind};
    }
    /// The first pixel of a block of the source.
    [[nodiscard]] glm::ivec2 firstOf(std::uint32_t block) const {
        const int number = static_cast<int>(block);
        return kBlock * glm::ivec2(number % source.blocksX, number / source.blocksX);
    }
};

/// The place in the frame, homogeneous, of the middle of the block whose first pixel is (x, y);
/// where that is behind the camera, of the block's corner that is farthest in front of it.
glm::dvec4 middleOrFarthest(const glm::dmat4& pixelFromSource, const BlockRange& block, int x,
                            int y) {
    const auto at = [&](double i, double j, double q) {
        return pixelFromSource * glm::dvec4(x + i * kBlock, y + j * kBlock, q, 1.0);
    };
    glm::dvec4 found = at(0.5, 0.5, 0.5 * (block.qMin + block.qMax));
    if (found.w > 0) return found;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec4 h =
            at(corner & 1, corner >> 1 & 1, (corner & 4) ? block.qMax : block.qMin);
        if (h.w > found.w) found = h;
    }
    return found;
}

}  // namespace

glm::dvec4 eyeIn(const Source& s, const Camera& camera) {
    return s.space.pixelFromWorld * (camera.orthographic ? glm::dvec4(-camera.forward(), 0.0)
                                                         : glm::dvec4(camera.position, 1.0));
}

std::vector<PlacedBlocks> placedBlocks(const FrameSource& f, const TileGrid& tiles) {
    const Placer placer(f, tiles);
    std::vector<PlacedBlocks> all;
    const auto add = [&](const Placer::Placed& at, const glm::dvec4& h, std::uint32_t begin,
                         std::uint32_t end) {
        if (h.w > 0) all.push_back({at.tiles, h.z / h.w, begin, end, at.partlyBehind});
    };
    for (const Source::PlannedRegion& region : f.source->regions) {
        const auto at = placer.place(region, region.x, region.y, kRegion * kBlock);
        if (!at) continue;
        if (!at->partlyBehind) {
            add(*at, f.pixelFromSource * glm::dvec4(region.middle, 1.0), region.begin, region.end);
            continue;
        }
        // Such a block may be large in the frame, so that its middle says little.
        for (std::uint32_t i = region.begin; i < region.end; ++i) {
            const std::uint32_t number = f.source->planned[i];
            const BlockRange& block = f.source->blocks[number];
            const glm::ivec2 first = placer.firstOf(number);
            if (const auto own = placer.place(block, first.x, first.y, kBlock))
                add(*own, middleOrFarthest(f.pixelFromSource, block, first.x, first.y), i, i + 1);
        }
    }
    return all;
}

void placeBlocks(FrameSource& f, const PixelSpace& space, const TileGrid& tiles) {
    const Source& s = *f.source;
    const Placer placer(f, tiles);
    const glm::dvec4 eye = eyeIn(s, space.camera);
    f.turnedAway.assign(s.blocks.size(), 0);
    struct Range {
        std::uint32_t block;
        TileRange tiles;
    };
    std::vector<Range> ranges;
    f.tileBegin.assign(static_cast<std::size_t>(tiles.count()) + 1, 0);
    const auto forTiles = [&](const TileRange& r, const auto& visit) {
        for (int y = r.y0; y <= r.y1; ++y)
            for (int x = r.x0; x <= r.x1; ++x)
                visit(static_cast<std::size_t>(y * tiles.size.x + x));
    };
    for (const std::uint32_t number : s.planned) {
        const BlockRange& block = s.blocks[number];
        const glm::ivec2 first = placer.firstOf(number);
        const auto at = placer.place(block, first.x, first.y, kBlock);
        if (!at) continue;
        ranges.push_back({number, at->tiles});
        f.turnedAway[number] = isTurnedAway(s, block, first.x, first.y, eye);
        forTiles(at->tiles, [&](std::size_t t) { ++f.tileBegin[t + 1]; });
    }
    for (std::size_t t = 1; t < f.tileBegin.size(); ++t) f.tileBegin[t] += f.tileBegin[t - 1];
    f.blocks.resize(f.tileBegin.back());
    std::vector<std::uint32_t> next(f.tileBegin.begin(), f.tileBegin.end() - 1);
    for (const Range& r : ranges)
        forTiles(r.tiles, [&](std::size_t t) { f.blocks[next[t]++] = r.block; });
}

}  // namespace stx::surface
