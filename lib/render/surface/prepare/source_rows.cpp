#include "lib/render/surface/prepare/source_rows.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/prepare/source_rows.cpp"
#include <hwy/foreach_target.h>  // NOLINT: must come before highway.h
#include <hwy/highway.h>

#include <algorithm>

#ifndef STX_SOURCE_ROWS_ONCE
#define STX_SOURCE_ROWS_ONCE
namespace stx::surface {

// Chosen by trial on the project's image sets and meshes.

/// Neighbours whose q differ by less than this share of it are one surface; by more than the
/// second, never; between them, when the slope goes on within this share of the step.
inline constexpr float kLinkAlways = 0.005f, kLinkNever = 0.03f, kSameSlope = 0.5f;
/// In coarse views, whose pixels are so large a share, not before so many pixels' sizes: a face
/// seen at 83 degrees. Of 91 random cases 5, 8, 12 and 20 raise the mean by 0.085, 0.093, 0.074 and
/// 0.078 dB against 3; a room of 45 pixels from 24.5 to 37.7, a plate from 10 to 27.
inline constexpr float kLinkSteepest = 8.0f;
/// Steps of the depth code that neighbours may differ by all the same: one, and rounding.
inline constexpr float kLinkSteps = 1.5f;

}  // namespace stx::surface
#endif

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<DF>;
using D8 = hn::Rebind<std::uint8_t, DI>;
using VF = hn::Vec<DF>;
using MF = hn::Mask<DF>;

/// Where bytes are not 0, in lanes of floats.
HWY_INLINE MF setIn(const std::uint8_t* bytes) {
    const DI di;
    const auto wide = hn::PromoteTo(di, hn::LoadU(D8(), bytes));
    return hn::RebindMask(DF(), hn::Ne(wide, hn::Zero(di)));
}

void invertImpl(const float* distances, const std::uint8_t* covered, std::size_t count, float none,
                float* q) {
    const DF d;
    const std::size_t lanes = hn::Lanes(d);
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) {
        const VF dist = hn::LoadU(d, distances + i);
        const MF point = hn::And(hn::Gt(dist, hn::Zero(d)), hn::Lt(dist, hn::Set(d, kNoDepth)));
        const VF other = hn::IfThenElseZero(setIn(covered + i), hn::Set(d, none));
        hn::StoreU(hn::IfThenElse(point, hn::Div(hn::Set(d, 1.0f), dist), other), d, q + i);
    }
    for (; i < count; ++i)
        q[i] = hasPoint(distances[i]) && distances[i] > 0.0f ? 1.0f / distances[i]
               : covered[i] != 0                             ? none
                                                             : 0.0f;
}

void countImpl(const float* q, const std::uint8_t* covered, std::size_t count,
               DraftCounts& counts) {
    const DF d;
    const std::size_t lanes = hn::Lanes(d);
    std::size_t i = 0, points = 0, object = 0, full = 0;
    for (; i + lanes <= count; i += lanes) {
        const MF point = hn::Gt(hn::LoadU(d, q + i), hn::Zero(d)), inside = setIn(covered + i);
        points += hn::CountTrue(d, point);
        full += hn::CountTrue(d, inside);
        object += hn::CountTrue(d, hn::Or(point, inside));
    }
    for (; i < count; ++i) {
        points += q[i] > 0.0f ? 1 : 0;
        full += covered[i] != 0 ? 1 : 0;
        object += q[i] > 0.0f || covered[i] != 0 ? 1 : 0;
    }
    counts = {static_cast<std::int64_t>(points), static_cast<std::int64_t>(object),
              static_cast<std::int64_t>(full)};
}

struct Linker {
    const DepthAxis& axis;
    float step;

    /// Whether neighbours b and c lie on one surface, given the pixels before and after them (0 or
    /// less = none). Small steps always do; larger ones when the surface goes on with the same
    /// slope.
    HWY_INLINE MF linked(VF before, VF b, VF c, VF after) const {
        const DF d;
        const VF zero = hn::Zero(d), change = hn::Sub(c, b), size = hn::Abs(change);
        const VF nearer = hn::Max(b, c);
        const VF coarse = hn::Set(d, static_cast<float>(axis.coarse));
        const VF scale = axis.inverse ? hn::Mul(nearer, coarse) : coarse;
        const VF perUnit = axis.inverse ? hn::Mul(nearer, nearer) : hn::Set(d, axis.qPerUnit(1.0f));
        const MF small = hn::Lt(size, hn::Add(hn::Mul(hn::Set(d, kLinkAlways), scale),
                                              hn::Mul(hn::Set(d, kLinkSteps * step), perUnit)));
        const float never = std::max(kLinkNever * std::min(1.0f, static_cast<float>(axis.coarse)),
                                     kLinkSteepest * axis.pixelShare());
        const MF possible =
            hn::Lt(size, axis.inverse ? hn::Mul(nearer, hn::Set(d, never)) : hn::Set(d, never));
        const VF agree = hn::Mul(hn::Set(d, kSameSlope), size);
        const MF goesOn =
            hn::Or(hn::And(hn::Gt(before, zero),
                           hn::Lt(hn::Abs(hn::Sub(change, hn::Sub(b, before))), agree)),
                   hn::And(hn::Gt(after, zero),
                           hn::Lt(hn::Abs(hn::Sub(change, hn::Sub(after, c))), agree)));
        return hn::And(hn::And(hn::Gt(b, zero), hn::Gt(c, zero)),
                       hn::Or(small, hn::And(possible, goesOn)));
    }

    /// Pixels whose neighbours can all be read.
    HWY_INLINE void some(const LinkRows& rows, std::uint8_t* info) const {
        const DF d;
        const DI di;
        const VF zero = hn::Zero(d), q = hn::LoadU(d, rows.here);
        const VF left = hn::LoadU(d, rows.here - 1), right = hn::LoadU(d, rows.here + 1);
        const VF above = hn::LoadU(d, rows.above), below = hn::LoadU(d, rows.below);
        const auto bit = [&](MF mask, int value) HWY_ATTR {
            return hn::IfThenElseZero(hn::RebindMask(di, mask), hn::Set(di, value));
        };
        MF beside = hn::Or(hn::Eq(left, zero), hn::Eq(right, zero));
        if (!rows.first) beside = hn::Or(beside, hn::Eq(above, zero));
        if (!rows.last) beside = hn::Or(beside, hn::Eq(below, zero));
        const auto bits = hn::Or(
            hn::Or(bit(linked(left, q, right, hn::LoadU(d, rows.here + 2)), Info::kLinkRight),
                   bit(linked(above, q, below, hn::LoadU(d, rows.second)), Info::kLinkDown)),
            bit(hn::And(beside, hn::Gt(q, zero)), Info::kBesideBackground));
        hn::StoreU(hn::DemoteTo(D8(), bits), D8(), info);
    }

    /// The pixels from x on, of which some are beyond the row or have neighbours there.
    HWY_INLINE void atEnds(const LinkRows& rows, int x, int width, std::uint8_t* info) const {
        constexpr std::size_t kMost = hn::MaxLanes(DF());
        const int lanes = static_cast<int>(hn::Lanes(DF()));
        float above[kMost] = {}, below[kMost] = {}, second[kMost] = {};
        // Beyond the picture lies nothing, which is not the same as background.
        float here[kMost + 3];
        std::fill(here, here + kMost + 3, -1.0f);
        const int count = std::min(lanes, width - x);
        std::copy_n(rows.above + x, count, above);
        std::copy_n(rows.below + x, count, below);
        std::copy_n(rows.second + x, count, second);
        const int first = std::max(x - 1, 0), end = std::min(x + lanes + 2, width);
        std::copy(rows.here + first, rows.here + end, here + (first - (x - 1)));
        std::uint8_t bits[kMost];
        some({above, here + 1, below, second, rows.first, rows.last}, bits);
        std::copy_n(bits, count, info + x);
    }
};

void linkRowImpl(const LinkRows& rows, int width, const DepthAxis& axis, float step,
                 std::uint8_t* info) {
    const Linker linker{axis, step};
    const int lanes = static_cast<int>(hn::Lanes(DF()));
    linker.atEnds(rows, 0, width, info);
    int x = lanes;
    for (; x + lanes + 2 <= width; x += lanes)
        linker.some(
            {rows.above + x, rows.here + x, rows.below + x, rows.second + x, rows.first, rows.last},
            info + x);
    for (; x < width; x += lanes) linker.atEnds(rows, x, width, info);
}

#if HWY_TARGET == HWY_SCALAR
// Its vectors have no parts.
std::size_t sharpenImpl(const glm::u8vec4*, const std::uint8_t*, std::ptrdiff_t, std::size_t, int,
                        int, glm::u8vec4*) {
    return 0;
}
#else
std::size_t sharpenImpl(const glm::u8vec4* from, const std::uint8_t* info, std::ptrdiff_t stride,
                        std::size_t count, int fromEdge, int share, glm::u8vec4* to) {
    const DI di;
    const hn::Repartition<std::uint8_t, DI> d8;
    const hn::Repartition<std::int16_t, DI> d16;
    const hn::Repartition<std::uint16_t, DI> du16;
    const std::size_t lanes = hn::Lanes(di);
    const auto bytesAt = [&](const glm::u8vec4* p)
                             HWY_ATTR { return hn::BitCast(du16, hn::LoadU(d8, &p->x)); };
    const auto infoAt = [&](const std::uint8_t* p)
                            HWY_ATTR { return hn::PromoteTo(di, hn::LoadU(D8(), p)); };
    /// Every second byte: channels 0 and 2, or 1 and 3.
    const auto half = [&](auto pixels, bool odd) HWY_ATTR {
        return hn::BitCast(d16, odd ? hn::ShiftRight<8>(pixels)
                                    : hn::And(pixels, hn::Set(du16, std::uint16_t{0xff})));
    };
    const auto sharper = [&](auto here, auto left, auto right, auto above, auto below) HWY_ATTR {
        const auto beside = hn::Add(hn::Add(left, right), hn::Add(above, below));
        const auto more =
            hn::ShiftRight<8>(hn::Add(hn::Mul(hn::Sub(hn::ShiftLeft<2>(here), beside),
                                              hn::Set(d16, static_cast<std::int16_t>(share))),
                                      hn::Set(d16, std::int16_t{128})));
        return hn::BitCast(du16, hn::Min(hn::Max(hn::Add(here, more), hn::Zero(d16)),
                                         hn::Set(d16, std::int16_t{255})));
    };
    const auto hasBit = [&](auto bits, int bit) HWY_ATTR {
        return hn::Ne(hn::And(bits, hn::Set(di, bit)), hn::Zero(di));
    };
    const auto alpha = hn::Set(di, static_cast<std::int32_t>(0xff000000u));
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) {
        const auto own = infoAt(info + i);
        const auto surface =
            hn::And(hn::And(hasBit(own, Info::kLinkRight), hasBit(own, Info::kLinkDown)),
                    hn::And(hn::And(hasBit(infoAt(info + i - 1), Info::kLinkRight),
                                    hasBit(infoAt(info + i - stride), Info::kLinkDown)),
                            hn::Gt(own, hn::Set(di, (fromEdge << 4) - 1))));
        if (hn::AllFalse(di, surface)) continue;
        const auto here = bytesAt(from + i), left = bytesAt(from + i - 1),
                   right = bytesAt(from + i + 1), above = bytesAt(from + i - stride),
                   below = bytesAt(from + i + stride);
        const auto even = sharper(half(here, false), half(left, false), half(right, false),
                                  half(above, false), half(below, false));
        const auto odd = sharper(half(here, true), half(left, true), half(right, true),
                                 half(above, true), half(below, true));
        const auto pixels = hn::BitCast(di, here);
        const auto colours = hn::BitCast(di, hn::Or(even, hn::ShiftLeft<8>(odd)));
        const auto out = hn::Or(hn::And(alpha, pixels), hn::AndNot(alpha, colours));
        hn::StoreU(hn::BitCast(d8, hn::IfThenElse(surface, out, pixels)), d8, &to[i].x);
    }
    return i;
}
#endif

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::surface {

HWY_EXPORT(invertImpl);
HWY_EXPORT(countImpl);
HWY_EXPORT(linkRowImpl);
HWY_EXPORT(sharpenImpl);

void invertDistances(const float* distances, const std::uint8_t* covered, std::size_t count,
                     float none, float* q) {
    HWY_DYNAMIC_DISPATCH(invertImpl)(distances, covered, count, none, q);
}

DraftCounts countPixels(const float* q, const std::uint8_t* covered, std::size_t count) {
    DraftCounts counts;
    HWY_DYNAMIC_DISPATCH(countImpl)(q, covered, count, counts);
    return counts;
}

void linkRow(const LinkRows& rows, int width, const DepthAxis& axis, float step,
             std::uint8_t* info) {
    HWY_DYNAMIC_DISPATCH(linkRowImpl)(rows, width, axis, step, info);
}

std::size_t sharpenRow(const glm::u8vec4* from, const std::uint8_t* info, std::ptrdiff_t stride,
                       std::size_t count, int fromEdge, int share, glm::u8vec4* to) {
    return HWY_DYNAMIC_DISPATCH(sharpenImpl)(from, info, stride, count, fromEdge, share, to);
}

}  // namespace stx::surface
#endif
