// Convex polygons of four corners, as many at once as a vector takes, drawn into the samples of a
// tile. Included by raster.cpp once for each SIMD target.

#if defined(STX_SURFACE_POLYGONS_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_SURFACE_POLYGONS_INL_HPP
#undef STX_SURFACE_POLYGONS_INL_HPP
#else
#define STX_SURFACE_POLYGONS_INL_HPP
#endif

#include <algorithm>
#include <bit>
#include <cstring>

#include <hwy/highway.h>

#include "lib/render/surface/cpu/raster.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, 16>;
using BitTag = hn::RebindToUnsigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;
using Bits = hn::Vec<BitTag>;
using FloatMask = hn::Mask<FloatTag>;
inline constexpr int kLanes = 16;  // at most

HWY_INLINE std::uint32_t bitsOf(FloatMask mask) {
    const FloatTag d;
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    std::uint32_t bits = 0;
    std::memcpy(&bits, bytes, sizeof(bits));
    return bits & static_cast<std::uint32_t>((std::uint64_t{1} << hn::Lanes(d)) - 1);
}

struct Target {
    float* samples;
    std::size_t count;
    int side, stride;
    float qLimit;
    bool inverse;     ///< DepthAxis::inverse of the frame
    Squares squares;  ///< that are asked for
    float squaresPerSample;
    float edgeGrow;     ///< by which what is near an edge of its source is larger, samples
    bool empty = true;  ///< nothing was drawn yet, and the samples are not cleared

    HWY_INLINE void clear() {
        if (!empty) return;
        empty = false;
        if (squares == kAllSquares) {
            std::memset(samples, 0, count * sizeof(float));
            return;
        }
        const int rows = side / 8;
        for (int y = 0; y < 8; ++y)
            if (squares >> (8 * y) & 0xff)
                std::memset(samples + static_cast<std::ptrdiff_t>(y) * rows * stride, 0,
                            static_cast<std::size_t>(rows) * stride * sizeof(float));
    }

    /// The squares that hold the samples (x0, y0) to (x1, y1), which lie in the tile.
    [[nodiscard]] HWY_INLINE Squares squaresFrom(float x0, float y0, float x1, float y1) const {
        const auto square = [&](float at) {
            return std::min(static_cast<int>(at * squaresPerSample), 7);
        };
        return squaresBetween(square(x0), square(y0), square(x1), square(y1));
    }
};

/// Where polygons were drawn, in samples.
struct Extent {
    Floats x0, y0, x1, y1;

    HWY_INLINE Extent() {
        const FloatTag d;
        x0 = y0 = hn::Set(d, 1e9f);
        x1 = y1 = hn::Set(d, -1e9f);
    }
    HWY_INLINE void add(FloatMask mask, Floats left, Floats top, Floats right, Floats bottom) {
        x0 = hn::IfThenElse(mask, hn::Min(x0, left), x0);
        y0 = hn::IfThenElse(mask, hn::Min(y0, top), y0);
        x1 = hn::IfThenElse(mask, hn::Max(x1, right), x1);
        y1 = hn::IfThenElse(mask, hn::Max(y1, bottom), y1);
    }
};

/// Polygons that turn the right way, one in each lane; those of three corners end where they begin.
struct Polygons {
    Floats x[4], y[4], q[4];
    FloatMask there;
    Floats grow;  ///< by which their edges move out, samples
    Bits flags;
};

/// What filling them needs: the samples x0..x1, y0..y1 of each, the plane p0 + px x + py y within
/// low..high, and edges: inside of edge i is where e0[i] + ex[i] x + ey[i] y is not below 0.
struct Planes {
    Floats x0, y0, x1, y1;
    Floats px, py, p0, low, high;
    Floats ex[4], ey[4], e0[4];
    Floats behind;  ///< with kExtend: samples below it may be covered
    Bits flags;
};

/// Planes of which each lane can be asked.
struct Filling {
    alignas(64) float x0[kLanes], y0[kLanes], x1[kLanes], y1[kLanes];
    alignas(64) float px[kLanes], py[kLanes], p0[kLanes], low[kLanes], high[kLanes];
    alignas(64) float ex[4][kLanes], ey[4][kLanes], e0[4][kLanes];
    alignas(64) std::uint32_t flags[kLanes];
    alignas(64) float behind[kLanes];
};

template <bool kExtend>
HWY_INLINE void fillPolygon(const Target& t, const Filling& f, int l) {
    const FloatTag d;
    const BitTag du;
    const int n = static_cast<int>(hn::Lanes(d));
    const Floats steps = hn::ConvertTo(d, hn::Iota(hn::RebindToSigned<FloatTag>(), 0));
    const Floats low = hn::Set(d, f.low[l]), high = hn::Set(d, f.high[l]), zero = hn::Zero(d);
    const Floats limit = hn::Set(d, t.qLimit);
    const Floats tag = hn::BitCast(d, hn::Set(du, f.flags[l]));
    const Floats clean = hn::BitCast(d, hn::Set(du, ~std::uint32_t{kSampleFlags}));
    const int x0 = static_cast<int>(f.x0[l]), x1 = static_cast<int>(f.x1[l]);
    const int y0 = static_cast<int>(f.y0[l]), y1 = static_cast<int>(f.y1[l]);
    for (int x = x0; x <= x1; x += n) {
        const Floats vx = hn::Add(hn::Set(d, static_cast<float>(x)), steps);
        const FloatMask inColumns = hn::Le(vx, hn::Set(d, f.x1[l]));
        Floats edge[4];
        for (int i = 0; i < 4; ++i)
            edge[i] = hn::MulAdd(hn::Set(d, f.ex[i][l]), vx, hn::Set(d, f.e0[i][l]));
        const Floats plane = hn::MulAdd(hn::Set(d, f.px[l]), vx, hn::Set(d, f.p0[l]));
        for (int y = y0; y <= y1; ++y) {
            const Floats vy = hn::Set(d, static_cast<float>(y));
            Floats inside = hn::MulAdd(hn::Set(d, f.ey[0][l]), vy, edge[0]);
            for (int i = 1; i < 4; ++i)
                inside = hn::Min(inside, hn::MulAdd(hn::Set(d, f.ey[i][l]), vy, edge[i]));
            FloatMask mask = hn::And(hn::Ge(inside, zero), inColumns);
            Floats q = hn::MulAdd(hn::Set(d, f.py[l]), vy, plane);
            q = hn::Min(hn::Max(q, low), high);
            mask = hn::And(mask, hn::Le(q, limit));
            q = hn::Or(hn::And(q, clean), tag);
            float* out = t.samples + static_cast<std::ptrdiff_t>(y) * t.stride + x;
            const Floats old = hn::LoadU(d, out);
            mask = hn::And(mask, hn::Gt(q, old));
            if (kExtend) {
                const Bits oldBits = hn::BitCast(du, old);
                const auto extension = hn::MaskFromVec(hn::BitCast(
                    d, hn::VecFromMask(du, hn::TestBit(oldBits, hn::Set(du, kExtensionBit)))));
                const auto behind = hn::Lt(old, hn::Set(d, f.behind[l]));
                mask = hn::And(mask, hn::Or(hn::Or(hn::Eq(old, zero), behind), extension));
            }
            hn::StoreU(hn::IfThenElse(mask, q, old), d, out);
        }
    }
}

HWY_INLINE Floats leastOf(const Floats* v) {
    return hn::Min(hn::Min(v[0], v[1]), hn::Min(v[2], v[3]));
}
HWY_INLINE Floats mostOf(const Floats* v) {
    return hn::Max(hn::Max(v[0], v[1]), hn::Max(v[2], v[3]));
}
HWY_INLINE Floats totalOf(const Floats* v) {
    return hn::Add(hn::Add(v[0], v[1]), hn::Add(v[2], v[3]));
}

/// The diagonals of a polygon, which span its plane.
struct Diagonals {
    Floats ax, ay, aq, bx, by, bq;

    explicit HWY_INLINE Diagonals(const Polygons& p)
        : ax(hn::Sub(p.x[2], p.x[0])),
          ay(hn::Sub(p.y[2], p.y[0])),
          aq(hn::Sub(p.q[2], p.q[0])),
          bx(hn::Sub(p.x[3], p.x[1])),
          by(hn::Sub(p.y[3], p.y[1])),
          bq(hn::Sub(p.q[3], p.q[1])) {}
    /// Twice the area of a polygon; above 0 where its corners turn the right way.
    [[nodiscard]] HWY_INLINE Floats area() const {
        return hn::Sub(hn::Mul(ax, by), hn::Mul(ay, bx));
    }
};

/// Planes and edges. x0..y1, low and high are there already.
HWY_INLINE void addPlanes(const Target& t, const Polygons& p, const Diagonals& g, Floats area,
                          bool extend, Planes& out) {
    const FloatTag d;
    const BitTag du;
    const Floats inverseArea = hn::Div(hn::Set(d, 1.0f), area);
    out.px = hn::Mul(hn::Sub(hn::Mul(g.aq, g.by), hn::Mul(g.ay, g.bq)), inverseArea);
    out.py = hn::Mul(hn::Sub(hn::Mul(g.ax, g.bq), hn::Mul(g.aq, g.bx)), inverseArea);
    out.p0 = hn::Mul(
        hn::Set(d, 0.25f),
        hn::NegMulAdd(out.px, totalOf(p.x), hn::NegMulAdd(out.py, totalOf(p.y), totalOf(p.q))));
    for (int i = 0; i < 4; ++i) {
        const int next = (i + 1) % 4;
        out.ex[i] = hn::Sub(p.y[i], p.y[next]);
        out.ey[i] = hn::Sub(p.x[next], p.x[i]);
        const Floats from = hn::MulAdd(out.ex[i], p.x[i], hn::Mul(out.ey[i], p.y[i]));
        out.e0[i] = hn::MulSub(p.grow, hn::Add(hn::Abs(out.ex[i]), hn::Abs(out.ey[i])), from);
    }
    out.flags = hn::And(p.flags, hn::Set(du, std::uint32_t{kSampleFlags}));
    out.behind = hn::Zero(d);
    if (extend) {
        const auto flagged = [&](std::uint32_t bit) HWY_ATTR {
            return hn::RebindMask(d, hn::TestBit(p.flags, hn::Set(du, bit)));
        };
        const auto covers = flagged(kCoversBit);
        const Floats apart =
            hn::IfThenElse(flagged(kRimBit), hn::Set(d, kBehindRim), hn::Set(d, kLinkedSamples));
        out.behind = hn::IfThenElseZero(
            covers, hn::Sub(out.low, t.inverse ? hn::Mul(apart, out.low) : apart));
    }
}

/// Draws polygons of up to 2x2 samples: each of them in all polygons at once.
template <bool kExtend>
HWY_INLINE void drawSmall(const Target& t, const Planes& f, FloatMask small) {
    const FloatTag d;
    const BitTag du;
    const hn::RebindToSigned<FloatTag> di;
    const Floats zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    alignas(64) float values[kLanes], behind[kLanes];
    alignas(64) std::int32_t places[kLanes];
    hn::Store(f.behind, d, behind);
    const Floats clean = hn::BitCast(d, hn::Set(du, ~std::uint32_t{kSampleFlags}));
    for (int k = 0; k < 4; ++k) {
        const Floats x = k & 1 ? hn::Add(f.x0, one) : f.x0, y = k & 2 ? hn::Add(f.y0, one) : f.y0;
        FloatMask here = hn::And(small, hn::And(hn::Le(x, f.x1), hn::Le(y, f.y1)));
        for (int i = 0; i < 4; ++i) {
            const Floats inside = hn::MulAdd(f.ex[i], x, hn::MulAdd(f.ey[i], y, f.e0[i]));
            here = hn::And(here, hn::Ge(inside, zero));
        }
        Floats q = hn::MulAdd(f.px, x, hn::MulAdd(f.py, y, f.p0));
        q = hn::Min(hn::Max(q, f.low), f.high);
        std::uint32_t left = bitsOf(hn::And(here, hn::Le(q, hn::Set(d, t.qLimit))));
        if (!left) continue;
        hn::Store(hn::Or(hn::And(q, clean), hn::BitCast(d, f.flags)), d, values);
        const auto place = hn::MulAdd(y, hn::Set(d, static_cast<float>(t.stride)), x);
        hn::Store(hn::ConvertTo(di, place), di, places);
        for (; left; left &= left - 1) {
            const int l = std::countr_zero(left);
            float& old = t.samples[places[l]];
            if (kExtend && old != 0.0f && !(old < behind[l]) &&
                !(std::bit_cast<std::uint32_t>(old) & kExtensionBit))
                continue;
            old = std::max(old, values[l]);
        }
    }
}

HWY_INLINE void storePlanes(const Planes& from, Filling& to) {
    const FloatTag d;
    hn::Store(from.behind, d, to.behind);
    hn::Store(from.x0, d, to.x0);
    hn::Store(from.y0, d, to.y0);
    hn::Store(from.x1, d, to.x1);
    hn::Store(from.y1, d, to.y1);
    hn::Store(from.px, d, to.px);
    hn::Store(from.py, d, to.py);
    hn::Store(from.p0, d, to.p0);
    hn::Store(from.low, d, to.low);
    hn::Store(from.high, d, to.high);
    for (int i = 0; i < 4; ++i) {
        hn::Store(from.ex[i], d, to.ex[i]);
        hn::Store(from.ey[i], d, to.ey[i]);
        hn::Store(from.e0[i], d, to.e0[i]);
    }
    hn::Store(from.flags, BitTag(), to.flags);
}

/// Draws polygons. With kExtend only samples that no mesh holds are written, and with kCoversBit
/// those of meshes behind.
template <bool kExtend>
HWY_INLINE void drawPolygons(Target& t, const Polygons& p, Extent& extent) {
    const FloatTag d;
    const Floats zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    const Floats last = hn::Set(d, static_cast<float>(t.side - 1));
    const Floats fx0 = hn::Max(hn::Sub(leastOf(p.x), p.grow), zero);
    const Floats fy0 = hn::Max(hn::Sub(leastOf(p.y), p.grow), zero);
    const Floats fx1 = hn::Min(hn::Add(mostOf(p.x), p.grow), last);
    const Floats fy1 = hn::Min(hn::Add(mostOf(p.y), p.grow), last);
    Planes f;
    f.low = leastOf(p.q);
    f.high = mostOf(p.q);
    const Diagonals diagonals(p);
    const Floats area = diagonals.area();
    FloatMask mask = hn::And(hn::And(p.there, hn::Gt(area, zero)),
                             hn::And(hn::Gt(f.low, zero), hn::Le(f.low, hn::Set(d, t.qLimit))));
    mask = hn::And(mask, hn::And(hn::Le(fx0, fx1), hn::Le(fy0, fy1)));
    if (hn::AllFalse(d, mask)) return;
    extent.add(mask, fx0, fy0, fx1, fy1);
    f.x0 = hn::Ceil(fx0);
    f.y0 = hn::Ceil(fy0);
    f.x1 = hn::Floor(fx1);
    f.y1 = hn::Floor(fy1);
    mask = hn::And(mask, hn::And(hn::Le(f.x0, f.x1), hn::Le(f.y0, f.y1)));
    if (hn::AllFalse(d, mask)) return;
    t.clear();

    addPlanes(t, p, diagonals, area, kExtend, f);
    const FloatMask small =
        hn::And(mask, hn::And(hn::Le(hn::Sub(f.x1, f.x0), one), hn::Le(hn::Sub(f.y1, f.y0), one)));
    if (!hn::AllFalse(d, small)) drawSmall<kExtend>(t, f, small);
    std::uint32_t large = bitsOf(hn::AndNot(small, mask));
    if (!large) return;
    Filling filling;
    storePlanes(f, filling);
    for (; large; large &= large - 1) {
        const int l = std::countr_zero(large);
        if (t.squares == kAllSquares ||
            (t.squares & t.squaresFrom(filling.x0[l], filling.y0[l], filling.x1[l], filling.y1[l])))
            fillPolygon<kExtend>(t, filling, l);
    }
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
