// What points add to the picture: four values at a time. Included by kernels.cpp once for
// each SIMD target.

#if defined(STX_SPLAT_POINT_COLOUR_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_SPLAT_POINT_COLOUR_INL_HPP
#undef STX_SPLAT_POINT_COLOUR_INL_HPP
#else
#define STX_SPLAT_POINT_COLOUR_INL_HPP
#endif

#include <algorithm>

#include <hwy/highway.h>

#include "lib/render/splat/cpu/accumulate-inl.hpp"
#include "lib/render/splat/cpu/kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::splat::HWY_NAMESPACE {

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
template <class T>
HWY_INLINE Four difference(const T* a, const T* b) {
    return plus(fourFrom(a), -1.0f, fourFrom(b));
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
HWY_INLINE Four difference(const float* a, const float* b) {
    return hn::Sub(fourFrom(a), fourFrom(b));
}
// Of whole numbers: subtracted before they become floats, which is one conversion less.
template <class T>
HWY_INLINE Four difference(const T* a, const T* b) {
    const hn::Rebind<T, D4> narrow;
    const hn::Rebind<std::int32_t, D4> wide;
    return hn::ConvertTo(D4(), hn::Sub(hn::PromoteTo(wide, hn::LoadU(narrow, a)),
                                       hn::PromoteTo(wide, hn::LoadU(narrow, b))));
}
HWY_INLINE void store(Four a, float* to) {
    hn::StoreU(a, D4(), to);
}
#endif

HWY_INLINE void addTo(float* sums, float weight, Four value) {
    store(plus(fourFrom(sums), weight, value), sums);
}

// Two pixels side by side, each with a weight of its own.
HWY_INLINE void addToPair(float* sums, float weight0, Four value0, float weight1, Four value1) {
#if HWY_TARGET != HWY_SCALAR && HWY_MAX_BYTES >= 32
    const D4 d4;
    const hn::FixedTag<float, 8> d8;
    const auto weights = hn::Combine(d8, hn::Set(d4, weight1), hn::Set(d4, weight0));
    const auto values = hn::Combine(d8, value1, value0);
    hn::StoreU(hn::MulAdd(weights, values, hn::LoadU(d8, sums)), d8, sums);
#else
    addTo(sums, weight0, value0);
    addTo(sums + 4, weight1, value1);
#endif
}

// a[0], b[0], a[1], b[1], ...
HWY_INLINE void storePairs(DF d, VF a, VF b, float* to) {
#if HWY_TARGET == HWY_SCALAR
    hn::Store(a, d, to);
    hn::Store(b, d, to + 1);
#else
    hn::StoreInterleaved2(a, b, d, to);
#endif
}

// The smaller of two numbers and what is there, each.
HWY_INLINE void leastOfPair(float* to, const float* pair) {
#if HWY_TARGET == HWY_SCALAR
    to[0] = std::min(to[0], pair[0]);
    to[1] = std::min(to[1], pair[1]);
#else
    const hn::FixedTag<float, 2> d;
    hn::StoreU(hn::Min(hn::LoadU(d, pair), hn::LoadU(d, to)), d, to);
#endif
}

// Calls draw(k) for each bit k, the even ones first: neighbouring points share output pixels, and
// a load that meets parts of two stores still under way would wait for both.
template <class F>
HWY_INLINE void forBits(std::uint32_t bits, const F& draw) {
    for (std::uint32_t part : {bits & 0x5555u, bits & 0xaaaau}) {
        while (part) {
            draw(__builtin_ctz(part));
            part &= part - 1;
        }
    }
}

// What a point adds for each unit of weight.
struct PointColour {
    Four colour;  // R, G, B times alpha, alpha; all times 255
    Four normal;
    float missing;      // 255 - alpha
    Four across, down;  // change of colour per output pixel
};

HWY_INLINE PointColour pointColourOf(const RectangleImages& s, std::size_t pixel, bool opaque) {
    PointColour p;
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
HWY_INLINE void addGradient(const RectangleImages& s, std::size_t pixel, float uAcross,
                            float vAcross, float uDown, float vDown, PointColour& p) {
    const std::size_t row = static_cast<std::size_t>(s.stride);
    Four u, v;
    if (s.rgba8) {
        const std::uint8_t* c = s.rgba8 + 4 * pixel;
        u = difference(c + 4, c - 4);
        v = difference(c + 4 * row, c - 4 * row);
    } else {
        const float* c = s.rgbaFloat + 4 * pixel;
        u = times(255.0f, difference(c + 4, c - 4));
        v = times(255.0f, difference(c + 4 * row, c - 4 * row));
    }
    p.across = plus(times(uAcross, u), vAcross, v);
    p.down = plus(times(uDown, u), vDown, v);
}

}  // namespace stx::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
