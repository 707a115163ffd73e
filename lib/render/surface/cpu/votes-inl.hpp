// Free-space votes on a vector of points at once: shaders/shared/surface_votes.glsl. Included by
// fuse_samples.cpp once for each SIMD target.

#if defined(STX_SURFACE_VOTES_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_SURFACE_VOTES_INL_HPP
#undef STX_SURFACE_VOTES_INL_HPP
#else
#define STX_SURFACE_VOTES_INL_HPP
#endif

#include <algorithm>
#include <bit>
#include <cstring>

#include <hwy/highway.h>

#include "lib/render/surface/prepare/votes.hpp"

// Where a vector holds 16 floats, it also holds 4x4 texels, and points look up theirs in it
// (Window).
#undef STX_VOTES_WINDOWS
#define STX_VOTES_WINDOWS (HWY_MAX_BYTES >= 64 && !HWY_HAVE_SCALABLE)

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using PointTag = hn::CappedTag<float, 16>;
using CountTag = hn::RebindToSigned<PointTag>;
using Points = hn::Vec<PointTag>;
using Counts = hn::Vec<CountTag>;
using PointMask = hn::Mask<PointTag>;
inline constexpr int kMostPoints = 16;  // in a vector

HWY_INLINE std::uint32_t lanesOf(PointMask mask) {
    const PointTag d;
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    std::uint32_t bits = 0;
    std::memcpy(&bits, bytes, sizeof(bits));
    return bits & static_cast<std::uint32_t>((std::uint64_t{1} << hn::Lanes(d)) - 1);
}

HWY_INLINE PointMask maskOf(std::uint32_t lanes) {
    const std::uint8_t bytes[8] = {static_cast<std::uint8_t>(lanes),
                                   static_cast<std::uint8_t>(lanes >> 8)};
    return hn::LoadMaskBits(PointTag(), bytes);
}

/// Points of the frame.
struct FramePoints {
    Points x, y, q;
};

/// Points in the image of one source, between the middles of four of its pixels.
struct SourcePoints {
    Points u, v, q;         ///< position, pixels, and depth
    Counts column, row;     ///< of the upper left of those pixels, from -1 on
    Points alongX, alongY;  ///< from its middle on, 0..1
    PointMask inside;

    HWY_INLINE SourcePoints(const LocalSource& local, const FramePoints& p, bool clamped) {
        const PointTag d;
        const CountTag di;
        const auto& m = local.sourceFromPixel.m;
        const auto row4 = [&](int r) HWY_ATTR {
            const Points rest = hn::MulAdd(hn::Set(d, m[r + 2]), p.q, hn::Set(d, m[r + 3]));
            return hn::MulAdd(hn::Set(d, m[r]), p.x, hn::MulAdd(hn::Set(d, m[r + 1]), p.y, rest));
        };
        const Points zero = hn::Zero(d), half = hn::Set(d, 0.5f);
        const Points width = hn::Set(d, static_cast<float>(local.source->width));
        const Points height = hn::Set(d, static_cast<float>(local.source->height));
        const Points w = row4(12), inverse = hn::Div(hn::Set(d, 1.0f), w);
        u = hn::Mul(row4(0), inverse);
        v = hn::Mul(row4(4), inverse);
        q = hn::Mul(row4(8), inverse);
        if (clamped) {
            u = hn::Min(hn::Max(u, zero), width);
            v = hn::Min(hn::Max(v, zero), height);
        }
        const auto within = [&](Points at, Points end)
                                HWY_ATTR { return hn::And(hn::Ge(at, zero), hn::Lt(at, end)); };
        inside = hn::And(hn::And(within(u, width), within(v, height)),
                         hn::And(hn::And(hn::Gt(w, zero), hn::Gt(q, zero)),
                                 hn::Lt(q, hn::Set(d, local.source->space.axis.nearest()))));
        const Points fromX = hn::Sub(u, half), fromY = hn::Sub(v, half);
        const Points left = hn::Floor(fromX), top = hn::Floor(fromY);
        alongX = hn::Sub(fromX, left);
        alongY = hn::Sub(fromY, top);
        column = hn::ConvertTo(di, left);
        row = hn::ConvertTo(di, top);
    }
};

/// The images of a source from which vectors of points read.
struct VotingSource {
    const Source* source;
    const float* q = nullptr;  ///< null: it is read one point at a time
    const std::uint8_t* info = nullptr;
    const std::uint8_t* levels = nullptr;  ///< null: no alpha

    explicit VotingSource(const Source& s) : source(&s) {
        if (!s.whole || s.width < 4) return;  // a word of info, at least
        q = s.whole->q.data();
        info = s.whole->info.data();
        if (s.hasAlpha) levels = s.whole->levels.data();
    }
};

/// The places, in the images of a whole source, of the four pixels around each point. A pixel
/// beyond the picture's border has the place of the nearest one inside.
struct FourTexels {
    Counts at[2][2];  ///< row, column
    PointMask column[2], row[2];

    HWY_INLINE FourTexels(const Source& s, const SourcePoints& p, PointMask wanted) {
        const PointTag d;
        const CountTag di;
        const Counts zero = hn::Zero(di), one = hn::Set(di, 1);
        const auto asPoints = [&](auto mask) HWY_ATTR { return hn::RebindMask(d, mask); };
        const Counts before = hn::Set(di, -1);
        const Counts lastX = hn::Set(di, s.width - 1), lastY = hn::Set(di, s.height - 1);
        const Counts nextX = hn::Add(p.column, one), nextY = hn::Add(p.row, one);
        column[0] = asPoints(hn::Gt(p.column, before));
        column[1] = asPoints(hn::Gt(lastX, p.column));
        row[0] = asPoints(hn::Gt(p.row, before));
        row[1] = asPoints(hn::Gt(lastY, p.row));
        const auto clamped = [&](Counts place, Counts last)
                                 HWY_ATTR { return hn::Min(hn::Max(place, zero), last); };
        const Counts x[2] = {clamped(p.column, lastX), clamped(nextX, lastX)};
        const Counts y[2] = {clamped(p.row, lastY), clamped(nextY, lastY)};
        const auto reads = hn::RebindMask(di, wanted);
        for (int j = 0; j < 2; ++j)
            for (int i = 0; i < 2; ++i)
                at[j][i] =
                    hn::IfThenElseZero(reads, hn::Add(hn::Mul(y[j], hn::Set(di, s.width)), x[i]));
    }
};

/// 4x4 texels of a whole source in a register, in which all points of a vector find the four pixels
/// around them and those beside these. Looking up there takes a fraction of the time of gathering.
/// `holds` is false where the points are too far apart for it.
struct Window {
    bool holds = false;
    std::ptrdiff_t first = 0;  ///< texel
    Counts index;              ///< of the upper left of the pixels around each point

    HWY_INLINE Window(const Source& s, const SourcePoints& p, PointMask wanted) {
#if STX_VOTES_WINDOWS
        const CountTag di;
        const auto asks = hn::RebindMask(di, wanted);
        const auto firstOf = [&](Counts at) HWY_ATTR {
            return hn::GetLane(hn::MinOfLanes(di, hn::IfThenElse(asks, at, hn::Set(di, 1 << 30)))) -
                   1;
        };
        const std::int32_t x = firstOf(p.column), y = firstOf(p.row);
        if (x < 0 || y < 0 || x > s.width - kSide || y > s.height - kSide) return;
        const Counts alongX = hn::Sub(p.column, hn::Set(di, x));
        const Counts alongY = hn::Sub(p.row, hn::Set(di, y));
        const auto beyond = hn::Gt(hn::Max(alongX, alongY), hn::Set(di, kSide - 2));
        if (!hn::AllFalse(di, hn::And(asks, beyond))) return;
        holds = true;
        first = static_cast<std::ptrdiff_t>(y) * s.width + x;
        index = hn::IfThenElseZero(asks, hn::Add(hn::ShiftLeft<2>(alongY), alongX));
#else
        (void)s, (void)p, (void)wanted;
#endif
    }

#if STX_VOTES_WINDOWS
    static constexpr int kSide = 4;

    template <class T>
    HWY_INLINE auto read(const T* from, std::ptrdiff_t width) const {
        const hn::FixedTag<T, 4> d4;
        const hn::FixedTag<T, 8> d8;
        const auto row = [&](int j) HWY_ATTR { return hn::LoadU(d4, from + first + j * width); };
        return hn::Combine(hn::FixedTag<T, 16>(), hn::Combine(d8, row(3), row(2)),
                           hn::Combine(d8, row(1), row(0)));
    }
    HWY_INLINE Counts read(const std::uint8_t* from, std::ptrdiff_t width) const {
        const hn::FixedTag<std::uint32_t, 4> rows;
        const auto row = [&](int j) HWY_ATTR {
            std::uint32_t four = 0;
            std::memcpy(&four, from + first + j * width, sizeof(four));
            return hn::Set(rows, four);
        };
        const auto bytes = hn::ConcatLowerLower(rows, hn::InterleaveLower(rows, row(2), row(3)),
                                                hn::InterleaveLower(rows, row(0), row(1)));
        return hn::PromoteTo(CountTag(), hn::BitCast(hn::FixedTag<std::uint8_t, 16>(), bytes));
    }
    /// For each point, the value of one pixel in what read() gave: the pixel (x, y) beside the
    /// upper left one of the four around the point, x and y from -1 to 1.
    template <class D, class V = hn::Vec<D>>
    HWY_INLINE V at(D d, V table, int x, int y) const {
        const CountTag di;
        // Points that are not asked for stay within the window.
        const Counts place = hn::And(hn::Add(index, hn::Set(di, kSide * y + x)), hn::Set(di, 15));
        return hn::TableLookupLanes(table, hn::IndicesFromVec(d, place));
    }
#endif
};

/// The bytes at `places` of an image of `count` bytes, which is four at least.
HWY_INLINE Counts gatheredBytes(const std::uint8_t* from, std::int32_t count, Counts places) {
    const CountTag di;
    const hn::RebindToUnsigned<CountTag> du;
    // Whole words, for that is what vectors gather.
    const Counts word = hn::Min(places, hn::Set(di, count - 4));
    const auto bits =
        hn::BitCast(du, hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(from), word));
    const auto shift = hn::BitCast(du, hn::ShiftLeft<3>(hn::Sub(places, word)));
    return hn::BitCast(di, hn::And(hn::Shr(bits, shift), hn::Set(du, 255u)));
}

/// The outline level at points, interpolated between the four pixels around each.
HWY_INLINE Points levelOf(const VotingSource& from, const SourcePoints& p, PointMask wanted,
                          const Window& window) {
    const PointTag d;
    const auto asLevel = [&](Counts bytes) HWY_ATTR {
        return hn::Mul(hn::Sub(hn::ConvertTo(d, bytes), hn::Set(d, kLevelZero)),
                       hn::Set(d, kLevelStep));
    };
    const auto mix = [&](Points a, Points b, Points along)
                         HWY_ATTR { return hn::MulAdd(b, along, hn::NegMulAdd(a, along, a)); };
    const auto between = [&](const auto& at) HWY_ATTR {
        return mix(mix(asLevel(at(0, 0)), asLevel(at(0, 1)), p.alongX),
                   mix(asLevel(at(1, 0)), asLevel(at(1, 1)), p.alongX), p.alongY);
    };
    const int width = from.source->width, height = from.source->height;
#if STX_VOTES_WINDOWS
    if (window.holds) {
        const Counts table = window.read(from.levels, width);
        return between([&](int j, int i) HWY_ATTR { return window.at(CountTag(), table, i, j); });
    }
#else
    (void)window;
#endif
    const FourTexels texels(*from.source, p, wanted);
    return between([&](int j, int i) HWY_ATTR {
        return gatheredBytes(from.levels, width * height, texels.at[j][i]);
    });
}

/// Whether the largest level of the 4x4 pixels around the 2x2 from (column, row) on is solid; all
/// of them must be in the picture.
HWY_INLINE bool isSolidAround(const std::uint8_t* levels, int width, int column, int row) {
    const std::uint8_t* from = levels + static_cast<std::ptrdiff_t>(row - 1) * width + (column - 1);
    std::uint8_t largest = 0;
    for (int j = 0; j < 4; ++j, from += width)
        largest =
            std::max(std::max(std::max(from[0], from[1]), std::max(from[2], from[3])), largest);
    return !((static_cast<float>(largest) - kLevelZero) * kLevelStep < kSolidAlpha);
}

/// isBackground() of the `wanted` points, whose outline level is given.
HWY_INLINE PointMask areBackground(shared::Votes& votes, const VotingSource& from, int s,
                                   const SourcePoints& p, Points level, PointMask wanted) {
    const PointTag d;
    const CountTag di;
    const PointMask little = hn::And(wanted, hn::Lt(level, hn::Set(d, votes.freeLevelOf(s))));
    if (hn::AllFalse(d, little)) return little;
    const PointMask some = hn::And(little, hn::Gt(level, hn::Zero(d)));
    std::uint32_t doubtful = lanesOf(some);
    if (doubtful == 0) return little;
    alignas(64) std::int32_t column[kMostPoints], row[kMostPoints];
    hn::Store(p.column, di, column);
    hn::Store(p.row, di, row);
    std::uint32_t background = lanesOf(little) & ~doubtful;
    const Source& source = votes.at(s);
    // Neighbours mostly lie between the same pixels.
    for (int before = -1; doubtful; doubtful &= doubtful - 1) {
        const int l = std::countr_zero(doubtful);
        bool solid = false;
        if (before >= 0 && column[l] == column[before] && row[l] == row[before])
            solid = background >> before & 1u;
        else if (from.levels && column[l] > 0 && row[l] > 0 && column[l] + 2 < source.width &&
                 row[l] + 2 < source.height)
            solid = isSolidAround(from.levels, source.width, column[l], row[l]);
        else
            solid = !(votes.largestLevelAround(s, {column[l], row[l]}) < kSolidAlpha);
        if (solid) background |= 1u << l;
        before = l;
    }
    return maskOf(background);
}

/// Which points of `asked` get no vote from a source for sure, by one of its pixels alone: the
/// upper left of the four around the point. The depth of that pixel, and how depth changes beside
/// it, are compared with the point's. `qAt(x, y, lanes)` and `infoAt(x, y, lanes)` read the pixel
/// that lies (x, y) pixels from it.
template <class Depths, class Infos>
HWY_INLINE PointMask withoutVote(const VotingSource& from, const SourcePoints& p, const Depths& qAt,
                                 const Infos& infoAt, Counts info, float clearlyBehind,
                                 PointMask asked) {
    const PointTag d;
    const CountTag di;
    const DepthAxis& axis = from.source->space.axis;
    const Points zero = hn::Zero(d);
    const Points coarse = hn::Set(d, static_cast<float>(axis.coarse));
    const Points scale = axis.inverse ? hn::Mul(p.q, coarse) : coarse;
    const Points perUnit = axis.inverse ? hn::Mul(p.q, p.q) : hn::Set(d, axis.qPerUnit(1.0f));
    const Points margin = hn::MulAdd(hn::Set(d, clearlyBehind), scale,
                                     hn::Mul(hn::Set(d, from.source->step), perUnit));
    const Points there = qAt(0, 0, asked);
    // The cheap half of the test first: most surfaces are not behind the point at all.
    const Points reach = hn::Mul(hn::Set(d, 4.0f * kLinkedSamples), coarse);
    const Points nearest =
        hn::Sub(hn::Add(there, margin), axis.inverse ? hn::Mul(reach, there) : reach);
    const PointMask has = hn::And(asked, hn::Gt(there, zero));
    const PointMask hidden =
        hn::Or(hn::And(asked, hn::Lt(there, zero)), hn::And(has, hn::Lt(p.q, nearest)));
    const PointMask left = hn::AndNot(hidden, has);
    if (hn::AllFalse(d, left)) return hidden;
    const auto links = [&](Counts bits, std::uint8_t link) HWY_ATTR {
        return hn::RebindMask(d, hn::TestBit(bits, hn::Set(di, std::int32_t{link})));
    };
    /// chooseSlope() of shaders/shared/surface_slope.glsl.
    const auto slopeOf = [&](PointMask before, Points q0, PointMask after, Points q1) HWY_ATTR {
        const Points half = hn::Set(d, 0.5f);
        const Points a = hn::Sub(there, q0), b = hn::Sub(q1, there);
        const Points sizeA = hn::Abs(a), sizeB = hn::Abs(b);
        Points both = hn::Mul(half, hn::Add(a, b));
        both = hn::IfThenElse(hn::Lt(sizeB, hn::Mul(half, sizeA)), b, both);
        both = hn::IfThenElse(hn::Lt(sizeA, hn::Mul(half, sizeB)), a, both);
        return hn::IfThenElse(hn::And(before, after), both,
                              hn::IfThenElse(before, a, hn::IfThenElseZero(after, b)));
    };
    const Points gx = slopeOf(links(infoAt(-1, 0, left), Info::kLinkRight), qAt(-1, 0, left),
                              links(info, Info::kLinkRight), qAt(1, 0, left));
    const Points gy = slopeOf(links(infoAt(0, -1, left), Info::kLinkDown), qAt(0, -1, left),
                              links(info, Info::kLinkDown), qAt(0, 1, left));
    const Points slope = hn::Add(hn::Abs(gx), hn::Abs(gy));
    const Points predicted = hn::MulAdd(gx, p.alongX, hn::MulAdd(gy, p.alongY, there));
    const Points least =
        hn::Add(hn::Add(predicted, margin), hn::Mul(hn::Set(d, kSlopeDoubt), slope));
    return hn::Or(hidden, hn::And(left, hn::Lt(p.q, least)));
}

/// The votes `cast`, in which those of the `wanted` points are replaced by voteOne(lane, x, y, q).
template <class VoteOne>
HWY_INLINE Counts withVotes(Counts cast, Points x, Points y, Points q, PointMask wanted,
                            const VoteOne& voteOne) {
    const PointTag d;
    const CountTag di;
    alignas(64) float xs[kMostPoints], ys[kMostPoints], qs[kMostPoints];
    alignas(64) std::int32_t vote[kMostPoints];
    hn::Store(x, d, xs);
    hn::Store(y, d, ys);
    hn::Store(q, d, qs);
    hn::Store(cast, di, vote);
    for (std::uint32_t left = lanesOf(wanted); left; left &= left - 1) {
        const int l = std::countr_zero(left);
        vote[l] = voteOne(l, xs[l], ys[l], qs[l]);
    }
    return hn::Load(di, vote);
}

/// voteAt() of source `s` on the points of `wanted`, 0 on others. Points that have no outline of
/// the source near them are taken out of `outline`.
HWY_INLINE Counts votesAt(shared::Votes& votes, const VotingSource& from, int s,
                          const FramePoints& points, PointMask wanted, PointMask& outline) {
    const PointTag d;
    const CountTag di;
    Counts cast = hn::Zero(di);
    if (!from.q) {
        std::uint32_t lanes = 0;
        cast = withVotes(cast, points.x, points.y, points.q, wanted,
                         [&](int l, float x, float y, float q) {
                             bool near = false;
                             const int vote = votes.voteAt(s, votes.warp(s, x, y, q), near);
                             if (near) lanes |= 1u << l;
                             return vote;
                         });
        outline = hn::And(outline, maskOf(lanes));
        return cast;
    }
    const Source& source = *from.source;
    const SourcePoints p(votes.locals[static_cast<std::size_t>(s)], points, false);
    PointMask left = hn::And(wanted, p.inside);
    if (hn::AllFalse(d, left)) return cast;
    // With pixels all around; few others are asked for.
    const Counts zero = hn::Zero(di), one = hn::Set(di, 1);
    const PointMask amid = hn::RebindMask(
        d, hn::And(hn::And(hn::Gt(p.column, zero), hn::Gt(p.row, zero)),
                   hn::And(hn::Gt(hn::Set(di, source.width - 1), hn::Add(p.column, one)),
                           hn::Gt(hn::Set(di, source.height - 1), hn::Add(p.row, one)))));
    const PointMask asked = hn::And(left, amid);
    const Window window(source, p, asked);
    Counts info;
    PointMask hidden;
    const auto look = [&](const auto& qAt, const auto& infoAt) HWY_ATTR {
        info = infoAt(0, 0, asked);
        hidden = withoutVote(from, p, qAt, infoAt, info, votes.clearlyBehindOf(s), asked);
    };
#if STX_VOTES_WINDOWS
    if (window.holds) {
        const Points depths = window.read(from.q, source.width);
        const Counts infos = window.read(from.info, source.width);
        look([&](int x, int y, PointMask) HWY_ATTR { return window.at(d, depths, x, y); },
             [&](int x, int y, PointMask) HWY_ATTR { return window.at(di, infos, x, y); });
    }
#endif
    if (!window.holds) {
        const Counts texel = hn::Add(hn::Mul(p.row, hn::Set(di, source.width)), p.column);
        const auto at = [&](int x, int y, PointMask lanes) HWY_ATTR {
            return hn::IfThenElseZero(hn::RebindMask(di, lanes),
                                      hn::Add(texel, hn::Set(di, y * source.width + x)));
        };
        look([&](int x, int y, PointMask lanes)
                 HWY_ATTR { return hn::GatherIndex(d, from.q, at(x, y, lanes)); },
             [&](int x, int y, PointMask lanes) HWY_ATTR {
                 return gatheredBytes(from.info, source.width * source.height, at(x, y, lanes));
             });
    }
    const PointMask nearEdge =
        hn::RebindMask(d, hn::Lt(hn::ShiftRight<4>(info), hn::Set(di, kFarFromEdge - 1)));
    outline = hn::AndNot(hn::AndNot(nearEdge, asked), outline);
    if (from.levels) {
        // Background is not hidden: it is never far from an edge.
        const PointMask doubtful = hn::Or(hn::AndNot(amid, left), hn::And(asked, nearEdge));
        if (!hn::AllFalse(d, doubtful)) {
            const bool allAmid = hn::AllFalse(d, hn::AndNot(amid, doubtful));
            const Points level =
                levelOf(from, p, doubtful, allAmid ? window : Window(source, p, doubtful));
            const PointMask background = areBackground(votes, from, s, p, level, doubtful);
            cast = hn::IfThenElseZero(hn::RebindMask(di, background),
                                      hn::Set(di, votes.backgroundVoteOf(s)));
            left = hn::AndNot(background, left);
            outline = hn::AndNot(hn::And(background, hn::Le(level, hn::Zero(d))), outline);
        }
    }
    left = hn::AndNot(hidden, left);
    if (hn::AllFalse(d, left)) return cast;
    alignas(64) std::int32_t column[kMostPoints], row[kMostPoints];
    hn::Store(p.column, di, column);
    hn::Store(p.row, di, row);
    return withVotes(cast, p.u, p.v, p.q, left, [&](int l, float u, float v, float q) {
        const glm::ivec2 corner(column[l], row[l]);
        return votes.voteOnDepth(s, votes.placeOf(s, corner), corner, {u, v}, q);
    });
}

/// The facets of points. Each is found when it is first asked for.
struct Facets {
    const std::int32_t* owners;  ///< who shows each
    std::uint32_t extensions;    ///< lanes that are shown by one
    std::uint32_t known = 0;     ///< lanes
    shared::Votes::Facet of[kMostPoints];

    const shared::Votes::Facet& at(shared::Votes& votes, int l, float x, float y, float q) {
        if (!(known >> l & 1u)) of[l] = votes.facetOf(owners[l], x, y, q, !(extensions >> l & 1u));
        known |= 1u << l;
        return of[l];
    }
};

/// The votes of source `s` on the points of `wanted` as rejected() of shaders/shared asks for them,
/// 0 on others.
HWY_INLINE Counts votesOf(shared::Votes& votes, const VotingSource& from, int s,
                          const FramePoints& points, Facets& facets, PointMask wanted) {
    const PointTag d;
    const CountTag di;
    PointMask outline = wanted;
    const Counts cast = votesAt(votes, from, s, points, wanted, outline);
    outline = hn::And(outline, hn::RebindMask(d, hn::Gt(cast, hn::Zero(di))));
    if (hn::AllFalse(d, outline)) return cast;
    alignas(64) std::int32_t vote[kMostPoints];
    hn::Store(cast, di, vote);
    return withVotes(
        cast, points.x, points.y, points.q, outline, [&](int l, float x, float y, float q) {
            return votes.voteOnOutline(s, facets.at(votes, l, x, y, q), x, y, q, vote[l]);
        });
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
