#include "lib/base/halves.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/base/halves.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>

HWY_BEFORE_NAMESPACE();
namespace stx::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using DU = hn::RebindToUnsigned<DF>;
using VU = hn::Vec<DU>;

/// In integers, so that each target gives the same bits.
HWY_INLINE VU halfBits(DU d, VU bits) {
    const DF df;
    const VU sign = hn::And(hn::ShiftRight<16>(bits), hn::Set(d, 0x8000u));
    const VU size = hn::And(bits, hn::Set(d, 0x7fffffffu));
    // From 2^-14 on: the exponent's bias changes by 112, and 13 bits are rounded away.
    const VU odd = hn::And(hn::ShiftRight<13>(size), hn::Set(d, 1u));
    const VU normal =
        hn::ShiftRight<13>(hn::Add(hn::Add(size, hn::Set(d, 0xfffu - (112u << 23))), odd));
    // Below: the sum with 1/2 rounds at a half's smallest step, 2^-24.
    const VU denormal = hn::Sub(hn::BitCast(d, hn::Add(hn::BitCast(df, size), hn::Set(df, 0.5f))),
                                hn::Set(d, 126u << 23));
    // Sizes have no sign, so that they compare as signed numbers, which every target has.
    const auto above = [&](std::int32_t least) HWY_ATTR {
        const hn::RebindToSigned<DU> di;
        return hn::RebindMask(d, hn::Gt(hn::BitCast(di, size), hn::Set(di, least)));
    };
    const VU infinite = hn::Set(d, 0x7c00u), notANumber = hn::Set(d, 0x7e00u);
    const VU beyond = hn::IfThenElse(above(0x7f800000), notANumber, infinite);
    const VU finite = hn::IfThenElse(above((113 << 23) - 1), normal, denormal);
    return hn::Or(sign, hn::IfThenElse(above((143 << 23) - 1), beyond, finite));
}

HWY_INLINE void halvesOf(const float* from, std::uint16_t* to) {
    const DU d;
    const hn::Rebind<std::uint16_t, DU> half;
    const VU bits = hn::BitCast(d, hn::LoadU(DF(), from));
    hn::StoreU(hn::TruncateTo(half, halfBits(d, bits)), half, to);
}

void halvesImpl(const float* from, std::uint16_t* to, std::size_t count) {
    const std::size_t lanes = hn::Lanes(DF());
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) halvesOf(from + i, to + i);
    if (i == count) return;
    float last[hn::MaxLanes(DF())] = {};
    std::uint16_t halves[hn::MaxLanes(DF())];
    std::copy(from + i, from + count, last);
    halvesOf(last, halves);
    std::copy_n(halves, count - i, to + i);
}

void planesOfHalves(const float* from, int values, std::size_t count,
                    std::uint16_t* const* planes) {
    const DF d;
    const DU du;
    const hn::Rebind<std::uint16_t, DU> half;
    using VF = hn::Vec<DF>;
    const std::size_t lanes = hn::Lanes(d);
    const auto store = [&](VF v, std::uint16_t* to) HWY_ATTR {
        hn::StoreU(hn::TruncateTo(half, halfBits(du, hn::BitCast(du, v))), half, to);
    };
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) {
        VF a = hn::Zero(d), b = a, c = a, e = a;
        if (values == 3) {
            hn::LoadInterleaved3(d, from + 3 * i, a, b, c);
        } else {
            hn::LoadInterleaved4(d, from + 4 * i, a, b, c, e);
            store(e, planes[3] + i);
        }
        store(a, planes[0] + i);
        store(b, planes[1] + i);
        store(c, planes[2] + i);
    }
    for (; i < count; ++i)
        for (int k = 0; k < values; ++k)
            halvesImpl(from + i * static_cast<std::size_t>(values) + k, planes[k] + i, 1);
}

}  // namespace stx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx {

HWY_EXPORT(halvesImpl);
HWY_EXPORT(planesOfHalves);

void halvesFrom(const float* from, std::span<std::uint16_t> to) {
    HWY_DYNAMIC_DISPATCH(halvesImpl)(from, to.data(), to.size());
}

void halfPlanes(const float* from, int values, std::size_t count, std::uint16_t* const* planes) {
    HWY_DYNAMIC_DISPATCH(planesOfHalves)(from, values, count, planes);
}

}  // namespace stx
#endif
