// Large splats in patches of up to 4x4 pixels: all pixels of a patch at once. Included by
// kernels.cpp once for each SIMD target.

#if defined(STX_SPLAT_PATCH_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_SPLAT_PATCH_INL_HPP
#undef STX_SPLAT_PATCH_INL_HPP
#else
#define STX_SPLAT_PATCH_INL_HPP
#endif

#include <hwy/highway.h>

#include "lib/render/splat/cpu/accumulate-inl.hpp"
#include "lib/render/splat/cpu/point_colour-inl.hpp"
#include "lib/render/splat/cpu/shape-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::splat::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

HWY_INLINE void depthPatch(const Patch&, const Region&) {}
template <bool kOpaque, bool kNormals>
HWY_INLINE void colourPatch(const Patch&, const PointColour&, float, const Region&) {}

#else

// Pixels of a patch that fit a vector: whole rows of four.
constexpr int kLanes = HWY_HAVE_SCALABLE || HWY_MAX_BYTES < 32 ? 4 : HWY_MAX_BYTES < 64 ? 8 : 16;
constexpr int kRowsOfLanes = kLanes / kPatch;
using DP = hn::FixedTag<float, kLanes>;
using VP = hn::Vec<DP>;

// Four values of each row, `stride` floats apart.
HWY_INLINE VP loadRows(const float* from, std::ptrdiff_t stride) {
#if !HWY_HAVE_SCALABLE && HWY_MAX_BYTES >= 32
    const D4 d4;
    const hn::FixedTag<float, 8> d8;
    const auto two = hn::Combine(d8, hn::LoadU(d4, from + stride), hn::LoadU(d4, from));
#if HWY_MAX_BYTES >= 64
    from += 2 * stride;
    return hn::Combine(DP(), hn::Combine(d8, hn::LoadU(d4, from + stride), hn::LoadU(d4, from)),
                       two);
#else
    return two;
#endif
#else
    (void)stride;
    return hn::LoadU(DP(), from);
#endif
}

// Rows of a patch from `first` on: offsets from the splat, squared deviations, depth of its plane.
struct PatchRows {
    VP q, z;
    hn::Mask<DP> in;
};

HWY_INLINE PatchRows patchRows(const Patch& p, int first) {
    const DP d;
    const hn::RebindToSigned<DP> di;
    const auto lane = hn::Iota(di, 0);
    const VP column = hn::ConvertTo(d, hn::And(lane, hn::Set(di, kPatch - 1)));
    const VP row =
        hn::Add(hn::ConvertTo(d, hn::ShiftRight<2>(lane)), hn::Set(d, static_cast<float>(first)));
    const VP dx = hn::Add(column, hn::Set(d, p.dx));
    const VP dy = hn::Add(row, hn::Set(d, p.dy));
    PatchRows out;
    out.q = hn::MulAdd(dx, hn::MulAdd(dx, hn::Set(d, p.qxx), hn::Mul(dy, hn::Set(d, p.twiceQxy))),
                       hn::Mul(hn::Mul(dy, dy), hn::Set(d, p.qyy)));
    const VP z = hn::Set(d, p.z);
    out.z = hn::MulAdd(dx, hn::Set(d, p.zx), hn::MulAdd(dy, hn::Set(d, p.zy), z));
    // A plane that runs through the viewpoint must not hide all.
    out.z = hn::Max(out.z, hn::Mul(z, hn::Set(d, 0.5f)));
    out.in = hn::And(hn::Le(column, hn::Set(d, p.wide)), hn::Le(row, hn::Set(d, p.high)));
    return out;
}

HWY_INLINE void depthPatch(const Patch& patch, const Region& region) {
    const DP d;
    const D4 d4;
    HWY_ALIGN float depth[kLanes];
    float* to = region.depth + patch.at;
    for (int first = 0; first < kPatch; first += kRowsOfLanes) {
        const PatchRows p = patchRows(patch, first);
        const auto core = hn::And(p.in, hn::Le(p.q, hn::Set(d, patch.core2)));
        hn::Store(hn::IfThenElse(core, p.z, hn::Set(d, kInfinity)), d, depth);
        for (int row = 0; row < kRowsOfLanes; ++row, to += region.stride)
            hn::StoreU(hn::Min(hn::Load(d4, depth + kPatch * row), hn::LoadU(d4, to)), d4, to);
    }
}

// Adds four pixels of a row, each with its weight: `values` is the first vector of their values,
// `step` from a vector to the next.
HWY_INLINE void addRow(float* sums, const float* weights, VP values, VP step) {
    const DP d;
    const hn::RebindToSigned<DP> di;
    for (int pixel = 0; pixel < kPatch; pixel += kRowsOfLanes, values = hn::Add(values, step)) {
        const auto lane = hn::Add(hn::ShiftRight<2>(hn::Iota(di, 0)), hn::Set(di, pixel));
        const VP w = hn::TableLookupLanes(hn::LoadDup128(d, weights), hn::IndicesFromVec(d, lane));
        hn::StoreU(hn::MulAdd(w, values, hn::LoadU(d, sums + 4 * pixel)), d, sums + 4 * pixel);
    }
}

HWY_INLINE VP repeated(Four value) {
    HWY_ALIGN float four[4];
    store(value, four);
    return hn::LoadDup128(DP(), four);
}

template <bool kOpaque, bool kNormals>
HWY_INLINE void colourPatch(const Patch& patch, const PointColour& point, float tolerance,
                            const Region& region) {
    const DP d;
    const D4 d4;
    HWY_ALIGN float weights[kPatch * kPatch];
    const std::size_t start = patch.at;
    const std::ptrdiff_t stride = region.stride;
    std::uint32_t some = 0;  // a bit for each pixel
    for (int first = 0; first < kPatch; first += kRowsOfLanes) {
        const PatchRows p = patchRows(patch, first);
        const VP front = loadRows(region.depth + start + first * stride, stride);
        const auto near = hn::And(hn::And(p.in, hn::Lt(p.q, hn::Set(d, kReach2))),
                                  hn::Le(p.z, hn::Mul(front, hn::Set(d, 1.0f + tolerance))));
        // Falls off like a Gaussian and reaches zero at kReach2.
        const VP fall = hn::MulAdd(p.q, hn::Set(d, -1.0f / kReach2), hn::Set(d, 1.0f));
        const VP weight = hn::Mul(hn::Mul(fall, fall), hn::Mul(fall, hn::Set(d, patch.quality)));
        hn::Store(hn::IfThenElseZero(near, weight), d, weights + kPatch * first);
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, near, bits);
        some |= (bits[0] | (std::uint32_t{bits[1]} << 8)) << (kPatch * first);
    }
    if (!some) return;
    const hn::RebindToSigned<DP> di;
    const VP across = repeated(point.across), down = repeated(point.down);
    const VP dx =
        hn::Add(hn::ConvertTo(d, hn::ShiftRight<2>(hn::Iota(di, 0))), hn::Set(d, patch.dx));
    const VP dy = hn::Set(d, patch.dy);
    const VP step = hn::Mul(across, hn::Set(d, static_cast<float>(kRowsOfLanes)));
    const VP zero = hn::Zero(d);
    VP colour = hn::MulAdd(dx, across, hn::MulAdd(dy, down, repeated(point.colour)));
    // Rows without a pixel get zeros added: which rows these are no processor can foresee.
    for (int row = 0; row < kPatch; ++row, colour = hn::Add(colour, down)) {
        const std::size_t at = start + static_cast<std::size_t>(row * stride);
        const float* w = weights + kPatch * row;
        addRow(region.colour + 4 * at, w, colour, step);
        if (!kOpaque && point.missing > 0) {
            float* missing = region.missing + at;
            hn::StoreU(
                hn::MulAdd(hn::Load(d4, w), hn::Set(d4, point.missing), hn::LoadU(d4, missing)), d4,
                missing);
        }
        if (kNormals) addRow(region.normals + 4 * at, w, repeated(point.normal), zero);
    }
}

#endif

}  // namespace stx::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
