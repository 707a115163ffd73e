// The size and shape of splats in the picture. Included by kernels.cpp once for each SIMD
// target.

#if defined(STX_SPLAT_SHAPE_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_SPLAT_SHAPE_INL_HPP
#undef STX_SPLAT_SHAPE_INL_HPP
#else
#define STX_SPLAT_SHAPE_INL_HPP
#endif

#include <cstring>

#include <hwy/highway.h>

#include "lib/render/splat/cpu/accumulate-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::splat::HWY_NAMESPACE {

// The splats of some neighbouring pixels.
struct Splats {
    Projection at;
    hn::Mask<DF> small, large;
    VF slopeX, slopeY;  // of novel depth, relative, per pixel
    VF core2;           // of small ones, squared pixels
    VF quality;
    VF qxx, qxy, qyy;  // of large ones: squared deviations = qxx dx^2 + 2 qxy dx dy + qyy dy^2
    VF halfX, halfY;   // of their bounding boxes
    // Half the source pixels that go by per output pixel; zero where colour must not be continued.
    VF uAcross, vAcross, uDown, vDown;
};

// Slopes and their flags of up to a vector of pixels, u in the lower half of each lane.
HWY_INLINE VI packedSlopes(const RectangleImages& s, std::size_t pixel, int count) {
    const DI di;
    static_assert(sizeof(Slope) == 4 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
    if (count >= static_cast<int>(hn::Lanes(di)))
        return hn::LoadU(di, reinterpret_cast<const std::int32_t*>(s.slopes + pixel));
    HWY_ALIGN std::int32_t padded[kBlock] = {};
    std::memcpy(padded, s.slopes + pixel, static_cast<std::size_t>(count) * sizeof(Slope));
    return hn::Load(di, padded);
}

// Which of the pixels of a block with glass are glass, or opaque.
HWY_INLINE hn::Mask<DF> glassOf(DF d, const RectangleImages& s, std::size_t pixel, int count) {
    const VI packed = packedSlopes(s, pixel, count);
    return hn::RebindMask(d, hn::TestBit(packed, hn::Set(DI(), Slope::kGlass)));
}

// Slopes, sizes and links of up to a vector of pixels.
HWY_INLINE void loadShape(DF d, const RectangleImages& s, std::size_t pixel, int count, VF& u,
                          VF& v, VF& size, hn::Mask<DF>& linked, hn::Mask<DF>& rim) {
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const VI packed = packedSlopes(s, pixel, count);
    u = hn::ConvertTo(d, hn::ShiftRight<16>(hn::ShiftLeft<16>(packed)));
    v = hn::ConvertTo(d, hn::ShiftRight<16>(packed));
    linked = hn::RebindMask(d, hn::TestBit(packed, hn::Set(di, Slope::kLinked)));
    rim = hn::RebindMask(d, hn::TestBit(packed, hn::Set(di, Slope::kRim << 16)));
    size = hn::Set(d, 1.0f);
    if (s.sizes) {
        HWY_ALIGN float sizes[kBlock];
        for (int i = 0; i < lanes; ++i)
            sizes[i] = i < count ? s.sizes[pixel + i] * (1.0f / 64.0f) : 1.0f;
        size = hn::Load(d, sizes);
    }
}

// Whether the splats of some points may touch the region.
HWY_INLINE bool reachesRegion(DF d, const Projection& at, float reach, const Region& region) {
    const auto within = [&](VF v, int first, int count) HWY_ATTR {
        return hn::And(hn::Ge(v, hn::Set(d, float(first) - reach)),
                       hn::Le(v, hn::Set(d, float(first + count - 1) + reach)));
    };
    return !hn::AllFalse(d, hn::And(at.inFront, hn::And(within(at.x, region.left, region.width),
                                                        within(at.y, region.top, region.rows))));
}

// Which halves of a block's row are drawn: a bit for the left one and one for the right one.
HWY_INLINE unsigned halvesOf(const BlockTask& t, int row) {
    return (row < kBlock / 2 ? t.quarters : t.quarters >> 2) & 3u;
}

// The lanes that lie in those halves, from pixel `i` of the row on.
HWY_INLINE hn::Mask<DF> lanesOf(DF d, unsigned halves, int i) {
    const VF index = hn::Add(hn::Iota(d, 0), hn::Set(d, static_cast<float>(i)));
    constexpr float kHalf = kBlock / 2;
    return hn::And(hn::Ge(index, hn::Set(d, halves & 1 ? 0.0f : kHalf)),
                   hn::Lt(index, hn::Set(d, halves & 2 ? 2 * kHalf : kHalf)));
}

// All points of the block are small and share its tilt.
HWY_INLINE void setUniform(DF d, const BlockTask& t, Splats& out) {
    out.small = out.at.inside;
    out.large = hn::Lt(hn::Zero(d), hn::Zero(d));
    out.slopeX = hn::Set(d, t.slopeX);
    out.slopeY = hn::Set(d, t.slopeY);
    out.core2 = hn::Set(d, t.core2);
    out.quality = hn::Set(d, t.quality * t.density);
    out.uAcross = hn::Set(d, t.uAcross);
    out.vAcross = hn::Set(d, t.vAcross);
    out.uDown = hn::Set(d, t.uDown);
    out.vDown = hn::Set(d, t.vDown);
}

// Derivatives of the place in the picture by those in the source.
struct Jacobian {
    VF xu, yu, xv, yv;
};

// Weights and the steps of colours. `linked`: the surface goes on to all sides.
HWY_INLINE void setColour(DF d, const BlockTask& t, hn::Mask<DF> linked, hn::Mask<DF> seen,
                          const Jacobian& by, VF det, Splats& out) {
    const VF one = hn::Set(d, 1.0f);
    const auto square = [](VF x, VF y) HWY_ATTR { return hn::MulAdd(x, x, hn::Mul(y, y)); };
    const VF density =
        hn::Div(one, hn::Max(one, hn::Max(square(by.xu, by.yu), square(by.xv, by.yv))));
    out.quality = hn::Mul(
        hn::Mul(hn::Set(d, t.quality), hn::IfThenElse(linked, one, hn::Set(d, kEdgeQuality))),
        hn::Max(hn::Mul(density, density), hn::Set(d, kLeastDensity)));
    const VF fade = hn::IfThenElseZero(
        linked, hn::Min(one, hn::Max(hn::Zero(d),
                                     hn::MulAdd(det, hn::Set(d, 1 / kFadeTo), hn::Set(d, -1.0f)))));
    const VF half =
        hn::Div(hn::Mul(fade, hn::Set(d, 0.5f * kGradient)), hn::IfThenElse(seen, det, one));
    out.uAcross = hn::Mul(by.yv, half);
    out.uDown = hn::Neg(hn::Mul(by.xv, half));
    out.vAcross = hn::Neg(hn::Mul(by.yu, half));
    out.vDown = hn::Mul(by.xu, half);
}

// The ellipses of large splats: the lattice's Gaussian carried into the picture, and the low-pass
// filter added. `reach`: where they end, squared deviations.
HWY_INLINE void setEllipses(DF d, VF size, const Jacobian& by, VF det, float reach,
                            const Region& region, Splats& out) {
    const auto square = [](VF x, VF y) HWY_ATTR { return hn::MulAdd(x, x, hn::Mul(y, y)); };
    const VF k = hn::Mul(hn::Mul(size, size), hn::Set(d, kSigmaSource * kSigmaSource));
    const VF low = hn::Set(d, kSigmaPixel * kSigmaPixel);
    const VF vxx = hn::MulAdd(k, square(by.xu, by.xv), low);
    const VF vyy = hn::MulAdd(k, square(by.yu, by.yv), low);
    const VF vxy = hn::Mul(k, hn::MulAdd(by.xu, by.yu, hn::Mul(by.xv, by.yv)));
    VF determinant = hn::NegMulAdd(vxy, vxy, hn::Mul(vxx, vyy));
    // Without cancellation where splats may be so large that nothing would be left of it.
    if (region.orthographic) {
        const VF area = hn::Mul(k, det);
        determinant = hn::MulAdd(area, area, hn::Mul(low, hn::Sub(hn::Add(vxx, vyy), low)));
    }
    const VF scale = hn::Div(hn::Set(d, 1.0f), determinant);
    out.qxx = hn::Mul(vyy, scale);
    out.qyy = hn::Mul(vxx, scale);
    out.qxy = hn::Neg(hn::Mul(vxy, scale));
    const VF end = hn::Set(d, reach), largest = hn::Set(d, region.largest);
    out.halfX = hn::Min(hn::Sqrt(hn::Mul(end, vxx)), largest);
    out.halfY = hn::Min(hn::Sqrt(hn::Mul(end, vyy)), largest);
}

// kUniform: all points of the block are small and share its tilt. kColour: weights and the steps of
// colours are wanted.
template <bool kUniform, bool kColour>
HWY_INLINE Splats splatsOf(DF d, const RectangleImages& s, const BlockTask& t, const RowMap& map,
                           int row, int i, std::size_t pixel, int count, const Region& region) {
    Splats out;
    const VF depth = loadDepth(d, s.depth + pixel, count);
    out.at = project(d, map, i, depth, region);
    if (const unsigned halves = halvesOf(t, row); halves != 3) {
        const auto needed = lanesOf(d, halves, i);
        out.at.inside = hn::And(out.at.inside, needed);
        out.at.inFront = hn::And(out.at.inFront, needed);
    }
    const VF one = hn::Set(d, 1.0f);
    if (kUniform) {
        setUniform(d, t, out);
        return out;
    }
    if (!reachesRegion(d, out.at, t.reach, region)) {
        out.small = out.large = hn::Lt(one, one);
        return out;
    }
    VF su, sv, size;
    hn::Mask<DF> linked, rim;
    loadShape(d, s, pixel, count, su, sv, size, linked, rim);
    // Of what is not opaque the flag says that it is glass.
    if (kColour && t.glass)
        linked = hn::And(linked, hn::Ge(alphaOf(d, s, pixel, count), hn::Set(d, 255.0f)));
    const VF spacing = s.orthographic ? one : depth;
    const VF du = hn::Mul(su, hn::Mul(spacing, hn::Set(d, 1.0f / (kSlopeScale * s.fx))));
    const VF dv = hn::Mul(sv, hn::Mul(spacing, hn::Set(d, 1.0f / (kSlopeScale * s.fy))));
    // Derivatives of H and then of the pixel by u and v.
    const auto hu = [&](int k) HWY_ATTR {
        return hn::MulAdd(hn::Set(d, map.au[k]), depth,
                          hn::MulAdd(out.at.a[k], du, hn::Set(d, map.bu[k])));
    };
    const auto hv = [&](int k) HWY_ATTR {
        return hn::MulAdd(hn::Set(d, map.av[k]), depth,
                          hn::MulAdd(out.at.a[k], dv, hn::Set(d, map.bv[k])));
    };
    const VF zu = hu(2), zv = hv(2);
    VF xu = hu(0), yu = hu(1), xv = hv(0), yv = hv(1);
    if (!region.orthographic) {
        xu = hn::Mul(hn::NegMulAdd(out.at.x, zu, xu), out.at.inverse);
        yu = hn::Mul(hn::NegMulAdd(out.at.y, zu, yu), out.at.inverse);
        xv = hn::Mul(hn::NegMulAdd(out.at.x, zv, xv), out.at.inverse);
        yv = hn::Mul(hn::NegMulAdd(out.at.y, zv, yv), out.at.inverse);
    }
    const VF det = hn::Sub(hn::Mul(xu, yv), hn::Mul(xv, yu));
    const auto square = [](VF x, VF y) HWY_ATTR { return hn::MulAdd(x, x, hn::Mul(y, y)); };
    const VF cover2 = hn::Mul(hn::Mul(hn::Mul(size, size), hn::Set(d, 0.25f)),
                              hn::Max(square(hn::Add(xu, xv), hn::Add(yu, yv)),
                                      square(hn::Sub(xu, xv), hn::Sub(yu, yv))));
    // Those with a determinant that is not positive face away.
    const auto seen = hn::And(out.at.inFront, hn::Gt(det, hn::Zero(d)));
    const auto fits = hn::Lt(cover2, hn::Set(d, kSmallCover2));
    out.small = hn::And(hn::And(seen, fits), out.at.inside);
    out.large = hn::AndNot(fits, seen);
    // At the rim of an object the surface ends within half a sample; beside any edge colours are
    // mixed.
    out.core2 = hn::Mul(hn::Max(hn::Set(d, 0.5f), hn::Mul(cover2, hn::Set(d, 1.08f))),
                        hn::IfThenElse(rim, hn::Set(d, kRimCore2), one));
    const VF limit = hn::Set(d, kSteepestPlane);
    const VF perPixel = hn::Div(one, hn::Mul(det, out.at.z));
    const auto limited = [&](VF v) HWY_ATTR { return hn::Min(hn::Max(v, hn::Neg(limit)), limit); };
    out.slopeX = limited(hn::Mul(hn::Sub(hn::Mul(zu, yv), hn::Mul(zv, yu)), perPixel));
    out.slopeY = limited(hn::Mul(hn::Sub(hn::Mul(zv, xu), hn::Mul(zu, xv)), perPixel));
    if (kColour) {
        setColour(d, t, linked, seen, {xu, yu, xv, yv}, det, out);
    } else {
        out.quality = out.uAcross = out.vAcross = out.uDown = out.vDown = hn::Zero(d);
    }
    if (!hn::AllFalse(d, out.large)) {
        // The first pass draws only the core of a splat, which hides what is behind.
        setEllipses(d, size, {xu, yu, xv, yv}, det, kColour ? kDrawn2 : kCore2, region, out);
    }
    return out;
}

struct Ellipse {
    float x, y, z;
    float slopeX, slopeY;
    float qxx, qxy, qyy;
    float core2;
    float quality;
    int x0, x1, y0, y1;  // the part of its box that lies in the region, inclusive
};

// The parts of boxes that lie in the region.
struct Boxes {
    VI x0, x1, y0, y1;
    hn::Mask<DF> some;
};

HWY_INLINE Boxes boxesOf(DF d, VF x, VF y, VF halfX, VF halfY, const Region& region) {
    const DI di;
    const VF left = hn::Ceil(hn::Max(hn::Sub(x, halfX), hn::Set(d, float(region.left))));
    const VF right =
        hn::Floor(hn::Min(hn::Add(x, halfX), hn::Set(d, region.left + region.width - 1.0f)));
    const VF above = hn::Ceil(hn::Max(hn::Sub(y, halfY), hn::Set(d, float(region.top))));
    const VF below =
        hn::Floor(hn::Min(hn::Add(y, halfY), hn::Set(d, region.top + region.rows - 1.0f)));
    Boxes out;
    out.some = hn::And(hn::Le(left, right), hn::Le(above, below));
    // Coordinates outside of the picture may be beyond what an int holds.
    const auto whole = [&](VF v)
                           HWY_ATTR { return hn::ConvertTo(di, hn::IfThenElseZero(out.some, v)); };
    out.x0 = whole(left);
    out.x1 = whole(right);
    out.y0 = whole(above);
    out.y1 = whole(below);
    return out;
}

// Large splats are drawn in patches of so many pixels along a side, up to so many of these.
constexpr bool kPatches = HWY_TARGET != HWY_SCALAR;
constexpr int kPatch = 4, kMostPatches = 4;

// Calls draw(k) for each bit k, those four apart one after another: a load that meets parts of
// stores still under way waits for them, and patches of neighbours share output pixels.
template <class F>
HWY_INLINE void forBitsApart(std::uint32_t bits, const F& draw) {
    for (const std::uint32_t part :
         {bits & 0x1111u, bits & 0x2222u, bits & 0x4444u, bits & 0x8888u}) {
        for (std::uint32_t rest = part; rest; rest &= rest - 1) draw(__builtin_ctz(rest));
    }
}

// Up to 4x4 pixels of a large splat.
struct Patch {
    std::size_t at;    // element of the first one in the region
    float dx, dy;      // from the splat to that pixel
    float wide, high;  // columns and rows after the first
    float z, zx, zy;   // depth of the splat, and change of depth per pixel
    float qxx, twiceQxy, qyy;
    float core2;
    float quality;
};

HWY_INLINE Patch patchOf(const Ellipse& e, const Region& region) {
    return {region.element(e.x0, e.y0),
            static_cast<float>(e.x0) - e.x,
            static_cast<float>(e.y0) - e.y,
            static_cast<float>(e.x1 - e.x0),
            static_cast<float>(e.y1 - e.y0),
            e.z,
            e.slopeX * e.z,
            e.slopeY * e.z,
            e.qxx,
            2 * e.qxy,
            e.qyy,
            e.core2,
            e.quality};
}

// How the colour of a splat goes on: half the source pixels that go by per output pixel.
struct Steps {
    float uAcross, vAcross, uDown, vDown;
};

// The large splats among some neighbouring pixels, one by one: drawPatch(pixel, patch, steps) where
// one patch holds it, else drawEllipse(pixel, ellipse, steps). What patches need is found for all
// at once.
template <bool kColour, class P, class E>
HWY_INLINE void forLarge(DF d, const Splats& p, std::uint32_t bits, const Region& region,
                         const P& drawPatch, const E& drawEllipse) {
    enum Value { X, Y, Z, SlopeX, SlopeY, Qxx, Qxy, Qyy, Dx, Dy, Wide, High, Zx, Zy, Qxy2 };
    enum Colour { kShape = Qxy2 + 1, Quality = kShape, UAcross, VAcross, UDown, VDown, kValues };
    HWY_ALIGN float v[kValues][kBlock];
    HWY_ALIGN std::int32_t box[4][kBlock], element[kBlock];
    const Boxes boxes = boxesOf(d, p.at.x, p.at.y, p.halfX, p.halfY, region);
    bits &= bitsOf(d, boxes.some);
    if (!bits) return;
    const DI di;
    const VF wide = hn::ConvertTo(d, hn::Sub(boxes.x1, boxes.x0)),
             high = hn::ConvertTo(d, hn::Sub(boxes.y1, boxes.y0)), most = hn::Set(d, kPatch - 1.0f);
    const std::uint32_t one = bitsOf(d, hn::And(hn::Le(wide, most), hn::Le(high, most)));
    hn::Store(boxes.x0, di, box[0]);
    hn::Store(boxes.x1, di, box[1]);
    hn::Store(boxes.y0, di, box[2]);
    hn::Store(boxes.y1, di, box[3]);
    hn::Store(
        hn::Add(hn::Mul(hn::Sub(boxes.y0, hn::Set(di, region.top - 1)), hn::Set(di, region.stride)),
                hn::Sub(boxes.x0, hn::Set(di, region.left - 1))),
        di, element);
    const VF all[kValues] = {p.at.x,
                             p.at.y,
                             p.at.z,
                             p.slopeX,
                             p.slopeY,
                             p.qxx,
                             p.qxy,
                             p.qyy,
                             hn::Sub(hn::ConvertTo(d, boxes.x0), p.at.x),
                             hn::Sub(hn::ConvertTo(d, boxes.y0), p.at.y),
                             wide,
                             high,
                             hn::Mul(p.slopeX, p.at.z),
                             hn::Mul(p.slopeY, p.at.z),
                             hn::Add(p.qxy, p.qxy),
                             p.quality,
                             p.uAcross,
                             p.vAcross,
                             p.uDown,
                             p.vDown};
    for (int k = 0; k < (kColour ? kValues : kShape); ++k) hn::Store(all[k], d, v[k]);
    forBitsApart(bits, [&](int k) HWY_ATTR {
        const float quality = kColour ? v[Quality][k] : 1.0f;
        const Steps steps = kColour ? Steps{v[UAcross][k], v[VAcross][k], v[UDown][k], v[VDown][k]}
                                    : Steps{0, 0, 0, 0};
        if (kPatches && (one >> k & 1))
            drawPatch(k,
                      Patch{static_cast<std::size_t>(element[k]), v[Dx][k], v[Dy][k], v[Wide][k],
                            v[High][k], v[Z][k], v[Zx][k], v[Zy][k], v[Qxx][k], v[Qxy2][k],
                            v[Qyy][k], kCore2, quality},
                      steps);
        else
            drawEllipse(
                k,
                Ellipse{v[X][k], v[Y][k], v[Z][k], v[SlopeX][k], v[SlopeY][k], v[Qxx][k], v[Qxy][k],
                        v[Qyy][k], kCore2, quality, box[0][k], box[1][k], box[2][k], box[3][k]},
                steps);
    });
}

// Calls row(first x, last x, y) for the part of the ellipse's box that lies in the region.
template <class F>
HWY_INLINE void forRows(const Ellipse& e, const F& row) {
    for (int y = e.y0; y <= e.y1; ++y) row(e.x0, e.x1, y);
}

// Lanes of one row of an ellipse: squared deviations and depth of the plane there.
struct Across {
    VF q, z;
    hn::Mask<DF> in;
};

HWY_INLINE Across across(DF d, const Ellipse& e, int x, int x1, int y) {
    Across out;
    const VF dx = hn::Sub(hn::Add(hn::Iota(d, 0), hn::Set(d, float(x))), hn::Set(d, e.x));
    const float dy = y - e.y;
    out.q = hn::MulAdd(dx, hn::MulAdd(dx, hn::Set(d, e.qxx), hn::Set(d, 2 * e.qxy * dy)),
                       hn::Set(d, e.qyy * dy * dy));
    out.z = hn::MulAdd(dx, hn::Set(d, e.slopeX * e.z), hn::Set(d, e.z * (1 + e.slopeY * dy)));
    // A plane that runs through the viewpoint must not hide all.
    out.z = hn::Max(out.z, hn::Set(d, 0.5f * e.z));
    out.in = hn::Le(hn::Iota(d, 0), hn::Set(d, float(x1 - x)));
    return out;
}

}  // namespace stx::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
