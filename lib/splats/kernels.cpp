#include "lib/splats/kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/splats/kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace stx::splats::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, kTile>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;

// exp(x) for -87 <= x <= 0, to two units of the last place: 2^n times a polynomial of the rest.
HWY_INLINE VF expOf(DF d, VF x) {
    const DI di;
    const VF scaled = hn::Mul(x, hn::Set(d, 1.44269504f));
    const VF whole = hn::Round(scaled);
    // ln 2 in two parts.
    VF r = hn::NegMulAdd(whole, hn::Set(d, 0.693359375f), x);
    r = hn::NegMulAdd(whole, hn::Set(d, -2.12194440e-4f), r);
    VF p = hn::Set(d, 1.9875691500e-4f);
    for (const float c :
         {1.3981999507e-3f, 8.3334519073e-3f, 4.1665795894e-2f, 1.6666665459e-1f, 5.0000001201e-1f})
        p = hn::MulAdd(p, r, hn::Set(d, c));
    p = hn::Add(hn::MulAdd(hn::Mul(p, r), r, r), hn::Set(d, 1.0f));
    const auto exponent = hn::ShiftLeft<23>(hn::Add(hn::ConvertTo(di, whole), hn::Set(di, 127)));
    return hn::Mul(p, hn::BitCast(d, exponent));
}

// Nothing behind shows any more, anywhere in the tile.
HWY_INLINE bool isFull(DF d, const TilePixels& pixels) {
    constexpr float kFull = 1e-4f;
    const std::size_t lanes = hn::Lanes(d);
    VF most = hn::Zero(d);
    for (std::size_t i = 0; i < kTilePixels; i += lanes)
        most = hn::Max(most, hn::Load(d, pixels.transmittance.data() + i));
    return hn::AllTrue(d, hn::Lt(most, hn::Set(d, kFull)));
}

void blendTileImpl(const Projected* splats, const std::uint32_t* order, std::size_t count, int left,
                   int top, TilePixels& pixels) {
    constexpr std::size_t kLookEvery = 32;
    const DF d;
    const DI di;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const VF half = hn::Set(d, 0.5f), most = hn::Set(d, 0.99f), least = hn::Set(d, 1.0f / 255.0f);
    for (std::size_t i = 0; i < count; ++i) {
        if (i % kLookEvery == 0 && i > 0 && isFull(d, pixels)) return;
        const Projected& s = splats[order[i]];
        // Of pixel centres, counted from the tile's first.
        const float x = s.x - 0.5f - static_cast<float>(left),
                    y = s.y - 0.5f - static_cast<float>(top);
        const auto within = [](float v) {
            return static_cast<int>(std::clamp(v, -1.0f, static_cast<float>(kTile)));
        };
        const int x0 = std::max(0, within(std::ceil(x - s.halfX))),
                  x1 = std::min(kTile - 1, within(std::floor(x + s.halfX))),
                  y0 = std::max(0, within(std::ceil(y - s.halfY))),
                  y1 = std::min(kTile - 1, within(std::floor(y + s.halfY)));
        const VF xx = hn::Set(d, s.xx), opacity = hn::Set(d, s.opacity), cut = hn::Set(d, s.cut);
        for (int row = y0; row <= y1; ++row) {
            const float dy = static_cast<float>(row) - y;
            const VF ofY = hn::Set(d, s.yy * dy * s.yy * dy), along = hn::Set(d, s.xy * dy);
            for (int column = x0 / lanes * lanes; column <= x1; column += lanes) {
                const VF dx = hn::Sub(hn::Iota(d, static_cast<float>(column)), hn::Set(d, x));
                const VF across = hn::MulAdd(xx, dx, along);
                const VF q = hn::MulAdd(across, across, ofY);
                auto in = hn::Le(q, cut);
                if (hn::AllFalse(d, in)) continue;
                const VF alpha = hn::Min(
                    hn::Mul(opacity, expOf(d, hn::Mul(hn::Min(q, cut), hn::Set(d, -0.5f)))), most);
                in = hn::And(in, hn::Ge(alpha, least));
                const std::size_t at = static_cast<std::size_t>(row * kTile + column);
                const VF before = hn::Load(d, pixels.transmittance.data() + at);
                const VF weight = hn::IfThenElseZero(in, hn::Mul(before, alpha));
                const VF after = hn::Sub(before, weight);
                hn::Store(after, d, pixels.transmittance.data() + at);
                const auto add = [&](std::array<float, kTilePixels>& to, float value) HWY_ATTR {
                    float* p = to.data() + at;
                    hn::Store(hn::MulAdd(weight, hn::Set(d, value), hn::Load(d, p)), d, p);
                };
                add(pixels.red, s.red);
                add(pixels.green, s.green);
                add(pixels.blue, s.blue);
                const auto crosses = hn::And(hn::Ge(before, half), hn::Lt(after, half));
                if (hn::AllFalse(d, crosses)) continue;
                std::int32_t* median = pixels.median.data() + at;
                hn::Store(hn::IfThenElse(hn::RebindMask(di, crosses),
                                         hn::Set(di, static_cast<std::int32_t>(order[i])),
                                         hn::Load(di, median)),
                          di, median);
            }
        }
    }
}

void addHarmonicsImpl(const std::uint16_t* harmonics, int padded, const float* basis,
                      float* colour) {
    const hn::CappedTag<float, 4> d;
    const hn::Rebind<hwy::float16_t, decltype(d)> dh;
    const int lanes = static_cast<int>(hn::Lanes(d));
    for (int channel = 0; channel < 3; ++channel, harmonics += padded) {
        auto sum = hn::Zero(d);
        for (int i = 0; i < padded; i += lanes) {
            const auto half = hn::LoadU(dh, reinterpret_cast<const hwy::float16_t*>(harmonics + i));
            sum = hn::MulAdd(hn::PromoteTo(d, half), hn::LoadU(d, basis + i), sum);
        }
        colour[channel] += hn::GetLane(hn::SumOfLanes(d, sum));
    }
}

}  // namespace stx::splats::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::splats {

HWY_EXPORT(blendTileImpl);
HWY_EXPORT(addHarmonicsImpl);

void blendTile(const Projected* splats, const std::uint32_t* order, std::size_t count, int left,
               int top, TilePixels& pixels) {
    HWY_DYNAMIC_DISPATCH(blendTileImpl)(splats, order, count, left, top, pixels);
}

void addHarmonics(const std::uint16_t* harmonics, int padded, const float* basis, float* colour) {
    HWY_DYNAMIC_DISPATCH(addHarmonicsImpl)(harmonics, padded, basis, colour);
}

}  // namespace stx::splats
#endif
