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
    float a[3], au[3], b[3], bu[3];
    RowMap(const PixelMap& m, int u, int v) {
        const glm::dvec3 av = m.a0 + m.au * double(u) + m.av * double(v);
        const glm::dvec3 bv = m.b0 + m.bu * double(u) + m.bv * double(v);
        for (int k = 0; k < 3; ++k) {
            a[k] = static_cast<float>(av[k]);
            au[k] = static_cast<float>(m.au[k]);
            b[k] = static_cast<float>(bv[k]);
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

// Points of a row that land in the band: the pixel to the upper left of each, how far into the next
// it lies (0..1), its novel depth.
struct Landed {
    VI offset;
    VF fx, fy, z;
    hn::Mask<DF> in;
};

HWY_INLINE Landed land(DF d, const RowMap& m, int i, VF z, const Band& band) {
    const VF index = hn::Add(hn::Iota(d, 0), hn::Set(d, static_cast<float>(i)));
    const auto h = [&](int k) HWY_ATTR {
        const VF a = hn::MulAdd(index, hn::Set(d, m.au[k]), hn::Set(d, m.a[k]));
        const VF b = hn::MulAdd(index, hn::Set(d, m.bu[k]), hn::Set(d, m.b[k]));
        return hn::MulAdd(a, z, b);
    };
    VF x = h(0), y = h(1);
    const VF w = h(2);
    if (!band.orthographic) {
        const VF inverse = hn::Div(hn::Set(d, 1.0f), w);
        x = hn::Mul(x, inverse);
        y = hn::Mul(y, inverse);
    }
    Landed out;
    const VF x0 = hn::Floor(x), y0 = hn::Floor(y);
    // Comparisons with NaN are false, which takes care of pixels without a point.
    out.in = hn::And(
        hn::And(hn::And(hn::Ge(x0, hn::Set(d, -1.0f)), hn::Lt(x0, hn::Set(d, float(band.width)))),
                hn::And(hn::Ge(y0, hn::Set(d, float(band.top - 1))),
                        hn::Lt(y0, hn::Set(d, float(band.top + band.rows))))),
        hn::And(hn::Gt(w, hn::Set(d, kNearest)), hn::Lt(z, hn::Set(d, kInfinity))));
    const DI di;
    // Zero where outside, so that conversions and gathers stay in range.
    const VF xs = hn::IfThenElseZero(out.in, x0);
    const VF ys = hn::IfThenElse(out.in, y0, hn::Set(d, float(band.top)));
    const VI row = hn::Sub(hn::ConvertTo(di, ys), hn::Set(di, band.top - 1));
    out.offset = hn::Add(hn::Mul(row, hn::Set(di, band.stride)),
                         hn::Add(hn::ConvertTo(di, xs), hn::Set(di, 1)));
    out.fx = hn::Sub(x, x0);
    out.fy = hn::Sub(y, y0);
    out.z = w;
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
HWY_INLINE void addTo(float* sums, float weight, Four value) {
    for (int k = 0; k < 4; ++k) sums[k] += weight * value.v[k];
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
HWY_INLINE void addTo(float* sums, float weight, Four value) {
    const D4 d4;
    hn::StoreU(hn::MulAdd(hn::Set(d4, weight), value, hn::LoadU(d4, sums)), d4, sums);
}
#endif

// What a point adds for each unit of weight.
struct Paint {
    Four colour;  // R, G, B times alpha, alpha; all times 255
    Four normal;
    float missing;  // 255 - alpha
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
    return p;
}

// --- Splats of 2x2 output pixels -------------------------------------------------------------

void depthSmall(const Source& s, const BlockTask& t, const Band& band) {
    const DF d;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const VF one = hn::Set(d, 1.0f), infinity = hn::Set(d, kInfinity);
    const VF core2 = hn::Set(d, t.core2), slopeX = hn::Set(d, t.slopeX),
             slopeY = hn::Set(d, t.slopeY);
    HWY_ALIGN std::int32_t offset[kBlock];
    HWY_ALIGN float z00[kBlock], z10[kBlock], z01[kBlock], z11[kBlock];
    for (int v = t.v0; v < t.v1; ++v) {
        const RowMap map(s.map, t.u0, v);
        for (int i = 0; i < t.u1 - t.u0; i += lanes) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.width + t.u0 + i;
            const int count = t.u1 - t.u0 - i;
            Landed p = land(d, map, i, loadDepth(d, s.depth + pixel, count), band);
            if (!t.opaque) p.in = hn::And(p.in, alphaAbove(d, s, pixel, count, 127));
            std::uint32_t bits = bitsOf(d, p.in);
            if (!bits) continue;
            hn::Store(p.offset, di, offset);
            const VF gx = hn::Sub(one, p.fx), gy = hn::Sub(one, p.fy);
            const VF fx2 = hn::Mul(p.fx, p.fx), gx2 = hn::Mul(gx, gx);
            const VF fy2 = hn::Mul(p.fy, p.fy), gy2 = hn::Mul(gy, gy);
            // The plane of the splat at the four pixel centres.
            const VF zx = hn::Mul(p.z, slopeX), zy = hn::Mul(p.z, slopeY);
            const VF z = hn::NegMulAdd(p.fx, zx, hn::NegMulAdd(p.fy, zy, p.z));
            const auto keep = [&](VF x2, VF y2, VF depth, float* to) HWY_ATTR {
                hn::Store(hn::IfThenElse(hn::Le(hn::Add(x2, y2), core2), depth, infinity), d, to);
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

template <bool kOpaque, bool kNormals>
void colourSmall(const Source& s, const BlockTask& t, const Band& band) {
    const DF d;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const VF one = hn::Set(d, 1.0f);
    const VF tolerance = hn::Set(d, 1.0f + t.tolerance), quality = hn::Set(d, t.quality);
    const VF slopeX = hn::Set(d, t.slopeX), slopeY = hn::Set(d, t.slopeY);
    const VI stride = hn::Set(di, band.stride), nextPixel = hn::Set(di, 1);
    HWY_ALIGN std::int32_t offset[kBlock];
    HWY_ALIGN float w00[kBlock], w10[kBlock], w01[kBlock], w11[kBlock];
    for (int v = t.v0; v < t.v1; ++v) {
        const RowMap map(s.map, t.u0, v);
        for (int i = 0; i < t.u1 - t.u0; i += lanes) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.width + t.u0 + i;
            const int count = t.u1 - t.u0 - i;
            Landed p = land(d, map, i, loadDepth(d, s.depth + pixel, count), band);
            if (!kOpaque) p.in = hn::And(p.in, alphaAbove(d, s, pixel, count, 0));
            if (hn::AllFalse(d, p.in)) continue;
            const VF gx = hn::Sub(one, p.fx), gy = hn::Sub(one, p.fy);
            const VF zx = hn::Mul(p.z, slopeX), zy = hn::Mul(p.z, slopeY);
            const VF z = hn::NegMulAdd(p.fx, zx, hn::NegMulAdd(p.fy, zy, p.z));
            const auto weigh = [&](VF wx, VF wy, VF depth, VI at, float* to) HWY_ATTR {
                const VF front = hn::GatherIndex(d, band.depth, at);
                const auto near = hn::And(p.in, hn::Le(depth, hn::Mul(front, tolerance)));
                hn::Store(hn::IfThenElseZero(near, hn::Mul(wx, wy)), d, to);
                return near;
            };
            const VF x0 = hn::Mul(quality, lowPass(d, hn::Mul(p.fx, p.fx)));
            const VF x1 = hn::Mul(quality, lowPass(d, hn::Mul(gx, gx)));
            const VF y0 = lowPass(d, hn::Mul(p.fy, p.fy)), y1 = lowPass(d, hn::Mul(gy, gy));
            const VI below = hn::Add(p.offset, stride);
            const VF zRight = hn::Add(z, zx);
            const auto any =
                hn::Or(hn::Or(weigh(x0, y0, z, p.offset, w00),
                              weigh(x1, y0, zRight, hn::Add(p.offset, nextPixel), w10)),
                       hn::Or(weigh(x0, y1, hn::Add(z, zy), below, w01),
                              weigh(x1, y1, hn::Add(zRight, zy), hn::Add(below, nextPixel), w11)));
            std::uint32_t bits = bitsOf(d, any);
            hn::Store(p.offset, di, offset);
            while (bits) {
                const int k = __builtin_ctz(bits);
                bits &= bits - 1;
                const Paint paint = paintOf(s, pixel + k, kOpaque);
                const std::size_t at = static_cast<std::size_t>(offset[k]);
                const auto add = [&](std::size_t to, float weight) HWY_ATTR {
                    addTo(band.colour + 4 * to, weight, paint.colour);
                    if (!kOpaque) band.missing[to] += weight * paint.missing;
                    if (kNormals) addTo(band.normals + 4 * to, weight, paint.normal);
                };
                add(at, w00[k]);
                add(at + 1, w10[k]);
                add(at + band.stride, w01[k]);
                add(at + band.stride + 1, w11[k]);
            }
        }
    }
}

// --- Splats of any size ----------------------------------------------------------------------

// Half width of the Gaussian in sample spacings, and of the low-pass filter in pixels.
constexpr float kSigmaSource = 0.5f, kSigmaPixel = 0.3f;
// Where a splat ends, and where it stops to hide, in squared standard deviations. The lattice
// closes at half a diagonal: 0.5 / kSigmaSource^2 = 2.
constexpr float kReach2 = 5.0f, kCore2 = 2.1f;
// No splat is larger, in pixels from its centre: a point almost at the viewpoint would fill the
// frame.
constexpr float kLargest = 256.0f;

struct Ellipse {
    float x, y, z;         // pixels, novel depth
    float slopeX, slopeY;  // of novel depth, relative, per pixel
    float qxx, qxy, qyy;   // squared standard deviations = qxx dx^2 + 2 qxy dx dy + qyy dy^2
    float halfX, halfY;    // of the bounding box at kReach2
    float core2;
};

// False when the point cannot be seen.
inline bool ellipseOf(const Source& s, const Shape& shape, int u, int v, const Band& band,
                      Ellipse& e) {
    const std::size_t pixel = static_cast<std::size_t>(v) * s.width + u;
    const float z = s.depth[pixel];
    if (!(z < kInfinity)) return false;
    const PixelMap& m = s.map;
    const glm::dvec3 a = m.a0 + m.au * double(u) + m.av * double(v);
    const glm::dvec3 h = a * double(z) + m.b0 + m.bu * double(u) + m.bv * double(v);
    if (!(h.z > kNearest)) return false;
    const double inverse = band.orthographic ? 1.0 : 1.0 / h.z;
    e.x = static_cast<float>(h.x * inverse);
    e.y = static_cast<float>(h.y * inverse);
    e.z = static_cast<float>(h.z);
    const double spacing = s.orthographic ? 1.0 : z;
    const double slopeU = s.slopes[pixel].u / (double(kSlopeScale) * s.fx) * spacing;
    const double slopeV = s.slopes[pixel].v / (double(kSlopeScale) * s.fy) * spacing;
    const glm::dvec3 hu = m.au * double(z) + m.bu + a * slopeU;
    const glm::dvec3 hv = m.av * double(z) + m.bv + a * slopeV;
    const double back = band.orthographic ? 0.0 : 1.0;
    const double xu = (hu.x - back * e.x * hu.z) * inverse,
                 yu = (hu.y - back * e.y * hu.z) * inverse;
    const double xv = (hv.x - back * e.x * hv.z) * inverse,
                 yv = (hv.y - back * e.y * hv.z) * inverse;
    const double det = xu * yv - xv * yu;
    if (shape.coefficient > 0) {
        const float radius =
            std::max(0.5f, 0.5f * shape.coefficient * (band.orthographic ? 1.0f : 1.0f / e.z));
        e.qxx = e.qyy = kReach2 / (radius * radius);
        e.qxy = 0;
        e.halfX = e.halfY = std::min(radius, kLargest);
        e.core2 = kReach2;
        e.slopeX = e.slopeY = 0;
        return true;
    }
    if (!(det > 0)) return false;  // faces away
    const double size = s.sizes ? s.sizes[pixel] / 64.0 : 1.0;
    const double k = kSigmaSource * kSigmaSource * size * size, low = kSigmaPixel * kSigmaPixel;
    const double vxx = k * (xu * xu + xv * xv) + low, vyy = k * (yu * yu + yv * yv) + low;
    const double vxy = k * (xu * yu + xv * yv);
    const double scale = 1.0 / (vxx * vyy - vxy * vxy);
    e.qxx = static_cast<float>(vyy * scale);
    e.qyy = static_cast<float>(vxx * scale);
    e.qxy = static_cast<float>(-vxy * scale);
    e.halfX = std::min(static_cast<float>(std::sqrt(kReach2 * vxx)), kLargest);
    e.halfY = std::min(static_cast<float>(std::sqrt(kReach2 * vyy)), kLargest);
    e.core2 = kCore2;
    // The plane's depth per pixel; nearly edge-on it would run away.
    const auto limited = [](double v0) {
        return static_cast<float>(v0 < -0.05 ? -0.05 : v0 > 0.05 ? 0.05 : v0);
    };
    e.slopeX = limited((hu.z * yv - hv.z * yu) / (det * h.z));
    e.slopeY = limited((hv.z * xu - hu.z * xv) / (det * h.z));
    return true;
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
    Across(DF d, const Ellipse& e, int x, int x1, int y) {
        const VF dx = hn::Sub(hn::Add(hn::Iota(d, 0), hn::Set(d, float(x))), hn::Set(d, e.x));
        const float dy = y - e.y;
        q = hn::MulAdd(dx, hn::MulAdd(dx, hn::Set(d, e.qxx), hn::Set(d, 2 * e.qxy * dy)),
                       hn::Set(d, e.qyy * dy * dy));
        z = hn::MulAdd(dx, hn::Set(d, e.slopeX * e.z), hn::Set(d, e.z * (1 + e.slopeY * dy)));
        // A plane that runs through the viewpoint must not hide all.
        z = hn::Max(z, hn::Set(d, 0.5f * e.z));
        in = hn::Le(hn::Iota(d, 0), hn::Set(d, float(x1 - x)));
    }
};

void depthLarge(const Source& s, const BlockTask& t, const Shape& shape, const Band& band) {
    const DF d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    for (int v = t.v0; v < t.v1; ++v) {
        for (int u = t.u0; u < t.u1; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.width + u;
            if (!t.opaque &&
                !(s.rgba8 ? s.rgba8[4 * pixel + 3] > 127 : s.rgbaFloat[4 * pixel + 3] > 0.5f))
                continue;
            Ellipse e;
            if (!ellipseOf(s, shape, u, v, band, e)) continue;
            forRows(e, band, [&](int x0, int x1, int y) HWY_ATTR {
                float* row =
                    band.depth + static_cast<std::size_t>(y - band.top + 1) * band.stride + 1;
                for (int x = x0; x <= x1; x += lanes) {
                    const Across a(d, e, x, x1, y);
                    const auto core = hn::And(a.in, hn::Le(a.q, hn::Set(d, e.core2)));
                    const VF old = hn::LoadU(d, row + x);
                    hn::StoreU(hn::IfThenElse(core, hn::Min(old, a.z), old), d, row + x);
                }
            });
        }
    }
}

void colourLarge(const Source& s, const BlockTask& t, const Shape& shape, const Band& band) {
    const DF d;
    const int lanes = static_cast<int>(hn::Lanes(d));
    HWY_ALIGN float weights[kBlock];
    for (int v = t.v0; v < t.v1; ++v) {
        for (int u = t.u0; u < t.u1; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * s.width + u;
            if (!t.opaque &&
                !(s.rgba8 ? s.rgba8[4 * pixel + 3] > 0 : s.rgbaFloat[4 * pixel + 3] > 0))
                continue;
            Ellipse e;
            if (!ellipseOf(s, shape, u, v, band, e)) continue;
            const Paint paint = paintOf(s, pixel, t.opaque);
            forRows(e, band, [&](int x0, int x1, int y) HWY_ATTR {
                const std::size_t start =
                    static_cast<std::size_t>(y - band.top + 1) * band.stride + 1;
                for (int x = x0; x <= x1; x += lanes) {
                    const Across a(d, e, x, x1, y);
                    const VF front = hn::LoadU(d, band.depth + start + x);
                    const auto near =
                        hn::And(hn::And(a.in, hn::Lt(a.q, hn::Set(d, kReach2))),
                                hn::Le(a.z, hn::Mul(front, hn::Set(d, 1.0f + t.tolerance))));
                    std::uint32_t bits = bitsOf(d, near);
                    if (!bits) continue;
                    // Falls off like a Gaussian and reaches zero at kReach2.
                    const VF fall = hn::MulAdd(a.q, hn::Set(d, -1.0f / kReach2), hn::Set(d, 1.0f));
                    hn::Store(hn::Mul(hn::Mul(fall, fall), hn::Mul(fall, hn::Set(d, t.quality))), d,
                              weights);
                    while (bits) {
                        const int k = __builtin_ctz(bits);
                        bits &= bits - 1;
                        const std::size_t at = start + x + k;
                        addTo(band.colour + 4 * at, weights[k], paint.colour);
                        band.missing[at] += weights[k] * paint.missing;
                        if (s.normals) addTo(band.normals + 4 * at, weights[k], paint.normal);
                    }
                }
            });
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
            if (!t.opaque) p.in = hn::And(p.in, alphaAbove(d, s, pixel, count, 0));
            std::uint32_t bits = bitsOf(d, p.in);
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
    if (t.small && !(shape.coefficient > 0))
        depthSmall(s, t, band);
    else
        depthLarge(s, t, shape, band);
}

void colourImpl(const Source& s, const BlockTask& t, const Shape& shape, const Band& band) {
    if (!t.small || shape.coefficient > 0)
        colourLarge(s, t, shape, band);
    else if (t.opaque && !s.normals)
        colourSmall<true, false>(s, t, band);
    else if (t.opaque)
        colourSmall<true, true>(s, t, band);
    else if (!s.normals)
        colourSmall<false, false>(s, t, band);
    else
        colourSmall<false, true>(s, t, band);
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
