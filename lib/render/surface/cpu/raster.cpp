#include "lib/render/surface/cpu/raster.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include <hwy/cache_control.h>

#include "lib/render/surface/prepare/cells.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/cpu/raster.cpp"
#include <hwy/foreach_target.h>  // NOLINT: must come before highway.h
#include <hwy/highway.h>

#include "lib/render/surface/cpu/polygons-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {

/// The corners of polygons at positions of a source, one polygon in each lane.
struct Projection {
    const Warp& warp;

    HWY_INLINE void corner(Floats x, Floats y, Floats q, int i, Polygons& out) const {
        const FloatTag d;
        const auto& m = warp.m;
        const auto row = [&](int r) HWY_ATTR {
            const Floats rest = hn::MulAdd(hn::Set(d, m[r + 2]), q, hn::Set(d, m[r + 3]));
            return hn::MulAdd(hn::Set(d, m[r]), x, hn::MulAdd(hn::Set(d, m[r + 1]), y, rest));
        };
        const Floats denominator = row(12);
        const Floats inverse = hn::Div(hn::Set(d, 1.0f), denominator);
        out.x[i] = hn::Mul(row(0), inverse);
        out.y[i] = hn::Mul(row(4), inverse);
        out.q[i] = hn::Mul(row(8), inverse);
        out.there = hn::And(out.there, hn::Gt(denominator, hn::Zero(d)));
    }
};

namespace shared {
using namespace stx::glsl;
#include "shaders/shared/surface_cut.glsl"
}  // namespace shared

/// Draws what is in front of the camera of a convex polygon of a source that reaches behind it.
/// `corners`: positions and q in the source.
HWY_NOINLINE void drawInFront(Target& t, const Warp& warp, const std::array<glm::vec3, 4>& corners,
                              float grow, std::uint32_t flags, Extent& extent) {
    const auto at = [&](std::size_t i) {
        return warp.homogeneous(corners[i].x, corners[i].y, corners[i].z);
    };
    glm::vec3 kept[5];
    const int count = shared::cutInFront(at(0), at(1), at(2), at(3), kept);
    const FloatTag d;
    Polygons p;
    p.there = hn::FirstN(d, 1);
    p.grow = hn::Set(d, grow);
    p.flags = hn::Set(BitTag(), flags);
    for (int k = 2; k < count; ++k) {
        const std::array corner{kept[0], kept[k - 1], kept[k], kept[0]};
        for (std::size_t c = 0; c < 4; ++c) {
            p.x[c] = hn::Set(d, corner[c].x);
            p.y[c] = hn::Set(d, corner[c].y);
            p.q[c] = hn::Set(d, corner[c].z);
        }
        drawPolygons<false>(t, p, extent);
    }
}

/// Draws leaves, whose edges move out by `grow` samples.
HWY_NOINLINE void drawLeaves(Target& t, const Warp& warp, std::span<const Leaf> leaves, float grow,
                             Extent& extent) {
    const FloatTag d;
    const std::size_t n = hn::Lanes(d);
    const Projection projection{warp};
    for (std::size_t first = 0; first < leaves.size(); first += n) {
        alignas(64) float x[kLanes], y[kLanes], size[kLanes], q0[kLanes], qx[kLanes], qy[kLanes];
        const std::size_t count = std::min(n, leaves.size() - first);
        for (std::size_t l = 0; l < n; ++l) {
            const Leaf& leaf = leaves[first + std::min(l, count - 1)];
            x[l] = static_cast<float>(leaf.x);
            y[l] = static_cast<float>(leaf.y);
            size[l] = static_cast<float>(leaf.size);
            q0[l] = leaf.q0;
            qx[l] = leaf.qx;
            qy[l] = leaf.qy;
        }
        const Floats half = hn::Set(d, 0.5f), side = hn::Load(d, size), q = hn::Load(d, q0);
        const Floats left = hn::Add(hn::Load(d, x), half), top = hn::Add(hn::Load(d, y), half);
        const Floats right = hn::Add(left, side), bottom = hn::Add(top, side);
        const Floats alongX = hn::Mul(side, hn::Load(d, qx)),
                     alongY = hn::Mul(side, hn::Load(d, qy));
        Polygons p;
        p.there = hn::FirstN(d, count);
        p.grow = hn::Set(d, grow);
        p.flags = hn::Zero(BitTag());
        projection.corner(left, top, q, 0, p);
        projection.corner(right, top, hn::Add(q, alongX), 1, p);
        projection.corner(right, bottom, hn::Add(q, hn::Add(alongX, alongY)), 2, p);
        projection.corner(left, bottom, hn::Add(q, alongY), 3, p);
        drawPolygons<false>(t, p, extent);
        std::uint32_t behind = bitsOf(hn::AndNot(p.there, hn::FirstN(d, count)));
        for (; behind; behind &= behind - 1) {
            const Leaf& leaf = leaves[first + static_cast<std::size_t>(std::countr_zero(behind))];
            const glm::vec3 corner(leaf.x + 0.5f, leaf.y + 0.5f, leaf.q0);
            const glm::vec3 across = glm::vec3(1, 0, leaf.qx) * static_cast<float>(leaf.size),
                            down = glm::vec3(0, 1, leaf.qy) * static_cast<float>(leaf.size);
            drawInFront(t, warp, {corner, corner + across, corner + across + down, corner + down},
                        grow, 0, extent);
        }
    }
}

/// Two rows of corners of the cells of a block in the tile, with what their source says of them.
struct CellRows {
    static constexpr int kSide = kBlock + 1;
    /// Whole vectors may be loaded from each corner on.
    static constexpr int kPitch = kBlock + 16;
    struct Row {
        alignas(64) float x[kPitch], y[kPitch], q[kPitch], w[kPitch], depth[kPitch] = {};
        alignas(64) std::uint32_t info[kPitch] = {};
    };
    Row rows[2];

    /// Corners whose first is at (sx, sy) in the source, `count` of which are there.
    HWY_INLINE void project(const Warp& warp, int j, float sx, float sy, const float* depths,
                            const std::uint8_t* info, int count) {
        const FloatTag d;
        const int n = static_cast<int>(hn::Lanes(d));
        const auto& m = warp.m;
        Row& out = rows[j & 1];
        if (count == kSide) {  // by far most: a copy of fixed length is inlined
            std::memcpy(out.depth, depths, kSide * sizeof(float));
            for (int i = 0; i < kSide; ++i) out.info[i] = info[i];
        } else {
            std::copy_n(depths, count, out.depth);
            std::copy_n(info, count, out.info);
        }
        const Floats steps = hn::ConvertTo(d, hn::Iota(hn::RebindToSigned<FloatTag>(), 0));
        for (int i = 0; i < count; i += n) {
            const Floats vx = hn::Add(hn::Set(d, sx + static_cast<float>(i)), steps);
            const Floats vq = hn::LoadU(d, out.depth + i);
            const auto row = [&](int r) HWY_ATTR {
                return hn::MulAdd(
                    hn::Set(d, m[r]), vx,
                    hn::MulAdd(hn::Set(d, m[r + 2]), vq, hn::Set(d, m[r + 1] * sy + m[r + 3])));
            };
            const Floats denominator = row(12);
            const Floats inverse = hn::Div(hn::Set(d, 1.0f), denominator);
            hn::StoreU(hn::Mul(row(0), inverse), d, out.x + i);
            hn::StoreU(hn::Mul(row(4), inverse), d, out.y + i);
            hn::StoreU(hn::Mul(row(8), inverse), d, out.q + i);
            hn::StoreU(denominator, d, out.w + i);
        }
    }

    /// Where the corners of a block begin in the source, and how they come from there.
    struct Begin {
        const Warp& warp;
        float x, y;
    };
    /// Polygons of the cells below row j from column i on: the numbers of their corners (0 to 3 for
    /// 00, 10, 11 and 01), and how they are drawn.
    struct OfCells {
        int j, i;
        Floats number[4];
        Floats grow;
        Bits flags;
    };
    /// Draws those of `lanes`, which reach behind the camera.
    HWY_NOINLINE void drawCut(Target& t, const Begin& begin, const OfCells& cells,
                              std::uint32_t lanes, Extent& extent) const {
        const FloatTag d;
        alignas(64) float number[4][kLanes], grow[kLanes];
        alignas(64) std::uint32_t flags[kLanes];
        for (int c = 0; c < 4; ++c) hn::Store(cells.number[c], d, number[c]);
        hn::Store(cells.grow, d, grow);
        hn::Store(cells.flags, BitTag(), flags);
        for (; lanes; lanes &= lanes - 1) {
            const int l = std::countr_zero(lanes);
            std::array<glm::vec3, 4> corners;
            for (std::size_t c = 0; c < 4; ++c) {
                const int k = static_cast<int>(number[c][l]);
                const int column = cells.i + l + (k == 1 || k == 2), row = cells.j + (k >= 2);
                corners[c] = {begin.x + static_cast<float>(column),
                              begin.y + static_cast<float>(row), rows[row & 1].depth[column]};
            }
            drawInFront(t, begin.warp, corners, grow[l], flags[l], extent);
        }
    }

    /// Draws those of the cells below row j that `cells` has: cellShape() and cellNearEdge(), as
    /// many at once as a vector takes.
    HWY_INLINE void draw(Target& t, const Source& s, const Begin& begin, int j, std::uint32_t cells,
                         Extent& extent) const {
        const FloatTag d;
        const BitTag du;
        const int n = static_cast<int>(hn::Lanes(d));
        const Row &top = rows[j & 1], &bottom = rows[(j & 1) ^ 1];
        const Floats zero = hn::Zero(d);
        for (int i = 0; i < kBlock; i += n) {
            const std::uint32_t some = cells >> i & ((1u << n) - 1);
            if (!some) continue;
            // Corners 00, 10, 11, 01: around the cell.
            const Row* const row[4] = {&top, &top, &bottom, &bottom};
            const int column[4] = {i, i + 1, i + 1, i};
            Floats x[4], y[4], q[4], depth[4];
            Bits info[4];
            for (int c = 0; c < 4; ++c) {
                x[c] = hn::LoadU(d, row[c]->x + column[c]);
                y[c] = hn::LoadU(d, row[c]->y + column[c]);
                q[c] = hn::LoadU(d, row[c]->q + column[c]);
                depth[c] = hn::LoadU(d, row[c]->depth + column[c]);
                info[c] = hn::LoadU(du, row[c]->info + column[c]);
            }
            const std::uint8_t asked[8] = {static_cast<std::uint8_t>(some),
                                           static_cast<std::uint8_t>(some >> 8)};
            const FloatMask wanted = hn::LoadMaskBits(d, asked);
            const auto has = [&](Bits of, std::uint8_t bit) HWY_ATTR {
                return hn::RebindMask(d, hn::TestBit(of, hn::Set(du, std::uint32_t{bit})));
            };
            const FloatMask linkTop = has(info[0], Info::kLinkRight);
            const FloatMask linkBottom = has(info[3], Info::kLinkRight);
            const FloatMask linkLeft = has(info[0], Info::kLinkDown);
            const FloatMask linkRight = has(info[1], Info::kLinkDown);
            const FloatMask across = hn::And(linkTop, linkBottom),
                            down = hn::And(linkLeft, linkRight);
            const FloatMask all = hn::And(across, down);
            const FloatMask split = hn::Or(hn::And(across, hn::Or(linkLeft, linkRight)),
                                           hn::And(down, hn::Or(linkTop, linkBottom)));
            const Floats rising = hn::Abs(hn::Sub(depth[1], depth[3]));
            const Floats falling = hn::Abs(hn::Sub(depth[0], depth[2]));
            const Floats uneven =
                hn::Abs(hn::Sub(hn::Sub(hn::Add(depth[0], depth[2]), depth[1]), depth[3]));
            const Floats flat = s.space.axis.inverse ? hn::Mul(hn::Set(d, 2 * s.flat), depth[0])
                                                     : hn::Set(d, 2 * s.flat);
            const FloatMask quad = hn::And(all, hn::Le(uneven, flat));
            const FloatMask splits = hn::AndNot(quad, split);
            const FloatMask falls = hn::And(splits, hn::Lt(falling, rising));
            const FloatMask rises = hn::AndNot(falls, splits);
            // Two links that meet make one of the triangles.
            const FloatMask alone = hn::Not(split);
            const FloatMask upperLeft = hn::And(alone, hn::And(linkTop, linkLeft));
            const FloatMask upperRight = hn::And(alone, hn::And(linkTop, linkRight));
            const FloatMask lowerRight = hn::And(alone, hn::And(linkBottom, linkRight));
            const FloatMask lowerLeft = hn::And(alone, hn::And(linkBottom, linkLeft));

            Polygons p;
            const Bits edges =
                hn::Min(hn::Min(hn::ShiftRight<4>(info[0]), hn::ShiftRight<4>(info[1])),
                        hn::Min(hn::ShiftRight<4>(info[2]), hn::ShiftRight<4>(info[3])));
            const auto nearEdge = hn::Lt(edges, hn::Set(du, 3u));
            p.flags = hn::IfThenElseZero(nearEdge, hn::Set(du, std::uint32_t{kNearEdgeBit}));
            p.grow = hn::IfThenElse(hn::RebindMask(d, nearEdge), hn::Set(d, t.edgeGrow),
                                    hn::Set(d, kCrack));
            // 00, 10, 11, 01 of quads; of triangles 00, 10, 11 or 00, 10, 01.
            const FloatMask third = hn::Or(rises, upperLeft);
            const auto choose = [&](const Floats* of, Floats* to) HWY_ATTR {
                to[0] = of[0];
                to[1] = of[1];
                to[2] = hn::IfThenElse(third, of[3], of[2]);
                to[3] = hn::IfThenElse(quad, of[3], of[0]);
            };
            choose(x, p.x);
            choose(y, p.y);
            choose(q, p.q);
            Floats w[4];
            for (int c = 0; c < 4; ++c) w[c] = hn::LoadU(d, row[c]->w + column[c]);
            const Floats number[4] = {zero, hn::Set(d, 1.0f), hn::Set(d, 2.0f), hn::Set(d, 3.0f)};
            // What is not in front as a whole is cut.
            const auto drawThose = [&](FloatMask those, const auto& chosen) HWY_ATTR {
                Floats of[4];
                chosen(w, of);
                p.there = hn::And(those, hn::Gt(leastOf(of), zero));
                drawPolygons<false>(t, p, extent);
                const std::uint32_t cut = bitsOf(hn::AndNot(p.there, those));
                if (!cut) return;
                OfCells polygons{j, i, {}, p.grow, p.flags};
                chosen(number, polygons.number);
                drawCut(t, begin, polygons, cut, extent);
            };
            drawThose(hn::And(wanted, hn::Or(hn::Or(quad, splits), hn::Or(upperLeft, upperRight))),
                      choose);
            // 00, 11, 01 or 10, 11, 01.
            const FloatMask more = hn::And(wanted, hn::Or(splits, hn::Or(lowerRight, lowerLeft)));
            if (hn::AllFalse(d, more)) continue;
            const FloatMask second = hn::Or(rises, lowerRight);
            const auto chooseMore = [&](const Floats* of, Floats* to) HWY_ATTR {
                to[0] = to[3] = hn::IfThenElse(second, of[1], of[0]);
                to[1] = of[2];
                to[2] = of[3];
            };
            chooseMore(x, p.x);
            chooseMore(y, p.y);
            chooseMore(q, p.q);
            drawThose(more, chooseMore);
        }
    }
};

/// Draws the cells of a block, whose first pixel is (x0, y0).
/// Meanwhile the block whose texels are `ahead` is fetched into the cache: memory cannot tell which
/// comes next.
HWY_NOINLINE void drawCells(Target& t, const Source& s, const Warp& warp, const SourceBlock& block,
                            const BlockTexels& texels, int x0, int y0, const BlockTexels& ahead,
                            Extent& extent) {
    CellRows grid;
    const CellRows::Begin begin{warp, static_cast<float>(x0) + 0.5f, static_cast<float>(y0) + 0.5f};
    const int xEnd = std::min(x0 + kBlock, s.width - 1), yEnd = std::min(y0 + kBlock, s.height - 1);
    const int columns = xEnd - x0 + 1;
    int projected = -1;  // row
    const auto project = [&](int j) HWY_ATTR {
        if (projected >= j) return;
        projected = j;
        grid.project(warp, j, begin.x, begin.y + static_cast<float>(j), texels.q + texels.at(0, j),
                     texels.info + texels.at(0, j), columns);
    };
    for (int j = 0; j <= yEnd - y0; ++j) {
        if (ahead.q) {
            hwy::Prefetch(ahead.q + ahead.at(0, j));
            hwy::Prefetch(ahead.q + ahead.at(kBlock - 1, j));
            hwy::Prefetch(ahead.info + ahead.at(0, j));
        }
        if (j == kBlock || !block.cells[static_cast<std::size_t>(j)]) continue;
        project(j);
        project(j + 1);
        grid.draw(t, s, begin, j, block.cells[static_cast<std::size_t>(j)], extent);
    }
}

/// Draws the squares around the edge pixels of a block, whose first pixel is (x0, y0).
HWY_NOINLINE void drawExtensions(Target& t, const Source& s, const Warp& warp,
                                 const SourceBlock& block, const BlockTexels& texels, int x0,
                                 int y0, Extent& extent) {
    const FloatTag d;
    const int n = static_cast<int>(hn::Lanes(d));
    const Projection projection{warp};
    alignas(64) float xs[kLanes] = {}, ys[kLanes] = {}, qs[kLanes] = {}, halves[kLanes] = {};
    alignas(64) float gx[kLanes] = {}, gy[kLanes] = {}, reaches[kLanes] = {};
    alignas(64) std::uint32_t flags[kLanes] = {};
    int count = 0;
    const auto flush = [&]() HWY_ATTR {
        const Floats x = hn::Load(d, xs), y = hn::Load(d, ys), q = hn::Load(d, qs);
        const Floats half = hn::Load(d, halves), reach = hn::Load(d, reaches);
        const Floats alongX = hn::Load(d, gx), alongY = hn::Load(d, gy);
        Polygons p;
        p.there = hn::FirstN(d, static_cast<std::size_t>(count));
        p.grow = hn::Set(d, t.edgeGrow);
        p.flags = hn::LoadU(BitTag(), flags);
        const Floats left = hn::Sub(x, half), right = hn::Add(x, half);
        const Floats top = hn::Sub(y, half), bottom = hn::Add(y, half);
        const auto on = [&](Floats change) HWY_ATTR {
            return hn::Add(q, hn::Min(hn::Max(change, hn::Neg(reach)), reach));
        };
        const Floats sum = hn::Add(alongX, alongY), difference = hn::Sub(alongX, alongY);
        projection.corner(left, top, on(hn::Neg(sum)), 0, p);
        projection.corner(right, top, on(difference), 1, p);
        projection.corner(right, bottom, on(sum), 2, p);
        projection.corner(left, bottom, on(hn::Neg(difference)), 3, p);
        drawPolygons<true>(t, p, extent);
        count = 0;
    };
    for (int j = 0; j < kBlock; ++j) {
        for (std::uint32_t left = block.edges[static_cast<std::size_t>(j)]; left;
             left &= left - 1) {
            const int i = std::countr_zero(left);
            const int x = x0 + i, y = y0 + j;
            const float* at = texels.q + texels.at(i, j);
            const std::uint8_t* info = texels.info + texels.at(i, j);
            const bool outside = *info & Info::kBesideBackground;
            const float half = outside ? kHalfBesideBackground : kHalfInside;
            const glm::vec2 g = gradientFrom(at, info, 1, texels.stride, x > 0, y > 0) * half;
            xs[count] = static_cast<float>(x) + 0.5f;
            ys[count] = static_cast<float>(y) + 0.5f;
            qs[count] = *at;
            halves[count] = half;
            gx[count] = g.x;
            gy[count] = g.y;
            const float scale = s.space.axis.stepScale(*at);
            reaches[count] = kExtensionReach * scale;
            const bool rim = block.rims[static_cast<std::size_t>(j)] >> i & 1;
            const bool covers =
                (outside || rim) && std::abs(g.x) + std::abs(g.y) < kExtensionCovers * scale;
            flags[count] =
                kExtensionBit | kNearEdgeBit | (covers ? kCoversBit : 0u) | (rim ? kRimBit : 0u);
            if (++count == n) flush();
        }
    }
    if (count) flush();
}

HWY_INLINE DrawnBox boxOf(const Extent& extent) {
    const FloatTag d;
    return {hn::GetLane(hn::MinOfLanes(d, extent.x0)), hn::GetLane(hn::MinOfLanes(d, extent.y0)),
            hn::GetLane(hn::MaxOfLanes(d, extent.x1)), hn::GetLane(hn::MaxOfLanes(d, extent.y1))};
}

bool RasteriseSource(const Source& s, const Warp& warp, std::span<const std::uint32_t> blocks,
                     const SampleGrid& grid, const DepthAxis& axis, float* samples,
                     const RasterNeeds& needs) {
    Target t{samples,
             grid.count(),
             grid.side(),
             grid.stride(),
             axis.nearest(),
             axis.inverse,
             needs.squares,
             1.0f / static_cast<float>(kSquare * grid.perPixel),
             needs.reachFromEdges ? 0.5f : kCrack};
    BlockBuffer buffer;
    const float leafGrow = kLeafGrow * static_cast<float>(grid.perPixel);
    const auto corner = [&](std::uint32_t index) {
        return glm::ivec2(static_cast<int>(index % s.blocksX),
                          static_cast<int>(index / s.blocksX)) *
               kBlock;
    };
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const SourceBlock& block = s.blocks[blocks[k]];
        Extent extent;
        drawLeaves(t, warp, {s.leaves.data() + block.leafBegin, s.leaves.data() + block.leafEnd},
                   leafGrow, extent);
        if (block.anyCell) {
            // Texels of a view that fills its page stay where they are.
            BlockTexels ahead;
            if (s.whole && k + 1 < blocks.size() && s.blocks[blocks[k + 1]].anyCell) {
                const glm::ivec2 next = corner(blocks[k + 1]);
                ahead = blockTexels(s, next.x, next.y, buffer);
            }
            const glm::ivec2 at = corner(blocks[k]);
            drawCells(t, s, warp, block, blockTexels(s, at.x, at.y, buffer), at.x, at.y, ahead,
                      extent);
        }
        if (!needs.drawnIn.empty()) needs.drawnIn[k] = boxOf(extent);
    }
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const SourceBlock& block = s.blocks[blocks[k]];
        if (!block.anyEdge) continue;
        const glm::ivec2 at = corner(blocks[k]);
        Extent extent;
        drawExtensions(t, s, warp, block, blockTexels(s, at.x, at.y, buffer), at.x, at.y, extent);
        if (!needs.drawnIn.empty()) needs.drawnIn[k].add(boxOf(extent));
    }
    return !t.empty;
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::surface {

Squares DrawnBox::squaresOf(int x, int y) const {
    if (empty()) return 0;
    const auto left = static_cast<float>(x), top = static_cast<float>(y);
    constexpr float kLast = kTile - 1;
    // From samples to pixels of the tile, with one pixel on each side.
    const float from = x0 - left - 0.6f, to = x1 - left + 1.6f;
    const float above = y0 - top - 0.6f, below = y1 - top + 1.6f;
    if (to < 0 || below < 0 || from > kLast || above > kLast) return 0;
    const auto square = [&](float at) {
        return static_cast<int>(std::clamp(at, 0.0f, kLast)) / kSquare;
    };
    return squaresBetween(square(from), square(above), square(to), square(below));
}

HWY_EXPORT(RasteriseSource);

bool rasteriseSource(const Source& source, const Warp& sampleFromSource,
                     std::span<const std::uint32_t> blocks, const SampleGrid& grid,
                     const DepthAxis& axis, float* samples, const RasterNeeds& needs) {
    return HWY_DYNAMIC_DISPATCH(RasteriseSource)(source, sampleFromSource, blocks, grid, axis,
                                                 samples, needs);
}

}  // namespace stx::surface
#endif
