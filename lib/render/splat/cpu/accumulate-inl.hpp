// Where points are in the picture. Compiled for each SIMD target: included by kernels.cpp
// once for each.

#if defined(STX_SPLAT_LAND_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_SPLAT_LAND_INL_HPP
#undef STX_SPLAT_LAND_INL_HPP
#else
#define STX_SPLAT_LAND_INL_HPP
#endif

#include <hwy/highway.h>

#include "lib/geometry/row_map-inl.hpp"
#include "lib/render/splat/cpu/kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::splat::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using stx::HWY_NAMESPACE::bitsOf;
using stx::HWY_NAMESPACE::DF;
using stx::HWY_NAMESPACE::DI;
using stx::HWY_NAMESPACE::kInfinity;
using stx::HWY_NAMESPACE::kRowPixels;
using stx::HWY_NAMESPACE::loadDepth;
using stx::HWY_NAMESPACE::RowMap;

static_assert(kBlock == kRowPixels);

using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;

// Points of a row and their places: the pixel to the upper left of each (only where `inside`
// the region), how far into the next it lies (0..1), its novel depth.
struct Projection {
    VI offset;
    VF x, y, fx, fy, z;
    VF a[3], inverse;  // H = a z + ..., and 1 / H.z (1 when orthographic)
    hn::Mask<DF> inFront, inside;
};

HWY_INLINE Projection project(DF d, const RowMap& m, int i, VF z, const Region& region) {
    const VF index = hn::Add(hn::Iota(d, 0), hn::Set(d, static_cast<float>(i)));
    Projection out;
    const auto h = [&](int k) HWY_ATTR {
        out.a[k] = hn::MulAdd(index, hn::Set(d, m.au[k]), hn::Set(d, m.a[k]));
        const VF b = hn::MulAdd(index, hn::Set(d, m.bu[k]), hn::Set(d, m.b[k]));
        return hn::MulAdd(out.a[k], z, b);
    };
    out.x = h(0);
    out.y = h(1);
    out.z = h(2);
    out.inverse = hn::Set(d, 1.0f);
    if (!region.orthographic) {
        out.inverse = hn::Div(out.inverse, out.z);
        out.x = hn::Mul(out.x, out.inverse);
        out.y = hn::Mul(out.y, out.inverse);
    }
    const VF x0 = hn::Floor(out.x), y0 = hn::Floor(out.y);
    // Comparisons with NaN are false, which takes care of pixels without a point.
    out.inFront = hn::And(hn::Gt(out.z, hn::Set(d, kNearest)), hn::Lt(z, hn::Set(d, kInfinity)));
    out.inside = hn::And(hn::And(hn::And(hn::Ge(x0, hn::Set(d, float(region.left - 1))),
                                         hn::Lt(x0, hn::Set(d, float(region.left + region.width)))),
                                 hn::And(hn::Ge(y0, hn::Set(d, float(region.top - 1))),
                                         hn::Lt(y0, hn::Set(d, float(region.top + region.rows))))),
                         out.inFront);
    const DI di;
    // Zero where outside, so that conversions and gathers stay in range.
    const VF xs = hn::IfThenElse(out.inside, x0, hn::Set(d, float(region.left)));
    const VF ys = hn::IfThenElse(out.inside, y0, hn::Set(d, float(region.top)));
    const VI row = hn::Sub(hn::ConvertTo(di, ys), hn::Set(di, region.top - 1));
    out.offset = hn::Add(hn::Mul(row, hn::Set(di, region.stride)),
                         hn::Sub(hn::ConvertTo(di, xs), hn::Set(di, region.left - 1)));
    out.fx = hn::Sub(out.x, x0);
    out.fy = hn::Sub(out.y, y0);
    return out;
}

// Alpha of up to a vector of pixels, 0..255.
HWY_INLINE VF alphaOf(DF d, const RectangleImages& s, std::size_t pixel, int count) {
    HWY_ALIGN float alpha[kBlock];
    const int lanes = static_cast<int>(hn::Lanes(d));
    for (int i = 0; i < lanes; ++i) {
        if (i >= count)
            alpha[i] = 0;
        else if (s.rgba8)
            alpha[i] = s.rgba8[4 * (pixel + i) + 3];
        else
            alpha[i] = s.rgbaFloat[4 * (pixel + i) + 3] * 255.0f;
    }
    return hn::Load(d, alpha);
}

// Whether a point of such an alpha hides what is behind it.
HWY_INLINE hn::Mask<DF> hides(DF d, VF alpha) {
    return hn::Ge(alpha, hn::Set(d, 255.0f * kHides));
}

}  // namespace stx::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
