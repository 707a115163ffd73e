#include "lib/render/cpu/splat_kernels.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/cpu/splat_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace stx::splat::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, kBlock>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Nearer than this the projection means nothing.
constexpr float kNearest = 1e-12f;

// A row of a block: H = (a + i au) z + (b + i bu) for its i-th pixel.
struct RowMap {
    float a[3], au[3], av[3], b[3], bu[3], bv[3];
    RowMap(const PixelMap& m, int u, int v) {
        const glm::dvec3 rowA = m.a0 + m.au * double(u) + m.av * double(v);
        const glm::dvec3 rowB = m.b0 + m.bu * double(u) + m.bv * double(v);
        for (int k = 0; k < 3; ++k) {
            a[k] = static_cast<float>(rowA[k]);
            au[k] = static_cast<float>(m.au[k]);
            av[k] = static_cast<float>(m.av[k]);
            bv[k] = static_cast<float>(m.bv[k]);
            b[k] = static_cast<float>(rowB[k]);
            bu[k] = static_cast<float>(m.bu[k]);
        }
    }
};

// Depths of `count` pixels, infinity after them.
HWY_INLINE VF loadDepth(DF d, const float* from, int count) {
    if (count >= static_cast<int>(hn::Lanes(d))) return hn::LoadU(d, from);
    HWY_ALIGN float padded[kBlock];
    for (int i = 0; i < kBlock; ++i) padded[i] = i < count ? from[i] : kInfinity;
    return hn::Load(d, padded);
}

// Points of a row and where they land: the pixel to the upper left of each (only where `inside`
// the band), how far into the next it lies (0..1), its novel depth.
struct Landed {
    VI offset;
    VF x, y, fx, fy, z;
    VF a[3], inverse;  // H = a z + ..., and 1 / H.z (1 when orthographic)
    hn::Mask<DF> inFront, inside;
};

HWY_INLINE Landed land(DF d, const RowMap& m, int i, VF z, const Band& band) {
    const VF index = hn::Add(hn::Iota(d, 0), hn::Set(d, static_cast<float>(i)));
    Landed out;
    const auto h = [&](int k) HWY_ATTR {
        out.a[k] = hn::MulAdd(index, hn::Set(d, m.au[k]), hn::Set(d, m.a[k]));
        const VF b = hn::MulAdd(index, hn::Set(d, m.bu[k]), hn::Set(d, m.b[k]));
        return hn::MulAdd(out.a[k], z, b);
    };
    out.x = h(0);
    out.y = h(1);
    out.z = h(2);
    out.inverse = hn::Set(d, 1.0f);
    if (!band.orthographic) {
        out.inverse = hn::Div(out.inverse, out.z);
        out.x = hn::Mul(out.x, out.inverse);
        out.y = hn::Mul(out.y, out.inverse);
    }
    const VF x0 = hn::Floor(out.x), y0 = hn::Floor(out.y);
    // Comparisons with NaN are false, which takes care of pixels without a point.
    out.inFront = hn::And(hn::Gt(out.z, hn::Set(d, kNearest)), hn::Lt(z, hn::Set(d, kInfinity)));
    out.inside = hn::And(
        hn::And(hn::And(hn::Ge(x0, hn::Set(d, -1.0f)), hn::Lt(x0, hn::Set(d, float(band.width)))),
                hn::And(hn::Ge(y0, hn::Set(d, float(band.top - 1))),
                        hn::Lt(y0, hn::Set(d, float(band.top + band.rows))))),
        out.inFront);
    const DI di;
    // Zero where outside, so that conversions and gathers stay in range.
    const VF xs = hn::IfThenElseZero(out.inside, x0);
    const VF ys = hn::IfThenElse(out.inside, y0, hn::Set(d, float(band.top)));
    const VI row = hn::Sub(hn::ConvertTo(di, ys), hn::Set(di, band.top - 1));
    out.offset = hn::Add(hn::Mul(row, hn::Set(di, band.stride)),
                         hn::Add(hn::ConvertTo(di, xs), hn::Set(di, 1)));
    out.fx = hn::Sub(out.x, x0);
    out.fy = hn::Sub(out.y, y0);
    return out;
}

// Which of the lanes have alpha above a threshold of 0..255.
HWY_INLINE hn::Mask<DF> alphaAbove(DF d, const Source& s, std::size_t pixel, int count,
                                   int threshold) {
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
    return hn::Gt(hn::Load(d, alpha), hn::Set(d, static_cast<float>(threshold)));
}

HWY_INLINE std::uint32_t bitsOf(DF d, hn::Mask<DF> mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return bytes[0] | (bytes[1] << 8);
}

// Four values that go together. The scalar target has no vectors of four.
#if HWY_TARGET == HWY_SCALAR
struct Four {
    float v[4];
};
template <class T>
HWY_INLINE Four fourFrom(const T* p) {
    return {{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]),
             static_cast<float>(p[3])}};
}
HWY_INLINE Four times(Four a, Four b) {
    return {{a.v[0] * b.v[0], a.v[1] * b.v[1], a.v[2] * b.v[2], a.v[3] * b.v[3]}};
}
HWY_INLINE Four plus(Four a, Four b) {
    return {{a.v[0] + b.v[0], a.v[1] + b.v[1], a.v[2] + b.v[2], a.v[3] + b.v[3]}};
}
HWY_INLINE Four plus(Four a, float scale, Four b) {
    return {{a.v[0] + scale * b.v[0], a.v[1] + scale * b.v[1], a.v[2] + scale * b.v[2],
             a.v[3] + scale * b.v[3]}};
}
HWY_INLINE Four difference(Four a, Four b) {
    return plus(a, -1.0f, b);
}
HWY_INLINE Four times(float scale, Four a) {
    return {{scale * a.v[0], scale * a.v[1], scale * a.v[2], scale * a.v[3]}};
}
HWY_INLINE void store(Four a, float* to) {
    for (int k = 0; k < 4; ++k) to[k] = a.v[k];
}
#else
using D4 = hn::FixedTag<float, 4>;
using Four = hn::Vec<D4>;
HWY_INLINE Four fourFrom(const float* p) {
    return hn::LoadU(D4(), p);
}
template <class T>
HWY_INLINE Four fourFrom(const T* p) {
    const hn::Rebind<T, D4> narrow;
    const hn::Rebind<std::int32_t, D4> wide;
    return hn::ConvertTo(D4(), hn::PromoteTo(wide, hn::LoadU(narrow, p)));
}
HWY_INLINE Four times(Four a, Four b) {
    return hn::Mul(a, b);
}
HWY_INLINE Four times(float scale, Four a) {
    return hn::Mul(hn::Set(D4(), scale), a);
}
HWY_INLINE Four plus(Four a, Four b) {
    return hn::Add(a, b);
}
HWY_INLINE Four plus(Four a, float scale, Four b) {
    return hn::MulAdd(hn::Set(D4(), scale), b, a);
}
HWY_INLINE Four difference(Four a, Four b) {
    return hn::Sub(a, b);
}
HWY_INLINE void store(Four a, float* to) {
    hn::StoreU(a, D4(), to);
}
#endif

HWY_INLINE void addTo(float* sums, float weight, Four value) {
    store(plus(fourFrom(sums), weight, value), sums);
}

// What a point adds for each unit of weight.
struct Paint {
    Four colour;  // R, G, B times alpha, alpha; all times 255
    Four normal;
    float missing;      // 255 - alpha
    Four across, down;  // change of colour per output pixel
};

HWY_INLINE Paint paintOf(const Source& s, std::size_t pixel, bool opaque) {
    Paint p;
    p.missing = 0;
    if (s.rgba8) {
        p.colour = fourFrom(s.rgba8 + 4 * pixel);
        if (!opaque) {
            const float alpha = s.rgba8[4 * pixel + 3];
            const float scale[4] = {alpha * (1.0f / 255.0f), alpha * (1.0f / 255.0f),
                                    alpha * (1.0f / 255.0f), 1.0f};
            p.colour = times(p.colour, fourFrom(scale));
            p.missing = 255.0f - alpha;
        }
    } else {
        const float alpha = opaque ? 255.0f : 255.0f * s.rgbaFloat[4 * pixel + 3];
        const float scale[4] = {alpha, alpha, alpha, 255.0f};
        p.colour = times(fourFrom(s.rgbaFloat + 4 * pixel), fourFrom(scale));
        p.missing = 255.0f - alpha;
    }
    static constexpr float kNone[4] = {0, 0, 0, 0};
    p.normal = s.normals ? fourFrom(s.normals + 4 * pixel) : fourFrom(kNone);
    p.across = p.down = fourFrom(kNone);
    return p;
}

// How the colour of an opaque point changes over the picture, from its four neighbours, given the
// source pixels that go by per output pixel.
HWY_INLINE void addGradient(const Source& s, std::size_t pixel, float uAcross, float vAcross,
                            float uDown, float vDown, Paint& p) {
    const std::size_t row = static_cast<std::size_t>(s.width);
    Four u, v;
    if (s.rgba8) {
        const std::uint8_t* c = s.rgba8 + 4 * pixel;
        u = difference(fourFrom(c + 4), fourFrom(c - 4));
        v = difference(fourFrom(c + 4 * row), fourFrom(c - 4 * row));
    } else {
        const float* c = s.rgbaFloat + 4 * pixel;
        u = times(255.0f, difference(fourFrom(c + 4), fourFrom(c - 4)));
        v = times(255.0f, difference(fourFrom(c + 4 * row), fourFrom(c - 4 * row)));
    }
    p.across = plus(times(uAcross, u), vAcross, v);
    p.down = plus(times(uDown, u), vDown, v);
}

// --- Splats ----------------------------------------------------------------------------------

// Half width of the Gaussian in sample spacings, and of the low-pass filter in pixels.
constexpr float kSigmaSource = 0.5f, kSigmaPixel = 0.3f;
// Where a large splat ends, and where it stops to hide, in squared standard deviations. The lattice
// closes at half a diagonal: 0.5 / kSigmaSource^2 = 2.
constexpr float kReach2 = 5.0f, kCore2 = 2.1f;
// None is larger, in pixels from its centre: a point almost at the viewpoint would fill the frame.
constexpr float kLargest = 256.0f;
// Steeper planes (relative depth per pixel) are nearly edge-on and would run away.
constexpr float kSteepest = 0.05f;
// Where a surface ends: the share of the squared radius that hides; beside any edge: of the weight.
constexpr float kRimCore2 = 0.5f, kEdgeQuality = 0.05f;

// The splats of some neighbouring pixels.
struct Splats {
    Landed at;
    hn::Mask<DF> small, large;
    VF slopeX, slopeY;  // of novel depth, relative, per pixel
    VF core2;           // of small ones, squared pixels
    VF quality;
    VF qxx, qxy, qyy;  // of large ones: squared deviations = qxx dx^2 + 2 qxy dx dy + qyy dy^2
    VF halfX, halfY;   // of their bounding boxes
    // Half the source pixels that go by per output pixel; zero where colour must not be continued.
    VF uAcross, vAcross, uDown, vDown;
};

// Slopes, sizes and links of up to a vector of pixels.
HWY_INLINE void loadShape(DF d, const Source& s, std::size_t pixel, int count, VF& u, VF& v,
                          VF& size, hn::Mask<DF>& linked, hn::Mask<DF>& rim) {
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    static_assert(sizeof(Slope) == 4 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
    VI packed;
    if (count >= lanes) {
        packed = hn::LoadU(di, reinterpret_cast<const std::int32_t*>(s.slopes + pixel));
    } else {
        HWY_ALIGN std::int32_t padded[kBlock] = {};
        std::memcpy(padded, s.slopes + pixel, static_cast<std::size_t>(count) * sizeof(Slope));
        packed = hn::Load(di, padded);
    }
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

// kUniform: all points of the block are small and share its tilt.
template <bool kUniform>
HWY_INLINE Splats splatsOf(DF d, const Source& s, const BlockTask& t, const RowMap& map, int i,
                           std::size_t pixel, int count, const Band& band) {
    Splats out;
    const VF depth = loadDepth(d, s.depth + pixel, count);
    out.at = land(d, map, i, depth, band);
    const VF one = hn::Set(d, 1.0f);
    if (kUniform) {
        out.small = out.at.inside;
        out.large = hn::Lt(one, one);
        out.slopeX = hn::Set(d, t.slopeX);
        out.slopeY = hn::Set(d, t.slopeY);
        out.core2 = hn::Set(d, t.core2);
        out.quality = hn::Set(d, t.quality * t.density);
        out.uAcross = hn::Set(d, t.uAcross);
        out.vAcross = hn::Set(d, t.vAcross);
        out.uDown = hn::Set(d, t.uDown);
        out.vDown = hn::Set(d, t.vDown);
        return out;
    }
    VF su, sv, size;
    hn::Mask<DF> linked, rim;
    loadShape(d, s, pixel, count, su, sv, size, linked, rim);
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
    if (!band.orthographic) {
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
    // At its rim the surface ends within half a sample; beside any edge colours are mixed.
    out.core2 = hn::Mul(hn::Max(hn::Set(d, 0.5f), hn::Mul(cover2, hn::Set(d, 1.08f))),
                        hn::IfThenElse(rim, hn::Set(d, kRimCore2), one));
    const VF limit = hn::Set(d, kSteepest);
    const VF perPixel = hn::Div(one, hn::Mul(det, out.at.z));
    const auto limited = [&](VF v) HWY_ATTR { return hn::Min(hn::Max(v, hn::Neg(limit)), limit); };
    out.slopeX = limited(hn::Mul(hn::Sub(hn::Mul(zu, yv), hn::Mul(zv, yu)), perPixel));
    out.slopeY = limited(hn::Mul(hn::Sub(hn::Mul(zv, xu), hn::Mul(zu, xv)), perPixel));
    const VF density = hn::Div(one, hn::Max(one, hn::Max(square(xu, yu), square(xv, yv))));
    out.quality = hn::Mul(
        hn::Mul(hn::Set(d, t.quality), hn::IfThenElse(linked, one, hn::Set(d, kEdgeQuality))),
        hn::Max(hn::Mul(density, density), hn::Set(d, kLeastDensity)));
    const VF fade = hn::IfThenElseZero(
        linked, hn::Min(one, hn::Max(hn::Zero(d),
                                     hn::MulAdd(det, hn::Set(d, 1 / kFadeTo), hn::Set(d, -1.0f)))));
    const VF half =
        hn::Div(hn::Mul(fade, hn::Set(d, 0.5f * kGradient)), hn::IfThenElse(seen, det, one));
    out.uAcross = hn::Mul(yv, half);
    out.uDown = hn::Neg(hn::Mul(xv, half));
    out.vAcross = hn::Neg(hn::Mul(yu, half));
    out.vDown = hn::Mul(xu, half);
    if (!hn::AllFalse(d, out.large)) {
        // The lattice's Gaussian carried into the picture, and the low-pass filter added.
        const VF k = hn::Mul(hn::Mul(size, size), hn::Set(d, kSigmaSource * kSigmaSource));
        const VF low = hn::Set(d, kSigmaPixel * kSigmaPixel);
        const VF vxx = hn::MulAdd(k, square(xu, xv), low), vyy = hn::MulAdd(k, square(yu, yv), low);
        const VF vxy = hn::Mul(k, hn::MulAdd(xu, yu, hn::Mul(xv, yv)));
        const VF scale = hn::Div(one, hn::NegMulAdd(vxy, vxy, hn::Mul(vxx, vyy)));
        out.qxx = hn::Mul(vyy, scale);
        out.qyy = hn::Mul(vxx, scale);
        out.qxy = hn::Neg(hn::Mul(vxy, scale));
        const VF reach = hn::Set(d, kReach2), largest = hn::Set(d, kLargest);
        out.halfX = hn::Min(hn::Sqrt(hn::Mul(reach, vxx)), largest);
        out.halfY = hn::Min(hn::Sqrt(hn::Mul(reach, vyy)), largest);
    }
    return out;
}

struct Ellipse {
    float x, y, z;
    float slopeX, slopeY;
    float qxx, qxy, qyy;
    float halfX, halfY;
    float core2;
    float quality;
    float uAcross, vAcross, uDown, vDown;
};

// The large splats among some neighbouring pixels, one by one: draw(pixel, ellipse).
template <class F>
HWY_INLINE void forLarge(DF d, const Splats& p, std::uint32_t bits, const F& draw) {
    constexpr int kValues = 15;
    HWY_ALIGN float v[kValues][kBlock];
    const VF all[kValues] = {p.at.x,    p.at.y,    p.at.z,    p.slopeX, p.slopeY,
                             p.qxx,     p.qxy,     p.qyy,     p.halfX,  p.halfY,
                             p.quality, p.uAcross, p.vAcross, p.uDown,  p.vDown};
    for (int k = 0; k < kValues; ++k) hn::Store(all[k], d, v[k]);
    while (bits) {
        const int k = __builtin_ctz(bits);
        bits &= bits - 1;
        draw(k,
             Ellipse{v[0][k], v[1][k], v[2][k], v[3][k], v[4][k], v[5][k], v[6][k], v[7][k],
                     v[8][k], v[9][k], kCore2, v[10][k], v[11][k], v[12][k], v[13][k], v[14][k]});
    }
}

// Calls row(first x, last x, y) for the part of the ellipse's box that lies in the band.
template <class F>
HWY_INLINE void forRows(const Ellipse& e, const Band& band, const F& row) {
    // Off-screen coordinates may be beyond what an int holds.
    if (!(e.x + e.halfX >= 0 && e.x - e.halfX <= band.width - 1 && e.y + e.halfY >= band.top &&
          e.y - e.halfY <= band.top + band.rows - 1))
        return;
    const int x0 = static_cast<int>(std::ceil(std::max(e.x - e.halfX, 0.0f)));
    const int x1 = static_cast<int>(std::floor(std::min(e.x + e.halfX, band.width - 1.0f)));
    const int y0 = static_cast<int>(std::ceil(std::max(e.y - e.halfY, float(band.top))));
    const int y1 =
        static_cast<int>(std::floor(std::min(e.y + e.halfY, band.top + band.rows - 1.0f)));
    if (x0 > x1) return;
    for (int y = y0; y <= y1; ++y) row(x0, x1, y);
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

HWY_INLINE void depthEllipse(DF d, const Ellipse& e, const Band& band) {
    const int lanes = static_cast<int>(hn::Lanes(d));
    forRows(e, band, [&](int x0, int x1, int y) HWY_ATTR {
        float* row = band.depth + static_cast<std::size_t>(y - band.top + 1) * band.stride + 1;
        for (int x = x0; x <= x1; x += lanes) {
            const Across a = across(d, e, x, x1, y);
            const auto core = hn::And(a.in, hn::Le(a.q, hn::Set(d, e.core2)));
            const VF old = hn::LoadU(d, row + x);
            hn::StoreU(hn::IfThenElse(core, hn::Min(old, a.z), old), d, row + x);
        }
    });
}

HWY_INLINE void colourEllipse(DF d, const Ellipse& e, const Paint& paint, float tolerance,
                              bool normals, const Band& band) {
    const int lanes = static_cast<int>(hn::Lanes(d));
    HWY_ALIGN float weights[kBlock];
    forRows(e, band, [&](int x0, int x1, int y) HWY_ATTR {
        const std::size_t start = static_cast<std::size_t>(y - band.top + 1) * band.stride + 1;
        for (int x = x0; x <= x1; x += lanes) {
            const Across a = across(d, e, x, x1, y);
            const VF front = hn::LoadU(d, band.depth + start + x);
            const auto near = hn::And(hn::And(a.in, hn::Lt(a.q, hn::Set(d, kReach2))),
                                      hn::Le(a.z, hn::Mul(front, hn::Set(d, 1.0f + tolerance))));
            std::uint32_t bits = bitsOf(d, near);
            if (!bits) continue;
            // Falls off like a Gaussian and reaches zero at kReach2.
            const VF fall = hn::MulAdd(a.q, hn::Set(d, -1.0f / kReach2), hn::Set(d, 1.0f));
            hn::Store(hn::Mul(hn::Mul(fall, fall), hn::Mul(fall, hn::Set(d, e.quality))), d,
                      weights);
            while (bits) {
                const int k = __builtin_ctz(bits);
                bits &= bits - 1;
                const std::size_t at = start + x + k;
                const Four colour =
                    plus(plus(paint.colour, x + k - e.x, paint.across), y - e.y, paint.down);
                addTo(band.colour + 4 * at, weights[k], colour);
                band.missing[at] += weights[k] * paint.missing;
                if (normals) addTo(band.normals + 4 * at, weights[k], paint.normal);
            }
        }
    });
}

template <bool kUniform>
void depthBlock(const Source& s, const BlockTask& t, const Band& band) {
    const DF d;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const VF one = hn::Set(d, 1.0f), infinity = hn::Set(d, kInfinity);
    HWY_ALIGN std::int32_t offset[kBlock];
    HWY_ALIGN float z00[kBlock], z10[kBlock], z01[kBlock], z11[kBlock];
    for (int v = t.v0; v < t.v1; ++v) {
        const RowMap map(s.map, t.u0, v);
        for (int i = 0; i < t.u1 - t.u0; i += lanes) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.width + t.u0 + i;
            const int count = t.u1 - t.u0 - i;
            Splats p = splatsOf<kUniform>(d, s, t, map, i, pixel, count, band);
            if (!t.opaque) {
                const auto solid = alphaAbove(d, s, pixel, count, 127);
                p.small = hn::And(p.small, solid);
                p.large = hn::And(p.large, solid);
            }
            if (!kUniform) {
                if (const std::uint32_t large = bitsOf(d, p.large))
                    forLarge(d, p, large,
                             [&](int, const Ellipse& e) HWY_ATTR { depthEllipse(d, e, band); });
            }
            std::uint32_t bits = bitsOf(d, p.small);
            if (!bits) continue;
            hn::Store(p.at.offset, di, offset);
            const VF fx = p.at.fx, fy = p.at.fy;
            const VF gx = hn::Sub(one, fx), gy = hn::Sub(one, fy);
            const VF fx2 = hn::Mul(fx, fx), gx2 = hn::Mul(gx, gx);
            const VF fy2 = hn::Mul(fy, fy), gy2 = hn::Mul(gy, gy);
            // The plane of the splat at the four pixel centres.
            const VF zx = hn::Mul(p.at.z, p.slopeX), zy = hn::Mul(p.at.z, p.slopeY);
            const VF z = hn::NegMulAdd(fx, zx, hn::NegMulAdd(fy, zy, p.at.z));
            const auto keep = [&](VF x2, VF y2, VF depth, float* to) HWY_ATTR {
                hn::Store(hn::IfThenElse(hn::Le(hn::Add(x2, y2), p.core2), depth, infinity), d, to);
            };
            keep(fx2, fy2, z, z00);
            keep(gx2, fy2, hn::Add(z, zx), z10);
            keep(fx2, gy2, hn::Add(z, zy), z01);
            keep(gx2, gy2, hn::Add(hn::Add(z, zx), zy), z11);
            while (bits) {
                const int k = __builtin_ctz(bits);
                bits &= bits - 1;
                float* to = band.depth + offset[k];
                to[0] = z00[k] < to[0] ? z00[k] : to[0];
                to[1] = z10[k] < to[1] ? z10[k] : to[1];
                to += band.stride;
                to[0] = z01[k] < to[0] ? z01[k] : to[0];
                to[1] = z11[k] < to[1] ? z11[k] : to[1];
            }
        }
    }
}

// The low-pass filter over an output pixel: close to a Gaussian of sigma 0.35, zero from 1 on.
HWY_INLINE VF lowPass(DF d, VF x2) {
    const VF a = hn::Sub(hn::Set(d, 1.0f), x2);
    const VF b = hn::Mul(a, a);
    return hn::Mul(b, b);
}

template <bool kUniform, bool kOpaque, bool kNormals>
void colourBlock(const Source& s, const BlockTask& t, const Band& band) {
    const DF d;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const VF one = hn::Set(d, 1.0f);
    const VF tolerance = hn::Set(d, 1.0f + t.tolerance);
    const VI stride = hn::Set(di, band.stride), nextPixel = hn::Set(di, 1);
    HWY_ALIGN std::int32_t offset[kBlock];
    HWY_ALIGN float w00[kBlock], w10[kBlock], w01[kBlock], w11[kBlock];
    HWY_ALIGN float fractionX[kBlock], fractionY[kBlock];
    HWY_ALIGN float uAcross[kBlock], vAcross[kBlock], uDown[kBlock], vDown[kBlock];
    if (kUniform) {
        // The same for all pixels.
        for (int i = 0; i < kBlock; ++i) {
            uAcross[i] = t.uAcross;
            vAcross[i] = t.vAcross;
            uDown[i] = t.uDown;
            vDown[i] = t.vDown;
        }
    }
    for (int v = t.v0; v < t.v1; ++v) {
        const RowMap map(s.map, t.u0, v);
        for (int i = 0; i < t.u1 - t.u0; i += lanes) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.width + t.u0 + i;
            const int count = t.u1 - t.u0 - i;
            Splats p = splatsOf<kUniform>(d, s, t, map, i, pixel, count, band);
            if (!kOpaque) {
                const auto any = alphaAbove(d, s, pixel, count, 0);
                p.small = hn::And(p.small, any);
                p.large = hn::And(p.large, any);
            }
            if (!kUniform) {
                if (const std::uint32_t large = bitsOf(d, p.large))
                    forLarge(d, p, large, [&](int k, const Ellipse& e) HWY_ATTR {
                        Paint paint = paintOf(s, pixel + k, kOpaque);
                        if (e.uAcross != 0 || e.vDown != 0)
                            addGradient(s, pixel + k, e.uAcross, e.vAcross, e.uDown, e.vDown,
                                        paint);
                        colourEllipse(d, e, paint, t.tolerance, kNormals, band);
                    });
            }
            if (hn::AllFalse(d, p.small)) continue;
            const VF fx = p.at.fx, fy = p.at.fy;
            const VF gx = hn::Sub(one, fx), gy = hn::Sub(one, fy);
            const VF zx = hn::Mul(p.at.z, p.slopeX), zy = hn::Mul(p.at.z, p.slopeY);
            const VF z = hn::NegMulAdd(fx, zx, hn::NegMulAdd(fy, zy, p.at.z));
            const auto weigh = [&](VF wx, VF wy, VF depth, VI at, float* to) HWY_ATTR {
                const VF front = hn::GatherIndex(d, band.depth, at);
                const auto near = hn::And(p.small, hn::Le(depth, hn::Mul(front, tolerance)));
                hn::Store(hn::IfThenElseZero(near, hn::Mul(wx, wy)), d, to);
                return near;
            };
            const VF x0 = hn::Mul(p.quality, lowPass(d, hn::Mul(fx, fx)));
            const VF x1 = hn::Mul(p.quality, lowPass(d, hn::Mul(gx, gx)));
            const VF y0 = lowPass(d, hn::Mul(fy, fy)), y1 = lowPass(d, hn::Mul(gy, gy));
            const VI below = hn::Add(p.at.offset, stride);
            const VF zRight = hn::Add(z, zx);
            const auto any =
                hn::Or(hn::Or(weigh(x0, y0, z, p.at.offset, w00),
                              weigh(x1, y0, zRight, hn::Add(p.at.offset, nextPixel), w10)),
                       hn::Or(weigh(x0, y1, hn::Add(z, zy), below, w01),
                              weigh(x1, y1, hn::Add(zRight, zy), hn::Add(below, nextPixel), w11)));
            std::uint32_t bits = bitsOf(d, any);
            hn::Store(p.at.offset, di, offset);
            hn::Store(fx, d, fractionX);
            hn::Store(fy, d, fractionY);
            if (!kUniform) {
                hn::Store(p.uAcross, d, uAcross);
                hn::Store(p.vAcross, d, vAcross);
                hn::Store(p.uDown, d, uDown);
                hn::Store(p.vDown, d, vDown);
            }
            while (bits) {
                const int k = __builtin_ctz(bits);
                bits &= bits - 1;
                Paint paint = paintOf(s, pixel + k, kOpaque);
                const std::size_t at = static_cast<std::size_t>(offset[k]);
                const auto add = [&](std::size_t to, float weight, Four colour) HWY_ATTR {
                    addTo(band.colour + 4 * to, weight, colour);
                    if (!kOpaque) band.missing[to] += weight * paint.missing;
                    if (kNormals) addTo(band.normals + 4 * to, weight, paint.normal);
                };
                if (uAcross[k] == 0 && vDown[k] == 0) {
                    add(at, w00[k], paint.colour);
                    add(at + 1, w10[k], paint.colour);
                    add(at + band.stride, w01[k], paint.colour);
                    add(at + band.stride + 1, w11[k], paint.colour);
                    continue;
                }
                addGradient(s, pixel + k, uAcross[k], vAcross[k], uDown[k], vDown[k], paint);
                const Four c00 = plus(plus(paint.colour, -fractionX[k], paint.across),
                                      -fractionY[k], paint.down);
                const Four c01 = plus(c00, paint.down);
                add(at, w00[k], c00);
                add(at + 1, w10[k], plus(c00, paint.across));
                add(at + band.stride, w01[k], c01);
                add(at + band.stride + 1, w11[k], plus(c01, paint.across));
            }
        }
    }
}

// --- SplatRule::paper ------------------------------------------------------------------------

// Calls draw(pixel, splat) for each point of a block as a round splat.
template <class F>
HWY_INLINE void forRound(const Source& s, const BlockTask& t, const Shape& shape, const Band& band,
                         int alphaThreshold, const F& draw) {
    for (int v = t.v0; v < t.v1; ++v) {
        const RowMap map(s.map, t.u0, v);
        for (int u = t.u0; u < t.u1; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.width + u;
            const float alpha =
                s.rgba8 ? s.rgba8[4 * pixel + 3] : s.rgbaFloat[4 * pixel + 3] * 255.0f;
            if (!(s.depth[pixel] < kInfinity) || !(alpha > alphaThreshold)) continue;
            float h[3];
            for (int k = 0; k < 3; ++k) {
                const float i = static_cast<float>(u - t.u0);
                h[k] = (map.a[k] + i * map.au[k]) * s.depth[pixel] + (map.b[k] + i * map.bu[k]);
            }
            if (!(h[2] > kNearest)) continue;
            const float inverse = band.orthographic ? 1.0f : 1.0f / h[2];
            const float radius =
                std::min(std::max(0.5f, 0.5f * shape.coefficient * inverse), kLargest);
            const float q = kReach2 / (radius * radius);
            draw(pixel, Ellipse{h[0] * inverse, h[1] * inverse, h[2], 0, 0, q, 0, q, radius, radius,
                                kReach2, 1.0f, 0, 0, 0, 0});
        }
    }
}

// --- Points of one pixel ---------------------------------------------------------------------

void pointsImpl(const Source& s, const BlockTask& t, const Band& band) {
    const DF d;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    HWY_ALIGN std::int32_t offset[kBlock];
    HWY_ALIGN std::uint32_t depth[kBlock];
    const VF half = hn::Set(d, 0.5f);
    const VI one = hn::Set(di, 1), stride = hn::Set(di, band.stride);
    for (int v = t.v0; v < t.v1; ++v) {
        const RowMap map(s.map, t.u0, v);
        for (int i = 0; i < t.u1 - t.u0; i += lanes) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.width + t.u0 + i;
            const int count = t.u1 - t.u0 - i;
            Landed p = land(d, map, i, loadDepth(d, s.depth + pixel, count), band);
            if (!t.opaque) p.inside = hn::And(p.inside, alphaAbove(d, s, pixel, count, 0));
            std::uint32_t bits = bitsOf(d, p.inside);
            if (!bits) continue;
            // The nearest of the four pixels.
            VI at = p.offset;
            at = hn::Add(at, hn::IfThenElseZero(hn::RebindMask(di, hn::Ge(p.fx, half)), one));
            at = hn::Add(at, hn::IfThenElseZero(hn::RebindMask(di, hn::Ge(p.fy, half)), stride));
            hn::Store(at, di, offset);
            // Positive floats sort as their bits do.
            hn::Store(hn::BitCast(hn::RebindToUnsigned<DF>(), p.z), hn::RebindToUnsigned<DF>(),
                      depth);
            const std::uint32_t first = s.firstPoint + static_cast<std::uint32_t>(pixel);
            while (bits) {
                const int k = __builtin_ctz(bits);
                bits &= bits - 1;
                const std::uint64_t key = (std::uint64_t{depth[k]} << 32) | (first + k);
                std::uint64_t& to = band.points[offset[k]];
                to = key < to ? key : to;
            }
        }
    }
}

void depthImpl(const Source& s, const BlockTask& t, const Shape& shape, const Band& band) {
    const DF d;
    if (shape.coefficient > 0) {
        forRound(s, t, shape, band, 127,
                 [&](std::size_t, const Ellipse& e) HWY_ATTR { depthEllipse(d, e, band); });
    } else if (t.uniform) {
        depthBlock<true>(s, t, band);
    } else {
        depthBlock<false>(s, t, band);
    }
}

template <bool kUniform>
void colourOfBlock(const Source& s, const BlockTask& t, const Band& band) {
    if (t.opaque && !s.normals)
        colourBlock<kUniform, true, false>(s, t, band);
    else if (t.opaque)
        colourBlock<kUniform, true, true>(s, t, band);
    else if (!s.normals)
        colourBlock<kUniform, false, false>(s, t, band);
    else
        colourBlock<kUniform, false, true>(s, t, band);
}

void colourImpl(const Source& s, const BlockTask& t, const Shape& shape, const Band& band) {
    const DF d;
    if (shape.coefficient > 0) {
        forRound(s, t, shape, band, 0, [&](std::size_t pixel, const Ellipse& e) HWY_ATTR {
            colourEllipse(d, e, paintOf(s, pixel, t.opaque), t.tolerance, s.normals, band);
        });
    } else if (t.uniform) {
        colourOfBlock<true>(s, t, band);
    } else {
        colourOfBlock<false>(s, t, band);
    }
}

const char* targetImpl() {
    return hwy::TargetName(HWY_TARGET);
}

}  // namespace stx::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::splat {

HWY_EXPORT(depthImpl);
HWY_EXPORT(colourImpl);
HWY_EXPORT(pointsImpl);
HWY_EXPORT(targetImpl);

void drawDepth(const Source& source, const BlockTask& task, const Shape& shape, const Band& band) {
    HWY_DYNAMIC_DISPATCH(depthImpl)(source, task, shape, band);
}
void drawColour(const Source& source, const BlockTask& task, const Shape& shape, const Band& band) {
    HWY_DYNAMIC_DISPATCH(colourImpl)(source, task, shape, band);
}
void drawPoints(const Source& source, const BlockTask& task, const Band& band) {
    HWY_DYNAMIC_DISPATCH(pointsImpl)(source, task, band);
}
const char* simdTarget() {
    return HWY_DYNAMIC_DISPATCH(targetImpl)();
}

}  // namespace stx::splat
#endif
