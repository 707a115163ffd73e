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
    int stride;
    const DepthAxis& axis;
    float step;
    int perPixel;
    TileMiddles& out;

    /// The q by which a share of the depth is multiplied.
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

    using Floats = hn::CappedTag<float, 16>;
    using Words = hn::RebindToUnsigned<Floats>;
    using V = hn::Vec<Floats>;
    using U = hn::Vec<Words>;
    using M = hn::Mask<Floats>;

    /// What the sources show at some pixels of a row. Sources are bits.
    struct Summary {
        V front, sum, count;  ///< the nearest surface, and the mean of those who show it
        V nearest;            ///< of the samples that are not sure
        V slopeX, slopeY;     ///< of `front`, a pixel
        U shown, behind;      ///< who shows `front`, and who something behind it
        U others;             ///< who is not sure
    };
    static HWY_INLINE M asFloats(hn::Mask<Words> mask) { return hn::RebindMask(Floats(), mask); }
    static HWY_INLINE hn::Mask<Words> asBits(M mask) { return hn::RebindMask(Words(), mask); }
    static HWY_INLINE hn::Mask<Words> flagged(V q, std::uint32_t flags) {
        const Words du;
        return hn::Ne(hn::And(hn::BitCast(du, q), hn::Set(du, flags)), hn::Zero(du));
    }

    /// addSource() of surface_fuse.glsl: source `k`, whose samples are `at`.
    HWY_INLINE void addSource(std::size_t k, const float* at, bool inside, Summary& s) const {
        const Floats d;
        const Words du;
        const V zero = hn::Zero(d);
        const V q = hn::LoadU(d, at);
        const M there = hn::Gt(q, zero);
        if (hn::AllFalse(d, there)) return;
        const U bit = hn::Set(du, 1u << k);
        const M notSure = asFloats(flagged(q, std::uint32_t{kSampleFlags}));
        const M unsure = hn::And(there, notSure), sure = hn::AndNot(notSure, there);
        s.others = hn::Or(s.others, hn::IfThenElseZero(asBits(unsure), bit));
        s.nearest = hn::Max(s.nearest, hn::IfThenElseZero(unsure, q));
        const V same = within(d, s.front, kSame);
        const M has = hn::Gt(s.front, zero);
        const M farther = hn::And(hn::And(sure, has), hn::Lt(q, hn::Sub(s.front, same)));
        const M nearer = hn::And(sure, hn::Or(hn::Not(has), hn::Gt(q, hn::Add(s.front, same))));
        s.behind = hn::Or(s.behind, hn::IfThenElseZero(asBits(farther), bit));
        if (!hn::AllFalse(d, nearer)) {
            s.behind = hn::Or(s.behind, hn::IfThenElseZero(asBits(nearer), s.shown));
            s.shown = hn::IfThenZeroElse(asBits(nearer), s.shown);
            s.sum = hn::IfThenZeroElse(nearer, s.sum);
            s.count = hn::IfThenZeroElse(nearer, s.count);
            s.front = hn::IfThenElse(nearer, q, s.front);
            if (inside) {
                const V limit = hn::Mul(hn::Set(d, kLinkedSamples), scaleOf(d, q));
                const V sx = slopeFrom(d, q, hn::LoadU(d, at - 1), hn::LoadU(d, at + 1), limit);
                const V sy =
                    slopeFrom(d, q, hn::LoadU(d, at - stride), hn::LoadU(d, at + stride), limit);
                s.slopeX = hn::IfThenElse(nearer, sx, s.slopeX);
                s.slopeY = hn::IfThenElse(nearer, sy, s.slopeY);
            }
        }
        const M joins = hn::AndNot(farther, sure);
        s.shown = hn::Or(s.shown, hn::IfThenElseZero(asBits(joins), bit));
        s.sum = hn::Add(s.sum, hn::IfThenElseZero(joins, q));
        s.count = hn::Add(s.count, hn::IfThenElseZero(joins, hn::Set(d, 1.0f)));
    }

    /// isSimple() of that code.
    HWY_INLINE M isSimple(const Summary& s, M several) const {
        const Floats d;
        // From the first to the last sample of a pixel.
        const V across =
            hn::Set(d, static_cast<float>(perPixel - 1) / static_cast<float>(perPixel));
        const V range = hn::Mul(hn::Add(hn::Abs(s.slopeX), hn::Abs(s.slopeY)), across);
        const M oneSurface = hn::Le(range, hn::Mul(hn::Set(d, kOneSurface), scaleOf(d, s.front)));
        const M sureOfIt = hn::And(hn::And(several, hn::Le(range, within(d, s.front, kJump))),
                                   hn::Le(s.nearest, hn::Add(s.front, within(d, s.front, kSame))));
        const M nothingElse = asFloats(hn::Eq(hn::Or(s.behind, s.others), hn::Zero(Words())));
        return hn::And(hn::And(hn::Gt(s.front, hn::Zero(d)), oneSurface),
                       hn::Or(nothingElse, sureOfIt));
    }

    /// alsoShows() of that code: those of `others` that show `front`; `at` samples from a source's
    /// first.
    HWY_INLINE U alsoShow(const Summary& s, std::ptrdiff_t at) const {
        const Floats d;
        const Words du;
        const V least = hn::Sub(s.front, within(d, s.front, kSame));
        U shown = hn::Zero(du);
        for (std::size_t k = 0; k < sources.size(); ++k) {
            const float* samples = sources[k].samples;
            const U asked = hn::And(s.others, hn::Set(du, 1u << k));
            if (!samples || hn::AllFalse(du, hn::Ne(asked, hn::Zero(du)))) continue;
            const V q = hn::LoadU(d, samples + at);
            const auto shows = hn::And(asBits(hn::Gt(q, least)),
                                       hn::Not(flagged(q, std::uint32_t{kExtensionBit})));
            shown = hn::Or(shown, hn::IfThenElseZero(shows, asked));
        }
        return shown;
    }

    /// What the sources show at the pixels of a row, whose range in a pixel is what their slope
    /// makes of it.
    HWY_INLINE void summariseRow(int row) const {
        const Floats d;
        const Words du;
        const V zero = hn::Zero(d);
        const U none = hn::Zero(du);
        const bool inside = row > 0 && row <= kTile;
        const auto r = static_cast<std::size_t>(row);
        for (int x = 0; x < kMiddlesSide; x += static_cast<int>(hn::Lanes(d))) {
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(row) * stride + x;
            Summary s{zero, zero, zero, zero, zero, zero, none, none, none};
            for (std::size_t k = 0; k < sources.size(); ++k)
                if (sources[k].samples) addSource(k, sources[k].samples + at, inside, s);
            const M several = hn::Gt(s.count, hn::Set(d, 1.0f));
            const M simple = isSimple(s, several);
            if (!hn::AllFalse(du, hn::Ne(s.others, none)))
                s.shown = hn::Or(s.shown, alsoShow(s, at));
            const M any = hn::Or(hn::Gt(s.front, zero), hn::Gt(s.nearest, zero));
            const V q = hn::IfThenElse(simple, hn::Div(s.sum, hn::Max(s.count, hn::Set(d, 1.0f))),
                                       hn::IfThenElseZero(any, hn::Set(d, -1.0f)));
            const auto column = static_cast<std::size_t>(x);
            hn::StoreU(q, d, &out.q[r][column]);
            hn::StoreU(s.slopeX, d, &out.qx[r][column]);
            hn::StoreU(s.slopeY, d, &out.qy[r][column]);
            hn::StoreU(s.shown, du, &out.seenBy[r][column]);
            hn::StoreU(hn::IfThenZeroElse(asBits(several), hn::Set(du, 1u)), du,
                       &out.alone[r][column]);
        }
    }

    /// Which pixels of a row of the tile are settled, from the q around.
    HWY_INLINE void settleRow(int y) const {
        const Floats d;
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

void SettlePixels(std::span<const LocalSource> sources, int stride, const DepthAxis& axis,
                  float step, int perPixel, TileMiddles& out) {
    const Settler settler{sources, stride, axis, step, perPixel, out};
    for (int row = 0; row < kMiddlesSide; ++row) settler.summariseRow(row);
    for (int y = 0; y < kTile; ++y) settler.settleRow(y);
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::surface {

HWY_EXPORT(SettlePixels);

void settlePixels(std::span<const LocalSource> sources, int stride, const DepthAxis& axis,
                  float step, int perPixel, TileMiddles& out) {
    HWY_DYNAMIC_DISPATCH(SettlePixels)(sources, stride, axis, step, perPixel, out);
}

}  // namespace stx::surface
#endif
