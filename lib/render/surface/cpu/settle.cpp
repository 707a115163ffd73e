#include "lib/render/surface/cpu/settle.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/cpu/settle.cpp"
#include <hwy/foreach_target.h>  // NOLINT: must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// The slope out of the differences to both sides, as shaders/shared/surface_slope.glsl has it.
template <class D, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE V slopeFrom(D d, V here, V before, V after, V limit) {
    const V zero = hn::Zero(d), half = hn::Set(d, 0.5f);
    const V a = hn::Sub(here, before), b = hn::Sub(after, here);
    const V sizeA = hn::Abs(a), sizeB = hn::Abs(b);
    const M hasA = hn::And(hn::Gt(before, zero), hn::Lt(sizeA, limit));
    const M hasB = hn::And(hn::Gt(after, zero), hn::Lt(sizeB, limit));
    V both = hn::Mul(half, hn::Add(a, b));
    both = hn::IfThenElse(hn::Lt(sizeB, hn::Mul(half, sizeA)), b, both);
    both = hn::IfThenElse(hn::Lt(sizeA, hn::Mul(half, sizeB)), a, both);
    return hn::IfThenElse(hn::And(hasA, hasB), both,
                          hn::IfThenElse(hasA, a, hn::IfThenElseZero(hasB, b)));
}

struct Settler {
    std::span<const LocalSource> sources;
    const DepthAxis& axis;
    float step;
    int perPixel;
    TileMiddles& out;

    /// What a share of depth is of, in q.
    template <class D, class V>
    HWY_INLINE V scaleOf(D d, V q) const {
        return axis.inverse ? q : hn::Set(d, 1.0f);
    }
    /// sameWithin() and oneWithin() of surface_fuse.glsl.
    template <class D, class V>
    HWY_INLINE V within(D d, V q, float share) const {
        const V steps = axis.inverse ? hn::Mul(q, q) : hn::Set(d, axis.qPerUnit(1.0f));
        return hn::MulAdd(hn::Set(d, share), scaleOf(d, q), hn::Mul(hn::Set(d, step), steps));
    }

    /// addSource(), isSimple() and alsoShows() of that code, for the pixels of a row whose range in
    /// a pixel is what their slope makes of it.
    HWY_INLINE void summariseRow(int row) const {
        const hn::CappedTag<float, 16> d;
        const hn::RebindToUnsigned<decltype(d)> du;
        using V = hn::Vec<decltype(d)>;
        using U = hn::Vec<decltype(du)>;
        const int n = static_cast<int>(hn::Lanes(d));
        const int stride = kMiddles.stride();
        const bool inside = row > 0 && row <= kTile;
        const auto r = static_cast<std::size_t>(row);
        const V zero = hn::Zero(d);
        const U none = hn::Zero(du);
        const auto asFloats = [&](auto mask) HWY_ATTR { return hn::RebindMask(d, mask); };
        const auto asBits = [&](auto mask) HWY_ATTR { return hn::RebindMask(du, mask); };
        // From the first to the last sample of a pixel.
        const V across =
            hn::Set(d, static_cast<float>(perPixel - 1) / static_cast<float>(perPixel));
        for (int x = 0; x < kMiddlesSide; x += n) {
            V front = zero, sum = zero, nearest = zero, slopeX = zero, slopeY = zero, count = zero;
            U shown = none, behind = none, others = none;
            for (std::size_t k = 0; k < sources.size(); ++k) {
                const float* samples = sources[k].samples;
                if (!samples) continue;
                const float* at = samples + static_cast<std::ptrdiff_t>(row) * stride + x;
                const V q = hn::LoadU(d, at);
                const auto there = hn::Gt(q, zero);
                if (hn::AllFalse(d, there)) continue;
                const U bit = hn::Set(du, 1u << k);
                const auto flagged = asFloats(hn::Ne(
                    hn::And(hn::BitCast(du, q), hn::Set(du, std::uint32_t{kSampleFlags})), none));
                const auto unsure = hn::And(there, flagged), sure = hn::AndNot(flagged, there);
                others = hn::Or(others, hn::IfThenElseZero(asBits(unsure), bit));
                nearest = hn::Max(nearest, hn::IfThenElseZero(unsure, q));
                const V same = within(d, front, kSame);
                const auto has = hn::Gt(front, zero);
                const auto farther = hn::And(hn::And(sure, has), hn::Lt(q, hn::Sub(front, same)));
                const auto nearer =
                    hn::And(sure, hn::Or(hn::Not(has), hn::Gt(q, hn::Add(front, same))));
                behind = hn::Or(behind, hn::IfThenElseZero(asBits(farther), bit));
                if (!hn::AllFalse(d, nearer)) {
                    behind = hn::Or(behind, hn::IfThenElseZero(asBits(nearer), shown));
                    shown = hn::IfThenZeroElse(asBits(nearer), shown);
                    sum = hn::IfThenZeroElse(nearer, sum);
                    count = hn::IfThenZeroElse(nearer, count);
                    front = hn::IfThenElse(nearer, q, front);
                    if (inside) {
                        const V limit = hn::Mul(hn::Set(d, kLinkedSamples), scaleOf(d, q));
                        const V sx =
                            slopeFrom(d, q, hn::LoadU(d, at - 1), hn::LoadU(d, at + 1), limit);
                        const V sy = slopeFrom(d, q, hn::LoadU(d, at - stride),
                                               hn::LoadU(d, at + stride), limit);
                        slopeX = hn::IfThenElse(nearer, sx, slopeX);
                        slopeY = hn::IfThenElse(nearer, sy, slopeY);
                    }
                }
                const auto joins = hn::AndNot(farther, sure);
                shown = hn::Or(shown, hn::IfThenElseZero(asBits(joins), bit));
                sum = hn::Add(sum, hn::IfThenElseZero(joins, q));
                count = hn::Add(count, hn::IfThenElseZero(joins, hn::Set(d, 1.0f)));
            }
            const auto has = hn::Gt(front, zero);
            const V same = within(d, front, kSame);
            const V range = hn::Mul(hn::Add(hn::Abs(slopeX), hn::Abs(slopeY)), across);
            const auto several = hn::Gt(count, hn::Set(d, 1.0f));
            const auto oneSurface =
                hn::Le(range, hn::Mul(hn::Set(d, kOneSurface), scaleOf(d, front)));
            const auto sureOfIt = hn::And(hn::And(several, hn::Le(range, within(d, front, kJump))),
                                          hn::Le(nearest, hn::Add(front, same)));
            const auto nothingElse = asFloats(hn::Eq(hn::Or(behind, others), none));
            const auto simple = hn::And(hn::And(has, oneSurface), hn::Or(nothingElse, sureOfIt));
            if (!hn::AllFalse(du, hn::Ne(others, none))) {
                for (std::size_t k = 0; k < sources.size(); ++k) {
                    const float* samples = sources[k].samples;
                    const U bit = hn::Set(du, 1u << k);
                    if (!samples || hn::AllFalse(du, hn::Ne(hn::And(others, bit), none))) continue;
                    const V q =
                        hn::LoadU(d, samples + static_cast<std::ptrdiff_t>(row) * stride + x);
                    const auto mesh = hn::Eq(
                        hn::And(hn::BitCast(du, q), hn::Set(du, std::uint32_t{kExtensionBit})),
                        none);
                    const auto shows = hn::And(asBits(hn::Gt(q, hn::Sub(front, same))), mesh);
                    shown = hn::Or(shown, hn::IfThenElseZero(shows, hn::And(others, bit)));
                }
            }
            const auto any = hn::Or(has, hn::Gt(nearest, zero));
            const V q = hn::IfThenElse(simple, hn::Div(sum, hn::Max(count, hn::Set(d, 1.0f))),
                                       hn::IfThenElseZero(any, hn::Set(d, -1.0f)));
            hn::StoreU(q, d, &out.q[r][static_cast<std::size_t>(x)]);
            hn::StoreU(slopeX, d, &out.qx[r][static_cast<std::size_t>(x)]);
            hn::StoreU(slopeY, d, &out.qy[r][static_cast<std::size_t>(x)]);
            hn::StoreU(shown, du, &out.seenBy[r][static_cast<std::size_t>(x)]);
            hn::StoreU(hn::IfThenZeroElse(asBits(several), hn::Set(du, 1u)), du,
                       &out.alone[r][static_cast<std::size_t>(x)]);
        }
    }

    /// Which pixels of a row of the tile are settled, from the q around.
    HWY_INLINE void settleRow(int y) const {
        const hn::CappedTag<float, 16> d;
        using V = hn::Vec<decltype(d)>;
        const int n = static_cast<int>(hn::Lanes(d));
        const auto r = static_cast<std::size_t>(y);
        std::uint32_t settled = 0, empty = 0;
        for (int x = 0; x < kTile; x += n) {
            V least = hn::Set(d, 3.0e38f), most = hn::Set(d, -1.0f);
            for (std::size_t j = r; j < r + 3; ++j) {
                for (std::size_t i = 0; i < 3; ++i) {
                    const V q = hn::LoadU(d, &out.q[j][static_cast<std::size_t>(x) + i]);
                    least = hn::Min(least, q);
                    most = hn::Max(most, q);
                }
            }
            const V q = hn::LoadU(d, &out.q[r + 1][static_cast<std::size_t>(x) + 1]);
            const V limit = hn::Mul(hn::Set(d, kOneSurface), scaleOf(d, q));
            const auto one =
                hn::And(hn::Gt(least, hn::Zero(d)),
                        hn::And(hn::Le(hn::Sub(most, q), limit), hn::Le(hn::Sub(q, least), limit)));
            const auto nothing = hn::And(hn::Eq(least, hn::Zero(d)), hn::Eq(most, hn::Zero(d)));
            const auto bitsOf = [&](auto mask) HWY_ATTR {
                std::uint8_t bytes[8] = {};
                hn::StoreMaskBits(d, mask, bytes);
                std::uint32_t bits = 0;
                for (int b = 0; b < 4; ++b) bits |= std::uint32_t{bytes[b]} << (8 * b);
                return (bits & ((1u << n) - 1)) << x;
            };
            settled |= bitsOf(one);
            empty |= bitsOf(nothing);
        }
        out.settled[r] = settled;
        out.empty[r] = empty;
    }
};

void SettlePixels(std::span<const LocalSource> sources, const DepthAxis& axis, float step,
                  int perPixel, TileMiddles& out) {
    const Settler settler{sources, axis, step, perPixel, out};
    for (int row = 0; row < kMiddlesSide; ++row) settler.summariseRow(row);
    for (int y = 0; y < kTile; ++y) settler.settleRow(y);
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::surface {

HWY_EXPORT(SettlePixels);

void settlePixels(std::span<const LocalSource> sources, const DepthAxis& axis, float step,
                  int perPixel, TileMiddles& out) {
    HWY_DYNAMIC_DISPATCH(SettlePixels)(sources, axis, step, perPixel, out);
}

}  // namespace stx::surface
#endif
