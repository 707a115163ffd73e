// Weighted texels of a group of pieces. Included by shade.cpp once for each SIMD target.

#if defined(STX_SURFACE_FETCH_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_SURFACE_FETCH_INL_HPP
#undef STX_SURFACE_FETCH_INL_HPP
#else
#define STX_SURFACE_FETCH_INL_HPP
#endif

#include <algorithm>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "lib/render/surface/cpu/shade_groups.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Running sums of one lane's colour: RGBA, several times over, to be added up at the end.
struct alignas(64) ColourSum {
    float v[16];
};

/// The weights of the taps of all pieces of a group; the four of a row lie side by side, as they
/// are loaded.
struct TapWeights {
    /// v[row][l % 4] holds taps 4 (l / 4) to 4 (l / 4) + 3 of a row of piece l: the order in which
    /// blocks of four pieces come out of transposing.
    Lanes v[kTaps][4];

    [[nodiscard]] const float* row(int j, int lane) const { return &v[j][lane & 3][lane & ~3]; }

    /// Stores four taps of a row of the pieces from l on; each vector holds one tap of all of them.
    template <class D, class V = hn::Vec<D>>
    HWY_INLINE void store(D d, int j, int l, const V* taps) {
#if HWY_TARGET == HWY_SCALAR
        (void)d;
        for (int i = 0; i < kTaps; ++i) v[j][l & 3][(l & ~3) + i] = hn::GetLane(taps[i]);
#else
        const V a = hn::InterleaveLower(d, taps[0], taps[2]);
        const V b = hn::InterleaveUpper(d, taps[0], taps[2]);
        const V e = hn::InterleaveLower(d, taps[1], taps[3]);
        const V f = hn::InterleaveUpper(d, taps[1], taps[3]);
        hn::StoreU(hn::InterleaveLower(d, a, e), d, &v[j][0][l]);
        hn::StoreU(hn::InterleaveUpper(d, a, e), d, &v[j][1][l]);
        hn::StoreU(hn::InterleaveLower(d, b, f), d, &v[j][2][l]);
        hn::StoreU(hn::InterleaveUpper(d, b, f), d, &v[j][3][l]);
#endif
    }
};

/// Adds the weighted taps of one lane of a float texture.
HWY_NOINLINE void fetchFloats(const RgbaFloatImage& image, const TapPlace& taps, int baseU,
                              int baseV, int rows, const TapWeights& weights, int lane,
                              ColourSum& sum) {
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < kTaps; ++i) {
            const int x = baseU + i, y = baseV + j;
            if (x < taps.x0 || y < taps.y0 || x >= taps.x1 || y >= taps.y1) continue;
            const float w = weights.row(j, lane)[i];
            const glm::vec4 texel = image.data()[taps.texel(i, j)];
            for (int c = 0; c < 4; ++c) sum.v[c] += w * texel[c];
        }
    }
}

/// The same for 8-bit texels of `rows` rows of four taps; as many taps of a row at once as a vector
/// takes.
HWY_INLINE void fetchRows(const glm::u8vec4* texels, int stride, int rows,
                          const TapWeights& weights, int lane, ColourSum& sum) {
    const hn::CappedTag<float, 16> d;
    using V = hn::Vec<decltype(d)>;
    constexpr int kN = static_cast<int>(hn::MaxLanes(d));
    if constexpr (kN < 4) {
        for (int t = 0; t < rows * kTaps; ++t)
            for (int c = 0; c < 4; ++c)
                sum.v[c] += weights.row(t / kTaps, lane)[t % kTaps] *
                            static_cast<float>(texels[t / kTaps * stride + t % kTaps][c]);
    } else {
        constexpr int kTexels = kN / 4;  // in one vector
        const hn::Rebind<std::uint8_t, decltype(d)> d8;
        const hn::RebindToSigned<decltype(d)> d32;
        const auto spread = hn::ShiftRight<2>(hn::Iota(d32, 0));
        V acc = hn::Load(d, sum.v);
        for (int j = 0; j < rows; ++j) {
            const V row = hn::LoadDup128(d, weights.row(j, lane));
            for (int i = 0; i < kTaps; i += kTexels) {
                const auto* from = &texels[j * stride + i].x;
                const V texel = hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d8, from)));
                const auto indices = hn::IndicesFromVec(d, hn::Add(spread, hn::Set(d32, i)));
                acc = hn::MulAdd(hn::TableLookupLanes(row, indices), texel, acc);
            }
        }
        hn::Store(acc, d, sum.v);
    }
}

/// Collects the texels of taps that do not lie side by side; taps outside of the rectangle get
/// zeros.
HWY_NOINLINE void gatherTaps(const Rgba8Image& image, const TapPlace& taps, int baseU, int baseV,
                             glm::u8vec4* out) {
    for (int j = 0; j < kTaps; ++j) {
        for (int i = 0; i < kTaps; ++i) {
            const int x = baseU + i, y = baseV + j;
            const bool inside = x >= taps.x0 && y >= taps.y0 && x < taps.x1 && y < taps.y1;
            out[j * kTaps + i] = inside ? image.data()[taps.texel(i, j)] : glm::u8vec4(0);
        }
    }
}

/// Fetches the texels of the first and the last piece of a group, between which the others mostly
/// lie, into the cache, while their weights are found.
HWY_INLINE void fetchAhead(const Source& source, const Lanes* base, int count) {
    if (!source.whole) return;
    const Rgba8Image* bytes = source.whole->texture->rgba8();
    if (!bytes) return;
    for (const int l : {0, count - 1}) {
        const int x = std::clamp(static_cast<int>(base[0][l]), 0, source.width - 1);
        for (int j = 0; j < kTaps; ++j) {
            const int y = std::clamp(static_cast<int>(base[1][l]) + j, 0, source.height - 1);
            hwy::Prefetch(bytes->data() + static_cast<std::size_t>(y) * source.width + x);
        }
    }
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
