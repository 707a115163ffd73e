#include "lib/render/surface/cpu/raster.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <hwy/cache_control.h>

#include "lib/render/surface/cells.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/cpu/raster.cpp"
#include <hwy/foreach_target.h>  // NOLINT: must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

struct Vertex {
    float x, y, q;
    bool front;
};

HWY_INLINE Vertex project(const Warp& w, float x, float y, float q) {
    const auto& m = w.m;
    const float d = m[12] * x + m[13] * y + m[14] * q + m[15];
    const float inverse = 1.0f / d;
    return {(m[0] * x + m[1] * y + m[2] * q + m[3]) * inverse,
            (m[4] * x + m[5] * y + m[6] * q + m[7]) * inverse,
            (m[8] * x + m[9] * y + m[10] * q + m[11]) * inverse, d > 0.0f};
}

struct Target {
    float* samples;
    std::size_t count;
    int side, stride;
    float qLimit;
    bool empty = true;  ///< nothing was drawn yet, and the samples are not cleared

    HWY_INLINE void clear() {
        if (!empty) return;
        std::memset(samples, 0, count * sizeof(float));
        empty = false;
    }
};

/// Fills a convex polygon that turns the right way. `grow` moves its edges out, in samples; with
/// kExtend only samples that no mesh holds are written.
template <int kCorners, bool kExtend>
HWY_INLINE void fillPolygon(Target& t, const Vertex* v, float grow, std::uint32_t bits) {
    for (int i = 0; i < kCorners; ++i)
        if (!v[i].front) return;
    float xMin = v[0].x, xMax = v[0].x, yMin = v[0].y, yMax = v[0].y, qMin = v[0].q, qMax = v[0].q;
    for (int i = 1; i < kCorners; ++i) {
        xMin = std::min(xMin, v[i].x);
        xMax = std::max(xMax, v[i].x);
        yMin = std::min(yMin, v[i].y);
        yMax = std::max(yMax, v[i].y);
        qMin = std::min(qMin, v[i].q);
        qMax = std::max(qMax, v[i].q);
    }
    const auto last = static_cast<float>(t.side - 1);
    const float fx0 = std::max(xMin - grow, 0.0f), fx1 = std::min(xMax + grow, last);
    const float fy0 = std::max(yMin - grow, 0.0f), fy1 = std::min(yMax + grow, last);
    if (!(fx0 <= fx1 && fy0 <= fy1) || !(qMin > 0.0f) || !(qMax <= t.qLimit)) return;
    const int x0 = static_cast<int>(std::ceil(fx0)), x1 = static_cast<int>(fx1);
    const int y0 = static_cast<int>(std::ceil(fy0)), y1 = static_cast<int>(fy1);
    if (x0 > x1 || y0 > y1) return;

    // Diagonals (or two sides) span the plane; its z component is twice the signed area.
    const Vertex& a = v[kCorners == 4 ? 2 : 1];
    const Vertex& b = v[kCorners == 4 ? 3 : 2];
    const Vertex& bBase = v[kCorners == 4 ? 1 : 0];
    const float ax = a.x - v[0].x, ay = a.y - v[0].y, aq = a.q - v[0].q;
    const float bx = b.x - bBase.x, by = b.y - bBase.y, bq = b.q - bBase.q;
    const float area = ax * by - ay * bx;
    if (!(area > 0.0f)) return;
    t.clear();
    const float inverseArea = 1.0f / area;
    const float px = (aq * by - ay * bq) * inverseArea, py = (ax * bq - aq * bx) * inverseArea;
    float cx = 0, cy = 0, cq = 0;
    for (int i = 0; i < kCorners; ++i) {
        cx += v[i].x;
        cy += v[i].y;
        cq += v[i].q;
    }
    constexpr float kShare = 1.0f / kCorners;
    const float p0 = cq * kShare - px * cx * kShare - py * cy * kShare;

    float ex[kCorners], ey[kCorners], e0[kCorners];
    for (int i = 0; i < kCorners; ++i) {
        const Vertex& from = v[i];
        const Vertex& to = v[(i + 1) % kCorners];
        ex[i] = from.y - to.y;
        ey[i] = to.x - from.x;
        e0[i] = -(ex[i] * from.x + ey[i] * from.y) + grow * (std::abs(ex[i]) + std::abs(ey[i]));
    }

    const hn::ScalableTag<float> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    using V = hn::Vec<decltype(d)>;
    const int n = static_cast<int>(hn::Lanes(d));
    const V steps = hn::ConvertTo(d, hn::Iota(hn::RebindToSigned<decltype(d)>(), 0));
    const V low = hn::Set(d, qMin), high = hn::Set(d, qMax), zero = hn::Zero(d);
    const auto tag = hn::BitCast(d, hn::Set(du, bits));
    const auto clean = hn::BitCast(d, hn::Set(du, ~3u));
    for (int x = x0; x <= x1; x += n) {
        const V vx = hn::Add(hn::Set(d, static_cast<float>(x)), steps);
        const auto inColumns = hn::Le(vx, hn::Set(d, static_cast<float>(x1)));
        V edge[kCorners];
        for (int i = 0; i < kCorners; ++i)
            edge[i] = hn::MulAdd(hn::Set(d, ex[i]), vx, hn::Set(d, e0[i]));
        const V plane = hn::MulAdd(hn::Set(d, px), vx, hn::Set(d, p0));
        for (int y = y0; y <= y1; ++y) {
            const V vy = hn::Set(d, static_cast<float>(y));
            V inside = hn::MulAdd(hn::Set(d, ey[0]), vy, edge[0]);
            for (int i = 1; i < kCorners; ++i)
                inside = hn::Min(inside, hn::MulAdd(hn::Set(d, ey[i]), vy, edge[i]));
            auto mask = hn::And(hn::Ge(inside, zero), inColumns);
            V q = hn::MulAdd(hn::Set(d, py), vy, plane);
            q = hn::Min(hn::Max(q, low), high);
            q = hn::Or(hn::And(q, clean), tag);
            float* out = t.samples + static_cast<std::ptrdiff_t>(y) * t.stride + x;
            const V old = hn::LoadU(d, out);
            mask = hn::And(mask, hn::Gt(q, old));
            if (kExtend) {
                const auto oldBits = hn::BitCast(du, old);
                const auto extension = hn::MaskFromVec(hn::BitCast(
                    d, hn::VecFromMask(du, hn::TestBit(oldBits, hn::Set(du, kExtensionBit)))));
                mask = hn::And(mask, hn::Or(hn::Eq(old, zero), extension));
            }
            hn::StoreU(hn::IfThenElse(mask, q, old), d, out);
        }
    }
}

HWY_INLINE void drawLeaf(Target& t, const Warp& warp, const Leaf& leaf, float grow) {
    const float n = leaf.size;
    const float x = leaf.x + 0.5f, y = leaf.y + 0.5f;
    const Vertex v[4] = {project(warp, x, y, leaf.q0),
                         project(warp, x + n, y, leaf.q0 + n * leaf.qx),
                         project(warp, x + n, y + n, leaf.q0 + n * (leaf.qx + leaf.qy)),
                         project(warp, x, y + n, leaf.q0 + n * leaf.qy)};
    fillPolygon<4, false>(t, v, grow, 0);
}

/// The corners of the cells of a block in the tile, row by row.
struct CellGrid {
    static constexpr int kSide = kBlock + 1;
    /// Whole vectors may be loaded from each corner on.
    static constexpr int kPitch = kBlock + 16;
    float x[kSide][kPitch], y[kSide][kPitch], q[kSide][kPitch], w[kSide][kPitch];
    bool allFront = true;

    [[nodiscard]] Vertex at(int i, int j) const {
        return {x[j][i], y[j][i], q[j][i], w[j][i] > 0.0f};
    }

    /// Row j: corners whose first is at (sx, sy) in the source; `depths` has kPitch values, `count`
    /// of which matter.
    HWY_INLINE void projectRow(const Warp& warp, int j, float sx, float sy, const float* depths,
                               int count) {
        const hn::ScalableTag<float> d;
        using V = hn::Vec<decltype(d)>;
        const int n = static_cast<int>(hn::Lanes(d));
        const auto& m = warp.m;
        const V steps = hn::ConvertTo(d, hn::Iota(hn::RebindToSigned<decltype(d)>(), 0));
        const V end = hn::Set(d, static_cast<float>(count));
        for (int i = 0; i < count; i += n) {
            const V vx = hn::Add(hn::Set(d, sx + static_cast<float>(i)), steps);
            const V vq = hn::LoadU(d, depths + i);
            const auto row = [&](int r) HWY_ATTR {
                return hn::MulAdd(
                    hn::Set(d, m[r]), vx,
                    hn::MulAdd(hn::Set(d, m[r + 2]), vq, hn::Set(d, m[r + 1] * sy + m[r + 3])));
            };
            const V denominator = row(12);
            const V inverse = hn::Div(hn::Set(d, 1.0f), denominator);
            hn::StoreU(hn::Mul(row(0), inverse), d, &x[j][i]);
            hn::StoreU(hn::Mul(row(4), inverse), d, &y[j][i]);
            hn::StoreU(hn::Mul(row(8), inverse), d, &q[j][i]);
            hn::StoreU(denominator, d, &w[j][i]);
            const V beyond = hn::Sub(end, hn::Set(d, static_cast<float>(i)));
            const auto front = hn::Or(hn::Gt(denominator, hn::Zero(d)), hn::Ge(steps, beyond));
            allFront = allFront && hn::AllTrue(d, front);
        }
    }

    /// Which cells of row j may show in the tile: those that reach into it and do not turn away
    /// whichever way they are drawn. All corners must be in front.
    [[nodiscard]] HWY_INLINE std::uint32_t showing(int j, const Target& t) const {
        const hn::ScalableTag<float> d;
        using V = hn::Vec<decltype(d)>;
        const int n = static_cast<int>(hn::Lanes(d));
        const V first = hn::Set(d, -kCrack),
                last = hn::Set(d, static_cast<float>(t.side - 1) + kCrack);
        std::uint32_t mask = 0;
        for (int i = 0; i < kBlock; i += n) {
            const V x00 = hn::LoadU(d, &x[j][i]), x10 = hn::LoadU(d, &x[j][i + 1]);
            const V x01 = hn::LoadU(d, &x[j + 1][i]), x11 = hn::LoadU(d, &x[j + 1][i + 1]);
            const V y00 = hn::LoadU(d, &y[j][i]), y10 = hn::LoadU(d, &y[j][i + 1]);
            const V y01 = hn::LoadU(d, &y[j + 1][i]), y11 = hn::LoadU(d, &y[j + 1][i + 1]);
            const auto least = [&](V a, V b, V c, V e)
                                   HWY_ATTR { return hn::Min(hn::Min(a, b), hn::Min(c, e)); };
            const auto most = [&](V a, V b, V c, V e)
                                  HWY_ATTR { return hn::Max(hn::Max(a, b), hn::Max(c, e)); };
            const auto inside = hn::And(hn::And(hn::Le(least(x00, x10, x01, x11), last),
                                                hn::Ge(most(x00, x10, x01, x11), first)),
                                        hn::And(hn::Le(least(y00, y10, y01, y11), last),
                                                hn::Ge(most(y00, y10, y01, y11), first)));
            // Twice the areas of the triangles that leave out one corner each.
            const auto area = [&](V ax, V ay, V bx, V by, V cx, V cy) HWY_ATTR {
                return hn::Sub(hn::Mul(hn::Sub(bx, ax), hn::Sub(cy, ay)),
                               hn::Mul(hn::Sub(by, ay), hn::Sub(cx, ax)));
            };
            const V facing =
                most(area(x00, y00, x10, y10, x11, y11), area(x00, y00, x11, y11, x01, y01),
                     area(x00, y00, x10, y10, x01, y01), area(x10, y10, x11, y11, x01, y01));
            const auto shows = hn::And(inside, hn::Ge(facing, hn::Zero(d)));
            std::uint8_t bits[8] = {};
            hn::StoreMaskBits(d, shows, bits);
            std::uint32_t lanes = 0;
            std::memcpy(&lanes, bits, sizeof(lanes));
            mask |= (lanes & ((1u << n) - 1)) << i;
        }
        return mask;
    }
};

/// Draws the cells of a block, whose first pixel is (x0, y0).
/// Meanwhile the block whose texels are `ahead` is fetched into the cache: memory cannot tell which
/// comes next.
HWY_NOINLINE void drawCells(Target& t, const Source& s, const Warp& warp, const SourceBlock& block,
                            const BlockTexels& texels, int x0, int y0, const BlockTexels& ahead) {
    CellGrid grid;
    const int xEnd = std::min(x0 + kBlock, s.width - 1), yEnd = std::min(y0 + kBlock, s.height - 1);
    std::uint32_t needed[CellGrid::kSide] = {};
    for (int j = 0; j < kBlock; ++j) {
        needed[j] |= block.cells[j];
        needed[j + 1] |= block.cells[j];
    }
    float depths[CellGrid::kPitch] = {};
    const int columns = xEnd - x0 + 1;
    for (int y = y0; y <= yEnd; ++y) {
        if (ahead.q) {
            hwy::Prefetch(ahead.q + ahead.at(0, y - y0));
            hwy::Prefetch(ahead.q + ahead.at(kBlock - 1, y - y0));
            hwy::Prefetch(ahead.info + ahead.at(0, y - y0));
        }
        if (!needed[y - y0]) continue;
        const float* q = texels.q + texels.at(0, y - y0);
        if (columns == CellGrid::kSide)  // by far most: a copy of fixed length is inlined
            std::memcpy(depths, q, CellGrid::kSide * sizeof(float));
        else
            std::copy_n(q, columns, depths);
        grid.projectRow(warp, y - y0, static_cast<float>(x0) + 0.5f, static_cast<float>(y) + 0.5f,
                        depths, columns);
    }
    for (int j = 0; j < kBlock; ++j) {
        std::uint32_t cells = block.cells[j];
        if (cells && grid.allFront) cells &= grid.showing(j, t);
        for (std::uint32_t left = cells; left; left &= left - 1) {
            const int i = __builtin_ctz(left);
            const Vertex v00 = grid.at(i, j), v10 = grid.at(i + 1, j);
            const Vertex v01 = grid.at(i, j + 1), v11 = grid.at(i + 1, j + 1);
            const std::uint32_t bits = cellNearEdge(texels, i, j) ? kNearEdgeBit : 0;
            const auto triangle = [&](const Vertex& a, const Vertex& b, const Vertex& c) HWY_ATTR {
                const Vertex corners[3] = {a, b, c};
                fillPolygon<3, false>(t, corners, kCrack, bits);
            };
            switch (cellShape(s, texels, i, j)) {
                case kQuadCell: {
                    const Vertex quad[4] = {v00, v10, v11, v01};
                    fillPolygon<4, false>(t, quad, kCrack, bits);
                    break;
                }
                case kFallingSplit:
                    triangle(v00, v10, v11);
                    triangle(v00, v11, v01);
                    break;
                case kRisingSplit:
                    triangle(v00, v10, v01);
                    triangle(v10, v11, v01);
                    break;
                case kUpperLeft:
                    triangle(v00, v10, v01);
                    break;
                case kUpperRight:
                    triangle(v10, v11, v00);
                    break;
                case kLowerRight:
                    triangle(v11, v01, v10);
                    break;
                case kLowerLeft:
                    triangle(v01, v00, v11);
                    break;
                default:
                    break;
            }
        }
    }
}

/// Draws the squares around the edge pixels of a block, whose first pixel is (x0, y0).
HWY_NOINLINE void drawExtensions(Target& t, const Source& s, const Warp& warp,
                                 const SourceBlock& block, const BlockTexels& texels, int x0,
                                 int y0) {
    for (int j = 0; j < kBlock; ++j) {
        for (std::uint32_t left = block.edges[j]; left; left &= left - 1) {
            const int i = __builtin_ctz(left);
            const int x = x0 + i, y = y0 + j;
            const float* at = texels.q + texels.at(i, j);
            const std::uint8_t* info = texels.info + texels.at(i, j);
            const float half =
                (*info & Info::kBesideBackground) ? kHalfBesideBackground : kHalfInside;
            const float q = *at;
            const glm::vec2 g = gradientFrom(at, info, 1, texels.stride, x > 0, y > 0) * half;
            const float reach = kExtensionReach * s.space.axis.relativeScale(q);
            const auto corner = [&](float sx, float sy) {
                const float dq = std::clamp(g.x * sx + g.y * sy, -reach, reach);
                return project(warp, static_cast<float>(x) + 0.5f + sx * half,
                               static_cast<float>(y) + 0.5f + sy * half, q + dq);
            };
            const Vertex v[4] = {corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)};
            fillPolygon<4, true>(t, v, kCrack, kExtensionBit | kNearEdgeBit);
        }
    }
}

bool RasteriseSource(const Source& s, const Warp& warp, std::span<const std::uint32_t> blocks,
                     const SampleGrid& grid, float qLimit, float* samples) {
    Target t{samples, grid.count(), grid.side(), grid.stride(), qLimit};
    BlockBuffer buffer;
    const float leafGrow = kLeafGrow * static_cast<float>(grid.perPixel);
    const auto corner = [&](std::uint32_t index) {
        return glm::ivec2(static_cast<int>(index % s.blocksX),
                          static_cast<int>(index / s.blocksX)) *
               kBlock;
    };
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        const SourceBlock& block = s.blocks[blocks[k]];
        for (std::uint32_t i = block.leafBegin; i < block.leafEnd; ++i)
            drawLeaf(t, warp, s.leaves[i], leafGrow);
        if (!block.anyCell) continue;
        // Texels of a view that fills its page stay where they are.
        BlockTexels ahead;
        if (s.whole && k + 1 < blocks.size() && s.blocks[blocks[k + 1]].anyCell) {
            const glm::ivec2 next = corner(blocks[k + 1]);
            ahead = blockTexels(s, next.x, next.y, buffer);
        }
        const glm::ivec2 at = corner(blocks[k]);
        drawCells(t, s, warp, block, blockTexels(s, at.x, at.y, buffer), at.x, at.y, ahead);
    }
    for (const std::uint32_t index : blocks) {
        const SourceBlock& block = s.blocks[index];
        if (!block.anyEdge) continue;
        const glm::ivec2 at = corner(index);
        drawExtensions(t, s, warp, block, blockTexels(s, at.x, at.y, buffer), at.x, at.y);
    }
    return !t.empty;
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::surface {

HWY_EXPORT(RasteriseSource);

bool rasteriseSource(const Source& source, const Warp& sampleFromSource,
                     std::span<const std::uint32_t> blocks, const SampleGrid& grid, float qLimit,
                     float* samples) {
    return HWY_DYNAMIC_DISPATCH(RasteriseSource)(source, sampleFromSource, blocks, grid, qLimit,
                                                 samples);
}

}  // namespace stx::surface
#endif
