#include "lib/render/surface/cpu/shade.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "lib/render/surface/cpu/shade_groups.hpp"
#include "lib/render/surface/prepare/constants.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/cpu/shade.cpp"
#include <hwy/foreach_target.h>  // NOLINT: must come before highway.h
#include <hwy/highway.h>

#include "lib/render/surface/cpu/fetch-inl.hpp"
#include "lib/render/surface/cpu/fit-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Sources that a piece takes colours from, at most.
constexpr int kMostShaded = 8;
/// Taps a side within kNarrowReach; kTaps are all that the kernel reaches.
constexpr int kNarrow = 3;

/// Info::ownColour() at the position of each lane. Lanes without texels lose their
/// weight.
HWY_INLINE void findEdges(const Source& source, GroupSource& view, std::int32_t* edge) {
    const int lastX = source.width - 1, lastY = source.height - 1;
    if (source.whole) {
        const hn::ScalableTag<float> d;
        const hn::RebindToSigned<decltype(d)> di;
        alignas(64) std::int32_t texel[kGroup];
        for (int l = 0; l < kGroup; l += static_cast<int>(hn::Lanes(d))) {
            const auto pixel = [&](const Lanes& at, int last) HWY_ATTR {
                return hn::Min(hn::ConvertTo(di, hn::LoadU(d, &at.v[l])), hn::Set(di, last));
            };
            const auto row = hn::Mul(pixel(view.v, lastY), hn::Set(di, source.width));
            hn::Store(hn::Add(row, pixel(view.u, lastX)), di, texel + l);
        }
        const std::uint8_t* info = source.whole->info.data();
        for (int l = 0; l < kGroup; ++l) edge[l] = Info::ownColour(info[texel[l]]);
        return;
    }
    for (int l = 0; l < kGroup; ++l) {
        edge[l] = 0;
        if (!(view.weight[l] > 0.0f)) continue;
        const int column = std::min(static_cast<int>(view.u[l]), lastX);
        const int row = std::min(static_cast<int>(view.v[l]), lastY);
        const int baseU = static_cast<int>(std::floor(view.u[l] - 1.5f));
        const int baseV = static_cast<int>(std::floor(view.v[l] - 1.5f));
        const TapPlace& taps = view.taps[l] = source.tapPlaceOf(baseU, baseV);
        if (!taps.page)
            view.weight[l] = 0.0f;
        else if (column >= taps.x0 && row >= taps.y0 && column < taps.x1 && row < taps.y1)
            edge[l] =
                Info::ownColour(taps.page->info.data()[taps.texel(column - baseU, row - baseV)]);
    }
}

/// Lowers the weights of lanes whose colour is near an edge of its source (`edge`, pixels away).
HWY_INLINE void weighEdges(const std::int32_t* edge, float edgeWeight, GroupSource& out) {
    const hn::ScalableTag<float> d;
    using V = hn::Vec<decltype(d)>;
    const int n = static_cast<int>(hn::Lanes(d));
    const auto c = [&](float value) { return hn::Set(d, value); };
    const V one = c(1.0f);
    const hn::RebindToSigned<decltype(d)> di;
    out.rough = 0;
    out.active = false;
    for (int l = 0; l < kGroup; l += n) {
        const V away = hn::ConvertTo(d, hn::Load(di, edge + l));
        const V weight = hn::LoadU(d, &out.weight[l]);
        const auto on = hn::Gt(weight, hn::Zero(d));
        const V fade = hn::Min(hn::Mul(away, c(1.0f / kEdgeFade)), one);
        hn::StoreU(hn::Mul(weight, hn::MulAdd(c(1.0f - edgeWeight), fade, c(edgeWeight))), d,
                   &out.weight[l]);
        std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(d, hn::And(on, hn::Lt(away, c(kEdgeFade))), bytes);
        std::uint32_t bits = 0;
        std::memcpy(&bits, bytes, sizeof(bits));
        out.rough |= (bits & ((1u << n) - 1)) << l;
        out.active = out.active || !hn::AllFalse(d, on);
    }
}

/// Positions, Jacobians and weights of one source for a group.
HWY_INLINE void place(const ShadeSource& s, const Ray& fromEye, const Group& g, std::uint32_t bit,
                      float edgeWeight, GroupSource& out) {
    const hn::ScalableTag<float> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    using V = hn::Vec<decltype(d)>;
    const int n = static_cast<int>(hn::Lanes(d));
    const auto& m = s.sourceFromPixel.m;
    const auto c = [&](float value) { return hn::Set(d, value); };
    const V one = c(1.0f);
    bool narrow = true;
    for (int l = 0; l < kGroup; l += n) {
        const V x = hn::LoadU(d, g.x + l), y = hn::LoadU(d, g.y + l), q = hn::LoadU(d, g.q + l);
        const V qx = hn::LoadU(d, g.qx + l), qy = hn::LoadU(d, g.qy + l);
        const auto row = [&](const float* r) {
            return hn::MulAdd(c(r[0]), x, hn::MulAdd(c(r[1]), y, hn::MulAdd(c(r[2]), q, c(r[3]))));
        };
        const V w = row(&m[12]);
        const V inverse = hn::Div(one, w);
        const V u = hn::Mul(row(&m[0]), inverse), v = hn::Mul(row(&m[4]), inverse);
        // Along the tangent plane the denominator and the numerators change with q as well.
        const V wx = hn::MulAdd(c(m[14]), qx, c(m[12])), wy = hn::MulAdd(c(m[14]), qy, c(m[13]));
        const V ux = hn::Mul(hn::NegMulAdd(u, wx, hn::MulAdd(c(m[2]), qx, c(m[0]))), inverse);
        const V uy = hn::Mul(hn::NegMulAdd(u, wy, hn::MulAdd(c(m[2]), qy, c(m[1]))), inverse);
        const V vx = hn::Mul(hn::NegMulAdd(v, wx, hn::MulAdd(c(m[6]), qx, c(m[4]))), inverse);
        const V vy = hn::Mul(hn::NegMulAdd(v, wy, hn::MulAdd(c(m[6]), qy, c(m[5]))), inverse);
        const V det = hn::NegMulAdd(uy, vx, hn::Mul(ux, vy));
        const V inverseDet = hn::Div(one, hn::Max(det, c(1e-4f)));
        // exp(-3 angle), as one over the first terms of exp(3 angle).
        const V ax = row(&fromEye[0]), ay = row(&fromEye[4]), az = row(&fromEye[8]);
        const V bx = row(&s.fromEye[0]), by = row(&s.fromEye[4]), bz = row(&s.fromEye[8]);
        const V ab = hn::MulAdd(ax, bx, hn::MulAdd(ay, by, hn::Mul(az, bz)));
        const V aa = hn::MulAdd(ax, ax, hn::MulAdd(ay, ay, hn::Mul(az, az)));
        const V bb = hn::MulAdd(bx, bx, hn::MulAdd(by, by, hn::Mul(bz, bz)));
        const V cosine = hn::Div(ab, hn::Sqrt(hn::Mul(aa, bb)));
        const V t =
            hn::Mul(c(kAngleFalloff),
                    hn::Sqrt(hn::Max(hn::NegMulAdd(c(2.0f), cosine, c(2.0f)), hn::Zero(d))));
        const V series =
            hn::MulAdd(t, hn::MulAdd(t, hn::MulAdd(t, c(1.0f / 6), c(0.5f)), one), one);
        V weight = hn::Div(hn::Min(one, hn::Sqrt(hn::Max(det, c(kLeastArea)))), series);
        const auto within = [&](V at, int size) HWY_ATTR {
            return hn::And(hn::Ge(at, c(-kBesidePicture)),
                           hn::Lt(at, c(static_cast<float>(size) + kBesidePicture)));
        };
        const auto inFrame = hn::And(within(u, s.source->width), within(v, s.source->height));
        const auto bits = hn::LoadU(du, g.sources + l);
        const auto chosen = hn::RebindMask(d, hn::TestBit(bits, hn::Set(du, bit)));
        const auto active = hn::And(hn::And(inFrame, chosen), hn::Gt(w, hn::Zero(d)));
        // Lanes without this source get a harmless place, so that none reads outside.
        hn::StoreU(hn::IfThenElseZero(active, weight), d, &out.weight[l]);
        hn::StoreU(hn::IfThenElse(active, u, one), d, &out.u[l]);
        hn::StoreU(hn::IfThenElse(active, v, one), d, &out.v[l]);
        // A plane that is turned away says nothing of how pixels lie to each other.
        const auto facing = hn::And(active, hn::Gt(det, hn::Zero(d)));
        const V finest =
            hn::Max(hn::MulAdd(ux, ux, hn::Mul(uy, uy)), hn::MulAdd(vx, vx, hn::Mul(vy, vy)));
        const auto wide = hn::And(facing, hn::Gt(finest, c(kNarrowStep)));
        narrow = narrow && hn::AllFalse(d, wide);
        hn::StoreU(hn::IfThenElse(wide, c(2.0f), c(kNarrowReach)), d, &out.reach[l]);
        hn::StoreU(hn::IfThenElse(facing, hn::Mul(vy, inverseDet), one), d, &out.xu[l]);
        hn::StoreU(hn::IfThenElseZero(facing, hn::Neg(hn::Mul(uy, inverseDet))), d, &out.xv[l]);
        hn::StoreU(hn::IfThenElseZero(facing, hn::Neg(hn::Mul(vx, inverseDet))), d, &out.yu[l]);
        hn::StoreU(hn::IfThenElse(facing, hn::Mul(ux, inverseDet), one), d, &out.yv[l]);
    }
    out.narrow = narrow && s.source->whole;
    alignas(64) std::int32_t edge[kGroup];
    findEdges(*s.source, out, edge);
    weighEdges(edge, edgeWeight, out);
}

/// What a tap of lane `l` counts that mixes colours, see kMixedTap.
HWY_INLINE float mixedTap(const Source& source, const GroupSource& view, int l, float edgeWeight) {
    const float least = std::max(kMixedTap, edgeWeight);
    if (source.view->depthMayBeUnknown()) return least;
    const float area = std::abs(view.xu[l] * view.yv[l] - view.xv[l] * view.yu[l]);
    return std::clamp(1.0f / std::sqrt(std::max(area, 1e-12f)), least, 1.0f);
}

/// 1 (or alpha) for taps on the surface of the piece, less where they mix its colours with others,
/// 0 for taps elsewhere, of one lane; taps row by row, `out` aligned to a row. `mixed`: see
/// mixedTap().
HWY_INLINE void maskTaps(const ShadeSource& s, const Group& g, int lane, float u, float v,
                         const GroupSource& view, int baseU, int baseV, float mixed,
                         float out[kTaps * kTaps]) {
    const Source& source = *s.source;
    const auto& m = s.sourceFromPixel.m;
    const float x = g.x[lane], y = g.y[lane], q = g.q[lane];
    const float inverse = 1.0f / (m[12] * x + m[13] * y + m[14] * q + m[15]);
    const float p = (m[8] * x + m[9] * y + m[10] * q + m[11]) * inverse;
    const float wx = m[12] + m[14] * g.qx[lane], wy = m[13] + m[14] * g.qy[lane];
    const float px = (m[8] + m[10] * g.qx[lane] - p * wx) * inverse;
    const float py = (m[9] + m[10] * g.qy[lane] - p * wy) * inverse;
    const float pu = px * view.xu[lane] + py * view.yu[lane];
    const float pv = px * view.xv[lane] + py * view.yv[lane];
    const float scale = source.space.axis.stepScale(p);
    const float allowed = kOnSurface * scale +
                          kOnSlope * std::min(std::abs(pu) + std::abs(pv), kSteepestTap * scale) +
                          source.step * source.space.axis.qPerUnit(p);
    const TapPlace taps = view.tapsOf(source, lane, baseU, baseV);
#if HWY_TARGET != HWY_SCALAR
    const Rgba8Image* bytes = taps.page->texture->rgba8();
    if (taps.stepX == 1 && baseU >= taps.x0 && baseV >= taps.y0 && baseU + kTaps <= taps.x1 &&
        baseV + kTaps <= taps.y1 && (bytes || !source.hasAlpha)) {
        // The same for a row of taps at once.
        const hn::FixedTag<float, kTaps> d;
        const hn::RebindToSigned<decltype(d)> di;
        const auto far = hn::Set(d, kFarthestTap * scale), limit = hn::Set(d, allowed);
        const std::uint8_t* texels = taps.page->info.data();
        const auto du = hn::Add(hn::ConvertTo(d, hn::Iota(di, 0)),
                                hn::Set(d, static_cast<float>(baseU) + 0.5f - u));
        for (int j = 0; j < kTaps; ++j) {
            const float dv = static_cast<float>(baseV + j) + 0.5f - v;
            const std::size_t texel = taps.texel(0, j);
            const auto there = hn::LoadU(d, taps.page->q.data() + texel);
            const auto change = hn::MulAdd(du, hn::Set(d, pu), hn::Set(d, pv * dv));
            const auto predicted =
                hn::Add(hn::Set(d, p), hn::Min(hn::Max(change, hn::Neg(far)), far));
            const auto on = hn::And(hn::Gt(there, hn::Zero(d)),
                                    hn::Le(hn::Abs(hn::Sub(there, predicted)), limit));
            auto value = hn::Set(d, 1.0f);
            if (source.hasAlpha) {
                const auto* from = reinterpret_cast<const std::int32_t*>(bytes->data() + texel);
                const auto colours =
                    hn::BitCast(hn::RebindToUnsigned<decltype(di)>(), hn::LoadU(di, from));
                const auto alpha = hn::BitCast(di, hn::ShiftRight<24>(colours));
                value = hn::Mul(hn::ConvertTo(d, alpha), hn::Set(d, 1.0f / 255.0f));
            }
            const auto info = hn::PromoteTo(
                di, hn::LoadU(hn::Rebind<std::uint8_t, decltype(d)>(), texels + texel));
            const auto mixes =
                hn::Or(hn::TestBit(info, hn::Set(di, Info::kCrease)),
                       hn::Eq(hn::And(info, hn::Set(di, Info::kAwayFromInnerEdge)), hn::Zero(di)));
            value =
                hn::IfThenElse(hn::RebindMask(d, mixes), hn::Mul(value, hn::Set(d, mixed)), value);
            hn::Store(hn::IfThenElseZero(on, value), d, out + kTaps * j);
        }
        return;
    }
#endif
    for (int j = 0; j < kTaps; ++j) {
        for (int i = 0; i < kTaps; ++i) {
            const int cx = baseU + i, cy = baseV + j;
            float& value = out[j * kTaps + i];
            value = 0.0f;
            if (cx < taps.x0 || cy < taps.y0 || cx >= taps.x1 || cy >= taps.y1) continue;
            const float there = source.qAt(taps, i, j);
            if (!(there > 0.0f)) continue;
            const float du = static_cast<float>(cx) + 0.5f - u,
                        dv = static_cast<float>(cy) + 0.5f - v;
            const float predicted =
                p + std::clamp(pu * du + pv * dv, -kFarthestTap * scale, kFarthestTap * scale);
            if (std::abs(there - predicted) > allowed) continue;
            value = source.hasAlpha ? source.alphaAt(taps, i, j) : 1.0f;
            if (Info::mixesColours(taps.page->info.data()[taps.texel(i, j)])) value *= mixed;
        }
    }
}

/// The texels of a view that fills its page, when the taps of all lanes that have weight are in it:
/// `first` becomes the first of each lane, any of the others, whose taps weigh nothing. Null when
/// taps must be looked at one lane at a time.
HWY_INLINE const Rgba8Image* findRows(const Source& source, const GroupSource& view,
                                      const Lanes* bases, std::int32_t* first) {
    const hn::ScalableTag<float> d;
    const hn::RebindToSigned<decltype(d)> di;
    if (!source.whole || source.width < kTaps || source.height < kTaps) return nullptr;
    const Rgba8Image* bytes = source.whole->texture->rgba8();
    if (!bytes) return nullptr;
    const auto lastU = hn::Set(d, static_cast<float>(source.width - kTaps));
    const auto lastV = hn::Set(d, static_cast<float>(source.height - kTaps));
    for (int l = 0; l < kGroup; l += static_cast<int>(hn::Lanes(d))) {
        const auto u = hn::LoadU(d, &bases[0][l]), v = hn::LoadU(d, &bases[1][l]);
        const auto zero = hn::Zero(d);
        const auto counts = hn::Gt(hn::LoadU(d, &view.weight[l]), zero);
        const auto inside = hn::And(hn::And(hn::Ge(u, zero), hn::Le(u, lastU)),
                                    hn::And(hn::Ge(v, zero), hn::Le(v, lastV)));
        if (!hn::AllFalse(d, hn::AndNot(inside, counts))) return nullptr;
        const auto texel =
            hn::Add(hn::Mul(hn::ConvertTo(di, v), hn::Set(di, source.width)), hn::ConvertTo(di, u));
        hn::StoreU(hn::IfThenElseZero(hn::RebindMask(di, counts), texel), di, first + l);
    }
    return bytes;
}

/// The sources of a group, and the taps of each; one for each thread.
struct GroupTaps {
    GroupSource views[32];  ///< by source
    int list[32];           ///< sources that some lane takes colours from
    int count = 0;          ///< of the list
    // By source: the first tap of each lane (column, row), what taps count, and whether they do.
    Lanes bases[32][2];
    Lanes kernels[32][kTaps * kTaps];
    Lanes masks[32][kTaps * kTaps];
};

/// Fills the list with the sources that see some lane, and places them.
HWY_INLINE void placeSources(const Group& g, std::span<const ShadeSource> sources,
                             const Ray& fromEye, float edgeWeight, GroupTaps& t) {
    std::uint32_t seen = 0;
    for (int l = 0; l < g.count; ++l) seen |= g.sources[l];
    t.count = 0;
    for (std::uint32_t left = seen; left; left &= left - 1) {
        const int s = std::countr_zero(left);
        place(sources[static_cast<std::size_t>(s)], fromEye, g, 1u << s, edgeWeight, t.views[s]);
        if (t.views[s].active) t.list[t.count++] = s;
    }
}

/// The source that weighs most in each lane, -1 = none.
HWY_INLINE void findBest(const Group& g, const GroupTaps& t, std::int8_t* best) {
    alignas(64) std::int32_t top[kGroup];
    Lanes topWeight;
    for (int l = 0; l < kGroup; ++l) {
        top[l] = -1;
        topWeight[l] = 0.0f;
    }
    for (int k = 0; k < t.count; ++k) {
        const GroupSource& view = t.views[t.list[k]];
        for (int l = 0; l < kGroup; ++l) {
            const bool better = view.weight[l] > topWeight[l];
            topWeight[l] = better ? view.weight[l] : topWeight[l];
            top[l] = better ? t.list[k] : top[l];
        }
    }
    for (int l = 0; l < g.count; ++l) best[l] = static_cast<std::int8_t>(top[l]);
}

/// Leaves the `most` heaviest sources to each lane. They weigh less the heavier the first one is
/// that was left out, so that none comes or goes at once.
HWY_INLINE void keepHeaviest(const Group& g, int most, GroupTaps& t) {
    const hn::ScalableTag<float> d;
    using V = hn::Vec<decltype(d)>;
    for (int l = 0; l < kGroup; l += static_cast<int>(hn::Lanes(d))) {
        V heaviest[kMostShaded + 1];
        for (int i = 0; i <= most; ++i) heaviest[i] = hn::Zero(d);
        for (int k = 0; k < t.count; ++k) {
            V weight = hn::LoadU(d, &t.views[t.list[k]].weight[l]);
            for (int i = 0; i <= most; ++i) {
                const V heavier = hn::Max(heaviest[i], weight);
                weight = hn::Min(heaviest[i], weight);
                heaviest[i] = heavier;
            }
        }
        const V dropped = heaviest[most], least = heaviest[most - 1];
        for (int k = 0; k < t.count; ++k) {
            Lanes& weights = t.views[t.list[k]].weight;
            const V weight = hn::LoadU(d, &weights[l]);
            const V ratio = hn::Div(dropped, hn::Max(weight, hn::Set(d, 1e-20f)));
            const V kept = hn::Max(hn::NegMulAdd(ratio, ratio, hn::Set(d, 1.0f)),
                                   hn::Set(d, kLeastKeptWeight));
            hn::StoreU(hn::IfThenElseZero(hn::Ge(weight, least), hn::Mul(weight, kept)), d,
                       &weights[l]);
        }
    }
    // Neighbouring pieces mostly leave out the same sources.
    const auto used = [&](int s) {
        const GroupSource& view = t.views[s];
        for (int l = 0; l < g.count; ++l)
            if (view.weight[l] > 0.0f) return true;
        return false;
    };
    t.count = static_cast<int>(std::stable_partition(t.list, t.list + t.count, used) - t.list);
}

/// The first taps of a source, and which of them lie on the surface of their lane.
HWY_INLINE void findTaps(const Group& g, const ShadeSource& source, int s, float edgeWeight,
                         GroupTaps& t) {
    const hn::ScalableTag<float> d;
    using V = hn::Vec<decltype(d)>;
    const GroupSource& view = t.views[s];
    for (int l = 0; l < kGroup; l += static_cast<int>(hn::Lanes(d))) {
        const V shift = hn::Set(d, view.narrow ? -1.0f : -1.5f);
        hn::StoreU(hn::Floor(hn::Add(hn::LoadU(d, &view.u[l]), shift)), d, &t.bases[s][0][l]);
        hn::StoreU(hn::Floor(hn::Add(hn::LoadU(d, &view.v[l]), shift)), d, &t.bases[s][1][l]);
    }
    fetchAhead(*source.source, t.bases[s], g.count);
    if (!view.rough) return;
    for (Lanes& tap : t.masks[s]) std::fill(tap.v, tap.v + kGroup, 1.0f);
    for (std::uint32_t left = view.rough; left; left &= left - 1) {
        const int l = std::countr_zero(left);
        if (l >= g.count || !(view.weight[l] > 0.0f)) continue;
        alignas(16) float mask[kTaps * kTaps];
        maskTaps(source, g, l, view.u[l], view.v[l], view, static_cast<int>(t.bases[s][0][l]),
                 static_cast<int>(t.bases[s][1][l]), mixedTap(*source.source, view, l, edgeWeight),
                 mask);
        for (int i = 0; i < kTaps * kTaps; ++i) t.masks[s][i][l] = mask[i];
    }
}

/// The kernels of a source's taps, and their moments added to `moments`.
template <int kSide>
HWY_INLINE void addMoments(int s, float kernel, GroupTaps& t, Lanes* moments) {
    const hn::ScalableTag<float> d;
    const GroupSource& view = t.views[s];
    for (int l = 0; l < kGroup; l += static_cast<int>(hn::Lanes(d))) {
        hn::Vec<decltype(d)> m[kMoments];
        for (int i = 0; i < kMoments; ++i) m[i] = hn::LoadU(d, &moments[i][l]);
        const Taps<decltype(d), kSide> at(d, view, t.bases[s][0], t.bases[s][1], l);
        at.addMoments(d, 1.0f / kernel, hn::LoadU(d, &view.weight[l]), hn::LoadU(d, &view.reach[l]),
                      view.rough ? t.masks[s] : nullptr, t.kernels[s], l, m);
        for (int i = 0; i < kMoments; ++i) hn::StoreU(m[i], d, &moments[i][l]);
    }
}

/// The polynomials of all lanes out of their moments: what makes the fit's middle of the taps.
HWY_INLINE void solveGroup(const Lanes* moments, const ShadeSettings& settings, Lanes* rows) {
    const hn::ScalableTag<float> d;
    for (int l = 0; l < kGroup; l += static_cast<int>(hn::Lanes(d))) {
        hn::Vec<decltype(d)> m[kMoments], row[6];
        for (int i = 0; i < kMoments; ++i) m[i] = hn::LoadU(d, &moments[i][l]);
        m[0] = hn::Max(m[0], hn::Set(d, 1e-12f));
        solveFirstRow(d, m, settings.kernel, settings.ridge, row);
        for (int i = 0; i < 6; ++i) hn::StoreU(row[i], d, &rows[i][l]);
    }
}

/// What the taps of a source count, with their sums added to `total`.
template <int kSide>
HWY_INLINE void weighTaps(int s, const GroupTaps& t, const Lanes* rows, TapWeights& weights,
                          float* total) {
    const hn::ScalableTag<float> d;
    using V = hn::Vec<decltype(d)>;
    for (int l = 0; l < kGroup; l += static_cast<int>(hn::Lanes(d))) {
        V row[6];
        for (int i = 0; i < 6; ++i) row[i] = hn::LoadU(d, &rows[i][l]);
        const Taps<decltype(d), kSide> at(d, t.views[s], t.bases[s][0], t.bases[s][1], l);
        const V sum = at.weigh(d, row, t.kernels[s], l, weights);
        hn::StoreU(hn::Add(sum, hn::LoadU(d, &total[l])), d, &total[l]);
    }
}

/// The colours of a source's taps by these weights, added to `sums`.
template <int kSide>
HWY_INLINE void fetchTaps(const Group& g, const Source& source, int s, const GroupTaps& t,
                          const TapWeights& weights, ColourSum* sums) {
    const GroupSource& view = t.views[s];
    alignas(64) std::int32_t rowsFrom[kGroup];
    if (const Rgba8Image* bytes = findRows(source, view, t.bases[s], rowsFrom)) {
        for (int l = 0; l < g.count; ++l)
            fetchRows(bytes->data() + rowsFrom[l], source.width, kSide, weights, l, sums[l]);
        return;
    }
    for (int l = 0; l < g.count; ++l) {
        if (!(view.weight[l] > 0.0f)) continue;
        const int baseU = static_cast<int>(t.bases[s][0][l]);
        const int baseV = static_cast<int>(t.bases[s][1][l]);
        const TapPlace taps = view.tapsOf(source, l, baseU, baseV);
        const Rgba8Image* bytes = taps.page->texture->rgba8();
        if (!bytes) {
            fetchFloats(*taps.page->texture->rgbaFloat(), taps, baseU, baseV, kSide, weights, l,
                        sums[l]);
        } else if (taps.stepX == 1 && baseU >= taps.x0 && baseV >= taps.y0 &&
                   baseU + kTaps <= taps.x1 && baseV + kTaps <= taps.y1) {
            fetchRows(bytes->data() + taps.first, static_cast<int>(taps.stepY), kSide, weights, l,
                      sums[l]);
        } else {
            glm::u8vec4 gathered[kTaps * kTaps];
            gatherTaps(*bytes, taps, baseU, baseV, gathered);
            fetchRows(gathered, kTaps, kSide, weights, l, sums[l]);
        }
    }
}

/// The colours out of their sums; where no tap lies on the surface, that of the nearest pixel.
HWY_INLINE void writeColours(const Group& g, std::span<const ShadeSource> sources,
                             const GroupTaps& t, const ColourSum* sums, const float* total,
                             const std::int8_t* best, glm::vec3* colours) {
    const bool bytes = !sources.empty() && !sources[0].source->set->linear();
    const float scale = bytes ? 1.0f / 255.0f : 1.0f;
    for (int l = 0; l < g.count; ++l) {
        if (total[l] > 0.5f) {
            const float f = scale / total[l];
            glm::vec3 value;
            for (int c = 0; c < 3; ++c)
                value[c] =
                    (sums[l].v[c] + sums[l].v[4 + c] + sums[l].v[8 + c] + sums[l].v[12 + c]) * f;
            value = glm::max(value, glm::vec3(0.0f));
            if (bytes) value = glm::min(value, glm::vec3(1.0f));
            colours[l] = value;
        } else if (best[l] >= 0) {
            const GroupSource& view = t.views[best[l]];
            const Source& source = *sources[static_cast<std::size_t>(best[l])].source;
            colours[l] = glm::vec3(
                source.colour(std::clamp(static_cast<int>(view.u[l]), 0, source.width - 1),
                              std::clamp(static_cast<int>(view.v[l]), 0, source.height - 1)));
        } else {
            colours[l] = glm::vec3(0.0f);
        }
    }
}

void shadeGroup(const Group& g, std::span<const ShadeSource> sources, const Ray& fromEye,
                const ShadeSettings& settings, glm::vec3* colours, std::int8_t* best) {
    static thread_local GroupTaps t;
    placeSources(g, sources, fromEye, settings.edgeWeight, t);
    findBest(g, t, best);
    if (t.count > settings.mostSources) keepHeaviest(g, settings.mostSources, t);

    Lanes moments[kMoments] = {};
    for (int k = 0; k < t.count; ++k) {
        const int s = t.list[k];
        const ShadeSource& source = sources[static_cast<std::size_t>(s)];
        findTaps(g, source, s, settings.edgeWeight, t);
        if (t.views[s].narrow)
            addMoments<kNarrow>(s, settings.kernel, t, moments);
        else
            addMoments<kTaps>(s, settings.kernel, t, moments);
    }
    Lanes rows[6];
    solveGroup(moments, settings, rows);

    ColourSum sums[kGroup] = {};
    alignas(64) float total[kGroup] = {};
    TapWeights weights;
    for (int k = 0; k < t.count; ++k) {
        const int s = t.list[k];
        const Source& source = *sources[static_cast<std::size_t>(s)].source;
        if (t.views[s].narrow) {
            weighTaps<kNarrow>(s, t, rows, weights, total);
            fetchTaps<kNarrow>(g, source, s, t, weights, sums);
        } else {
            weighTaps<kTaps>(s, t, rows, weights, total);
            fetchTaps<kTaps>(g, source, s, t, weights, sums);
        }
    }
    writeColours(g, sources, t, sums, total, best, colours);
}

void ShadePieces(const Pieces& p, std::span<const ShadeSource> sources, const Ray& fromEye,
                 const ShadeSettings& settings, glm::vec3* colours, std::int8_t* best) {
    const std::size_t size = p.size();
    for (std::size_t i = 0; i < size; i += kGroup) {
        if (i + kGroup <= size) {
            shadeGroup({&p.x[i], &p.y[i], &p.q[i], &p.qx[i], &p.qy[i], &p.sources[i], kGroup},
                       sources, fromEye, settings, colours + i, best + i);
            continue;
        }
        Lanes x, y, q, qx, qy;
        std::uint32_t seenBy[kGroup];
        for (int l = 0; l < kGroup; ++l) {
            const std::size_t k = std::min(i + static_cast<std::size_t>(l), size - 1);
            x[l] = p.x[k];
            y[l] = p.y[k];
            q[l] = p.q[k];
            qx[l] = p.qx[k];
            qy[l] = p.qy[k];
            seenBy[l] = p.sources[k];
        }
        shadeGroup({x.v, y.v, q.v, qx.v, qy.v, seenBy, static_cast<int>(size - i)}, sources,
                   fromEye, settings, colours + i, best + i);
    }
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::surface {

HWY_EXPORT(ShadePieces);

void shadePieces(const Pieces& pieces, std::span<const ShadeSource> sources, const Ray& fromEye,
                 const ShadeSettings& settings, std::vector<glm::vec3>& colours,
                 std::vector<std::int8_t>& bestSource) {
    colours.resize(pieces.size());
    bestSource.resize(pieces.size());
    if (pieces.size() == 0) return;
    HWY_DYNAMIC_DISPATCH(ShadePieces)
    (pieces, sources, fromEye, settings, colours.data(), bestSource.data());
}

}  // namespace stx::surface
#endif
