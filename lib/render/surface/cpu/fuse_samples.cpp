#include "lib/render/surface/cpu/fuse_samples.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/cpu/fuse_samples.cpp"
#include <hwy/foreach_target.h>  // NOLINT: must come before highway.h
#include <hwy/highway.h>

#include "lib/render/surface/cpu/votes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {

/// The samples of a pixel, of the sources that have any there.
struct PixelSamples {
    /// 0 = nothing.
    alignas(64) float q[kMostTileSources][kMostSamples];
    int owner[kMostTileSources];  ///< the source's number in the tile
    int count = 0;

    HWY_INLINE PixelSamples(const SampledTile& tile, std::span<const int> among, int column,
                            int row) {
        const int side = tile.grid.perPixel, stride = tile.grid.stride();
        for (const int k : among) {
            const float* from = tile.sources[static_cast<std::size_t>(k)].samples +
                                static_cast<std::ptrdiff_t>(row) * side * stride + column * side;
            float* to = q[count];
            float most = 0.0f;
            for (int j = 0; j < side; ++j) {
                // Rows of four floats are there, whatever the side; the next row covers the rest.
                std::memcpy(to + j * side, from + j * stride, 4 * sizeof(float));
                for (int i = 0; i < side; ++i) most = std::max(most, from[j * stride + i]);
            }
            std::fill(to + side * side, to + kMostSamples, 0.0f);
            if (most > 0.0f) owner[count++] = k;
        }
    }
};

/// A vector of the samples of a pixel.
struct SampleFuser {
    const SampledTile& tile;
    shared::Votes& votes;
    const PixelSamples& pixel;
    int mostOfOne;  ///< what one source may say at most
    int first;      ///< sample
    Points x, y;

    HWY_INLINE Points sampleOf(int i) const { return hn::LoadU(PointTag(), pixel.q[i] + first); }
    /// sameWithin() of the shared code.
    HWY_INLINE Points sameWithin(Points q) const {
        const PointTag d;
        const Points scale = tile.axis.inverse ? q : hn::Set(d, 1.0f);
        const Points perUnit =
            tile.axis.inverse ? hn::Mul(q, q) : hn::Set(d, tile.axis.qPerUnit(1.0f));
        return hn::MulAdd(hn::Set(d, kSame), scale, hn::Mul(hn::Set(d, tile.step), perUnit));
    }
    static HWY_INLINE PointMask flagged(Points q, std::uint32_t flags) {
        const PointTag d;
        const hn::RebindToUnsigned<PointTag> du;
        return hn::RebindMask(
            d, hn::Ne(hn::And(hn::BitCast(du, q), hn::Set(du, flags)), hn::Zero(du)));
    }

    /// What the samples of a pixel say about a point, before the other sources are asked.
    struct Opinions {
        Counts against, enough;    ///< votes; enough of them reject the point
        std::uint32_t listed = 0;  ///< the sources that have samples here
        /// Lanes in which a source does not show the point: it shows another surface there, or
        /// none.
        std::uint32_t others[kMostTileSources];
        /// Lanes in which a sample of a source lies closely behind the point and may replace it:
        /// only extensions show the point.
        std::uint32_t closelyBehind[kMostTileSources] = {};
        bool mayGiveWay = false;
    };

    /// The lanes whose owner is source i.
    static HWY_INLINE PointMask isOwner(Counts owner, int i) {
        return hn::RebindMask(PointTag(), hn::Eq(owner, hn::Set(CountTag(), i)));
    }

    /// Which points of `nearEdge` are background that their own source shows beside an edge.
    /// `silhouette` gets those that the source shows with less than solid alpha.
    HWY_INLINE PointMask backgroundAtEdges(const FramePoints& points, Counts owner,
                                           PointMask nearEdge, PointMask& silhouette) const {
        const PointTag d;
        PointMask out = hn::Lt(points.q, hn::Zero(d));  // none
        silhouette = out;
        for (int i = 0; i < pixel.count && !hn::AllFalse(d, nearEdge); ++i) {
            const PointMask mine = hn::And(nearEdge, isOwner(owner, i));
            const int s = pixel.owner[i];
            if (!votes.hasAlpha(s) || hn::AllFalse(d, mine)) continue;
            const SourcePoints p(votes.locals[static_cast<std::size_t>(s)], points, true);
            const VotingSource from(votes.at(s));
            Points level;
            if (from.levels) {
                level = levelOf(from, p, mine, Window(*from.source, p, mine));
            } else {
                alignas(64) float u[kMostPoints], v[kMostPoints], each[kMostPoints] = {};
                hn::Store(p.u, d, u);
                hn::Store(p.v, d, v);
                for (std::uint32_t left = lanesOf(mine); left; left &= left - 1) {
                    const int l = std::countr_zero(left);
                    each[l] = votes.levelAt(s, {u[l], v[l]});
                }
                level = hn::Load(d, each);
            }
            out = hn::Or(out, areBackground(votes, from, s, p, level, mine));
            silhouette = hn::Or(silhouette, hn::And(mine, hn::Lt(level, hn::Set(d, kSolidAlpha))));
        }
        return out;
    }

    HWY_INLINE void hearSamples(const FramePoints& points, Counts owner, PointMask asked,
                                PointMask silhouette, Facets& facets, Opinions& o) const {
        const PointTag d;
        const CountTag di;
        const Points q = points.q, within = sameWithin(q);
        const Counts whole = hn::Set(di, shared::Votes::kWholeVote);
        PointMask guess = hn::And(asked, flagged(q, kExtensionBit));
        const Points close =
            hn::Mul(hn::Set(d, kLinkedSamples), tile.axis.inverse ? q : hn::Set(d, 1.0f));
        const Points farthest = hn::Max(hn::Sub(q, close), hn::Zero(d));
        for (int i = 0; i < pixel.count; ++i) {
            const int k = pixel.owner[i];
            o.listed |= 1u << k;
            const Points value = sampleOf(i);
            const PointMask theirs = hn::AndNot(isOwner(owner, i), asked);
            const PointMask same = hn::And(hn::And(theirs, hn::Gt(value, hn::Zero(d))),
                                           hn::Lt(hn::Abs(hn::Sub(value, q)), within));
            const PointMask apart = hn::AndNot(same, theirs);
            o.others[k] = lanesOf(apart);
            const PointMask near =
                hn::And(hn::And(apart, guess), hn::And(hn::Lt(value, q), hn::Gt(value, farthest)));
            if (!hn::AllFalse(d, near))
                o.closelyBehind[k] = lanesOf(hn::AndNot(flagged(value, kExtensionBit), near));
            const PointMask extension = hn::And(same, flagged(value, kExtensionBit));
            PointMask supports = hn::AndNot(extension, same);
            guess = hn::AndNot(supports, guess);
            if (!hn::AllFalse(d, extension)) {
                const Counts vote =
                    votesOf(votes, VotingSource(votes.at(k)), k, points, facets, extension);
                o.against = hn::Add(o.against, vote);
                const PointMask none = hn::RebindMask(d, hn::Eq(vote, hn::Zero(di)));
                supports = hn::Or(supports, hn::And(hn::And(extension, silhouette), none));
            }
            o.enough = hn::Add(o.enough, hn::IfThenElseZero(hn::RebindMask(di, supports), whole));
        }
        const std::uint32_t guesses = lanesOf(guess);
        for (int i = 0; i < pixel.count; ++i) {
            o.closelyBehind[pixel.owner[i]] &= guesses;
            o.mayGiveWay = o.mayGiveWay || o.closelyBehind[pixel.owner[i]] != 0;
        }
    }

    /// Which points of `asked` the sources that do not show them reject, or replace by a sample
    /// closely behind.
    HWY_INLINE PointMask askSources(const FramePoints& points, PointMask asked, Facets& facets,
                                    Opinions& o) const {
        const PointTag d;
        const CountTag di;
        const int count = static_cast<int>(tile.sources.size());
        // The most votes against the point that sources not asked yet could still give.
        const Counts each = hn::Set(di, mostOfOne);
        Counts most = hn::Set(di, mostOfOne * (count - pixel.count));
        for (int i = 0; i < pixel.count; ++i) {
            const PointMask other = maskOf(o.others[pixel.owner[i]]);
            most = hn::Add(most, hn::IfThenElseZero(hn::RebindMask(di, other), each));
        }
        std::uint32_t open = lanesOf(asked);
        std::uint32_t replaced = 0, waits[kMostTileSources + 1] = {};
        for (int k = count - 1; k >= 0 && o.mayGiveWay; --k)
            waits[k] = waits[k + 1] | o.closelyBehind[k];
        for (int k = 0; k < count; ++k) {
            // A point with enough votes against it is rejected and asks no more. So does a point
            // that cannot get enough any more, unless a sample closely behind may still replace it.
            open &= lanesOf(hn::RebindMask(d, hn::Gt(o.enough, o.against))) &
                    (~lanesOf(hn::RebindMask(d, hn::Gt(o.enough, hn::Add(o.against, most)))) |
                     waits[k]);
            if (!open) break;
            const bool lists = o.listed >> k & 1u;
            const PointMask other = lists ? maskOf(o.others[k]) : asked;
            most = hn::Sub(most, hn::IfThenElseZero(hn::RebindMask(di, other), each));
            const std::uint32_t asks = lists ? o.others[k] & open : open;
            if (!asks) continue;
            const Counts vote =
                votesOf(votes, VotingSource(votes.at(k)), k, points, facets, maskOf(asks));
            o.against = hn::Add(o.against, vote);
            const std::uint32_t maybe =
                asks & o.closelyBehind[k] & lanesOf(hn::RebindMask(d, hn::Eq(vote, hn::Zero(di))));
            if (!maybe) continue;
            const auto seesBetter = [&](int l, float px, float py, float pq) {
                const auto& facet = facets.at(votes, l, px, py, pq);
                return facet.any && (votes.beyondCentres(facets.owners[l], px, py, pq) ||
                                     votes.sizeIn(k, facet, votes.warp(k, px, py, pq)) >
                                         votes.betterThan(facets.owners[l]));
            };
            const Counts better =
                withVotes(hn::Zero(di), points.x, points.y, points.q, maskOf(maybe), seesBetter);
            replaced |= lanesOf(hn::RebindMask(d, hn::Gt(better, hn::Zero(di))));
            open &= ~replaced;
        }
        const PointMask few = hn::RebindMask(d, hn::Gt(o.enough, o.against));
        return hn::Or(maskOf(replaced), hn::AndNot(few, asked));
    }

    /// rejected() of shaders/shared, for the points of `asked`, at depth `q`. `owner` is the
    /// number, among the sources of `pixel`, of the source that shows each.
    HWY_INLINE PointMask rejected(Points q, Counts owner, PointMask asked) const {
        using shared::Votes;
        const PointTag d;
        const CountTag di;
        const FramePoints points{x, y, q};
        const PointMask nearEdge = hn::And(asked, flagged(q, kNearEdgeBit));
        PointMask silhouette;
        const PointMask out = backgroundAtEdges(points, owner, nearEdge, silhouette);
        asked = hn::AndNot(out, asked);
        if (hn::AllFalse(d, asked)) return out;

        alignas(64) std::int32_t owners[kMostPoints] = {};  // by number in the tile
        hn::Store(owner, di, owners);
        for (std::int32_t& k : owners) k = pixel.owner[k];
        Facets facets;
        facets.owners = owners;
        facets.extensions = lanesOf(hn::And(asked, flagged(q, kExtensionBit)));
        Opinions opinions;
        opinions.against = hn::Zero(di);
        opinions.enough = hn::IfThenElse(hn::RebindMask(di, nearEdge),
                                         hn::Set(di, Votes::kWholeVote * kVotesNearEdge),
                                         hn::Set(di, Votes::kWholeVote * kVotesElsewhere));
        hearSamples(points, owner, asked, silhouette, facets, opinions);
        return hn::Or(out, askSources(points, asked, facets, opinions));
    }

    /// agreed() of the shared code.
    static HWY_INLINE PointMask agreed(Points sure, Points mesh) {
        const PointTag d;
        const Points one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
        return hn::Or(hn::Gt(sure, one), hn::And(hn::Ge(sure, one), hn::Gt(mesh, two)));
    }

    HWY_INLINE void fuse(ShownSamples& out) const {
        const PointTag d;
        const CountTag di;
        const hn::RebindToUnsigned<PointTag> du;
        const Points zero = hn::Zero(d), one = hn::Set(d, 1.0f);
        Points shown = zero;
        auto seenBy = hn::Zero(du);
        PointMask open = hn::Eq(zero, zero);
        // By number in `pixel`: the lanes whose sample was rejected.
        std::uint32_t gone[kMostTileSources] = {};
        const auto leftOf = [&](int i) HWY_ATTR {
            const Points q = sampleOf(i);
            return gone[i] ? hn::IfThenZeroElse(maskOf(gone[i]), q) : q;
        };
        for (;;) {
            Points front = zero;
            Counts owner = hn::Zero(di);
            for (int i = 0; i < pixel.count; ++i) {
                const Points q = leftOf(i);
                const PointMask nearer = hn::Gt(q, front);
                front = hn::IfThenElse(nearer, q, front);
                owner = hn::IfThenElse(hn::RebindMask(di, nearer), hn::Set(di, i), owner);
            }
            open = hn::And(open, hn::Gt(front, zero));
            if (hn::AllFalse(d, open)) break;
            const Points behind = hn::Sub(front, sameWithin(front));
            Points sure = zero, meshCount = zero, sum = zero, weights = zero;
            auto meshes = hn::Zero(du), extensions = hn::Zero(du);
            for (int i = 0; i < pixel.count; ++i) {
                const Points q = leftOf(i);
                const PointMask joins = hn::And(hn::Gt(q, behind), hn::Gt(q, zero));
                const PointMask extension = hn::And(joins, flagged(q, kExtensionBit));
                const PointMask mesh = hn::AndNot(extension, joins);
                meshCount = hn::Add(meshCount, hn::IfThenElseZero(mesh, one));
                const Points weight = hn::IfThenElse(extension, hn::Set(d, kExtensionWeight), one);
                sure = hn::Add(
                    sure, hn::IfThenElseZero(hn::AndNot(flagged(q, kSampleFlags), joins), one));
                const Points counts = hn::IfThenElseZero(joins, weight);
                sum = hn::MulAdd(counts, hn::Sub(q, front), sum);
                weights = hn::Add(weights, counts);
                const auto bit = hn::Set(du, 1u << pixel.owner[i]);
                meshes = hn::Or(meshes, hn::IfThenElseZero(hn::RebindMask(du, mesh), bit));
                extensions =
                    hn::Or(extensions, hn::IfThenElseZero(hn::RebindMask(du, extension), bit));
            }
            const PointMask asked = hn::AndNot(agreed(sure, meshCount), open);
            PointMask against = asked;
            if (!hn::AllFalse(d, asked)) against = rejected(front, owner, asked);
            const PointMask taken = hn::AndNot(against, open);
            shown = hn::IfThenElse(taken, hn::Add(front, hn::Div(sum, weights)), shown);
            const auto noMesh = hn::Eq(meshes, hn::Zero(du));
            seenBy = hn::IfThenElse(hn::RebindMask(du, taken),
                                    hn::IfThenElse(noMesh, extensions, meshes), seenBy);
            open = hn::And(open, against);
            if (hn::AllFalse(d, open)) break;
            for (int i = 0; i < pixel.count; ++i)
                gone[i] |= lanesOf(hn::And(open, hn::RebindMask(d, hn::Eq(owner, hn::Set(di, i)))));
        }
        hn::StoreU(shown, d, out.q + first);
        hn::StoreU(seenBy, du, out.seenBy + first);
    }
};

void FuseSamplesOf(const SampledTile& tile, std::span<const int> among, int column, int row,
                   ShownSamples& out) {
    const PointTag d;
    const int n = static_cast<int>(hn::Lanes(d));
    const int side = tile.grid.perPixel;
    shared::Votes votes{{tile.sources}};
    int mostOfOne = shared::Votes::kWholeVote;
    for (int k = 0; k < static_cast<int>(tile.sources.size()); ++k)
        mostOfOne = std::max(mostOfOne, votes.backgroundVoteOf(k));
    const PixelSamples pixel(tile, among, column, row);
    alignas(64) float x[kMostSamples] = {}, y[kMostSamples] = {};
    const float scale = 1.0f / static_cast<float>(side);
    for (int l = 0; l < side * side; ++l) {
        x[l] = static_cast<float>(tile.x) +
               (static_cast<float>(column * side + l % side) + 0.5f) * scale;
        y[l] =
            static_cast<float>(tile.y) + (static_cast<float>(row * side + l / side) + 0.5f) * scale;
    }
    for (int l = 0; l < side * side; l += n)
        SampleFuser{tile, votes, pixel, mostOfOne, l, hn::LoadU(d, x + l), hn::LoadU(d, y + l)}
            .fuse(out);
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::surface {

HWY_EXPORT(FuseSamplesOf);

void fuseSamplesOf(const SampledTile& tile, std::span<const int> among, int column, int row,
                   ShownSamples& out) {
    HWY_DYNAMIC_DISPATCH(FuseSamplesOf)(tile, among, column, row, out);
}

}  // namespace stx::surface
#endif
