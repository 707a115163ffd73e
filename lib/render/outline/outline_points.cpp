#include "lib/render/outline/outline_points.hpp"

#include <hwy/cache_control.h>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/outline/outline_points.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include "lib/geometry/row_map-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Points this far beside a pixel's centre, along the outline, tell where it runs; pixels. Chosen
/// by trial on the project's image sets and meshes.
constexpr float kBeside = 0.6f;
/// Points this far to the left or right of it tell, pixels.
constexpr float kAside = 1.5f;

/// Adds a point to four pixels of a row, from `first` on; it lies (dx, dy) from the first one's
/// centre.
HWY_INLINE void addToRow(const OutlineRows& rows, std::size_t first, float dx, float dy) {
#if HWY_TARGET == HWY_SCALAR
    const hn::CappedTag<float, 1> d;
#else
    const hn::FixedTag<float, 4> d;
#endif
    for (std::size_t k = 0; k < 4; k += hn::Lanes(d)) {
        const auto nx = hn::LoadU(d, rows.outX + first + k);
        const auto ny = hn::LoadU(d, rows.outY + first + k);
        const auto high = hn::LoadU(d, rows.high + first + k);
        const auto low = hn::LoadU(d, rows.low + first + k);
        const auto count = hn::LoadU(d, rows.count + first + k);
        const auto x = hn::Sub(hn::Set(d, dx - static_cast<float>(k)), hn::Iota(d, 0));
        const auto y = hn::Set(d, dy);
        const auto along = hn::MulAdd(nx, x, hn::Mul(ny, y));
        const auto aside = hn::Abs(hn::NegMulAdd(ny, x, hn::Mul(nx, y)));
        // Whether some pixel around is asked for.
        const auto in =
            hn::And(hn::Le(aside, hn::Set(d, kBeside)), hn::Le(hn::Abs(x), hn::Set(d, kAside)));
        hn::StoreU(hn::IfThenElse(in, hn::Max(high, along), high), d, rows.high + first + k);
        hn::StoreU(hn::IfThenElse(in, hn::Min(low, along), low), d, rows.low + first + k);
        hn::StoreU(hn::Add(count, hn::IfThenElseZero(in, hn::Set(d, 1.0f))), d,
                   rows.count + first + k);
    }
}

void addPointsImpl(const OutlineBlock& block, const OutlineDepths& depths, const PixelMap& m,
                   bool orthographic, const OutlineBlock& next, const OutlineDepths& nextDepths,
                   const OutlineRows& rows) {
    const DF d;
    const hn::RebindToSigned<decltype(d)> di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    HWY_ALIGN float px[kOutlineBlock], py[kOutlineBlock];
    HWY_ALIGN std::int32_t column[kOutlineBlock], row[kOutlineBlock];
    HWY_ALIGN std::int32_t place[kOutlineBlock], beside[kOutlineBlock];
    const auto set = [&](float v) HWY_ATTR { return hn::Set(d, v); };
    const auto width = static_cast<float>(rows.width), height = static_cast<float>(rows.rows);
    const int count = block.u1 - block.u0;
    for (int v = block.v0; v < block.v1; ++v) {
        // Memory cannot tell what comes next from rows of 16 pixels that are thousands of bytes
        // apart.
        if (const int ahead = next.v0 + v - block.v0; nextDepths.first && ahead < next.v1)
            hwy::Prefetch(nextDepths.first + static_cast<std::size_t>(ahead) * nextDepths.stride +
                          next.u1 - 1);
        const std::uint32_t solid = block.solid[v - block.v0];
        if (!solid) continue;
        const float* depth = depths.first + static_cast<std::size_t>(v) * depths.stride + block.u0;
        const RowMap map(m, block.u0, v);
        for (int i = 0; i < count; i += lanes) {
            const auto z = loadDepth(d, depth + i, count - i);
            const auto index = hn::Add(hn::Iota(d, 0), set(static_cast<float>(i)));
            const auto h = [&](int k) HWY_ATTR {
                return hn::MulAdd(hn::MulAdd(index, set(map.au[k]), set(map.a[k])), z,
                                  hn::MulAdd(index, set(map.bu[k]), set(map.b[k])));
            };
            const auto along = h(2);
            const auto w = orthographic ? set(1.0f) : hn::Div(set(1.0f), along);
            const auto x = hn::Sub(hn::Mul(h(0), w), set(static_cast<float>(rows.left)));
            const auto y = hn::Sub(hn::Mul(h(1), w), set(static_cast<float>(rows.top)));
            // Comparisons with NaN are false.
            const auto inside =
                hn::And(hn::And(hn::Gt(along, hn::Zero(d)),
                                hn::And(hn::Ge(x, set(-0.5f)), hn::Lt(x, set(width - 0.5f)))),
                        hn::And(hn::Ge(y, set(-1.5f)), hn::Lt(y, set(height + 0.5f))));
            if (hn::AllFalse(d, inside)) continue;
            // From the upper left corner of the border.
            const auto whole = [&](auto value) HWY_ATTR {
                return hn::ConvertTo(di, hn::IfThenElseZero(inside, hn::Add(value, set(1.5f))));
            };
            const auto toX = whole(x), toY = whole(y);
            const auto at = hn::Add(hn::Mul(toY, hn::Set(di, rows.stride)), toX);
            // Most points are beside nothing that is asked for. Gathers read four bytes each.
            const auto near =
                hn::And(hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(rows.near), at),
                        hn::Set(di, 0xff));
            const auto asking = hn::RebindMask(d, hn::Gt(near, hn::Zero(di)));
            std::uint32_t points = bitsOf(d, hn::And(inside, asking)) & (solid >> i);
            if (!points) continue;
            hn::Store(x, d, px);
            hn::Store(y, d, py);
            hn::Store(toX, di, column);
            hn::Store(toY, di, row);
            hn::Store(at, di, place);
            hn::Store(near, di, beside);
            for (; points; points &= points - 1) {
                const int k = __builtin_ctz(points);
                for (auto asked = static_cast<std::uint32_t>(beside[k]); asked;
                     asked &= asked - 1) {
                    const int below = __builtin_ctz(asked) - 1;
                    addToRow(rows, static_cast<std::size_t>(place[k] + below * rows.stride - 1),
                             px[k] - static_cast<float>(column[k] - 2),
                             py[k] - static_cast<float>(row[k] + below - 1));
                }
            }
        }
    }
}

}  // namespace stx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx {

HWY_EXPORT(addPointsImpl);

void addOutlinePoints(const OutlineBlock& block, const OutlineDepths& depths, const PixelMap& m,
                      bool orthographic, const OutlineBlock& next, const OutlineDepths& nextDepths,
                      const OutlineRows& rows) {
    HWY_DYNAMIC_DISPATCH(addPointsImpl)
    (block, depths, m, orthographic, next, nextDepths, rows);
}

}  // namespace stx
#endif
