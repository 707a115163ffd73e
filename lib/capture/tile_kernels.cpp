#include "lib/capture/tile_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/capture/tile_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <span>

#include "lib/base/rounding.hpp"

#ifndef STX_TILE_KERNELS_ONCE
#define STX_TILE_KERNELS_ONCE
namespace stx {
static_assert(std::endian::native == std::endian::little, "texels are read as 32-bit words");

/// What PixelSamples hands to its loop.
struct TextureSamples {
    /// Either u and v as shares of `total`, or the edges that give barycentrics, and uvs.
    const Affine *u = nullptr, *v = nullptr, *total = nullptr;
    const Affine* edges = nullptr;
    std::array<glm::vec2, 3> uvs{};
    const double *x = nullptr, *y = nullptr;  ///< of the samples, within the pixel
    int count = 0;
    double px = 0, py = 0;
    const std::uint32_t* texels = nullptr;
    int width = 0, height = 0;
    bool clampU = false, clampV = false;
};
}  // namespace stx
#endif

HWY_BEFORE_NAMESPACE();
namespace stx::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DD = hn::CappedTag<double, 8>;
using DSpan = hn::Rebind<float, DD>;
using DSlot = hn::Rebind<std::uint32_t, DD>;

void nearerImpl(const Span& span, float* depth, std::uint32_t* ids) {
    const DD dd;
    const DSpan df;
    const DSlot du;
    const int lanes = static_cast<int>(hn::Lanes(dd));
    const auto slot = hn::Set(du, span.slot);
    const auto zero = hn::Zero(df);
    for (int i = span.from; i <= span.to; i += lanes) {
        const auto number = hn::Iota(dd, static_cast<double>(i));
        const auto x = hn::Add(hn::Set(dd, span.origin), hn::Mul(number, hn::Set(dd, span.step)));
        const auto nearness =
            hn::DemoteTo(df, hn::Add(hn::Mul(hn::Set(dd, span.slope), x), hn::Set(dd, span.base)));
        const auto old = hn::LoadU(df, depth + i);
        const auto front = span.perspective ? hn::Gt(nearness, zero) : hn::Le(nearness, zero);
        const auto within =
            hn::FirstN(df, static_cast<std::size_t>(std::min(lanes, span.to - i + 1)));
        const auto take = hn::And(within, hn::And(front, hn::Gt(nearness, old)));
        hn::StoreU(hn::IfThenElse(take, nearness, old), df, depth + i);
        hn::StoreU(hn::IfThenElse(hn::RebindMask(du, take), slot, hn::LoadU(du, ids + i)), du,
                   ids + i);
    }
}

void nearerInsideImpl(const Patch& patch, float* depth, std::uint32_t* ids) {
    const DD dd;
    const DSpan df;
    const DSlot du;
    const int lanes = static_cast<int>(hn::Lanes(dd));
    const auto slot = hn::Set(du, patch.slot);
    const auto zero = hn::Zero(df);
    const auto none = hn::Zero(dd);
    for (int i = patch.left; i <= patch.right; i += lanes) {
        const auto number = hn::Iota(dd, static_cast<double>(i));
        const auto x = hn::Add(hn::Set(dd, patch.x), hn::Mul(number, hn::Set(dd, patch.step)));
        const auto within =
            hn::FirstN(dd, static_cast<std::size_t>(std::min(lanes, patch.right - i + 1)));
        const auto e0 = hn::Mul(hn::Set(dd, patch.edges[0].a), x),
                   e1 = hn::Mul(hn::Set(dd, patch.edges[1].a), x),
                   e2 = hn::Mul(hn::Set(dd, patch.edges[2].a), x),
                   near = hn::Mul(hn::Set(dd, patch.nearness->a), x);
        for (int row = patch.top; row <= patch.bottom; ++row) {
            const double y = patch.y + row * patch.step;
            const auto rest = [&](const Affine& f) HWY_ATTR { return hn::Set(dd, f.b * y + f.c); };
            const auto inside =
                hn::And(hn::And(within, hn::Ge(hn::Add(e0, rest(patch.edges[0])), none)),
                        hn::And(hn::Ge(hn::Add(e1, rest(patch.edges[1])), none),
                                hn::Ge(hn::Add(e2, rest(patch.edges[2])), none)));
            if (hn::AllFalse(dd, inside)) continue;
            // Where it is outside, behind everything.
            const auto all = hn::Add(near, rest(*patch.nearness));
            const auto nearness = hn::DemoteTo(
                df,
                hn::IfThenElse(inside, all, hn::Set(dd, -std::numeric_limits<double>::infinity())));
            const std::size_t at = static_cast<std::size_t>(row) * patch.side + i;
            const auto old = hn::LoadU(df, depth + at);
            const auto front = patch.perspective ? hn::Gt(nearness, zero) : hn::Le(nearness, zero);
            const auto take = hn::And(front, hn::Gt(nearness, old));
            hn::StoreU(hn::IfThenElse(take, nearness, old), df, depth + at);
            hn::StoreU(hn::IfThenElse(hn::RebindMask(du, take), slot, hn::LoadU(du, ids + at)), du,
                       ids + at);
        }
    }
}

using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using DU = hn::RebindToUnsigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;

/// The texel before a place along one axis, and how far behind it the place is. False when one lane
/// is not between two texels.
HWY_INLINE bool between(VF place, bool clamped, int size, VI& texel, VF& share) {
    const DF df;
    const DI di;
    const auto far = hn::Set(df, clamped ? 1e30f : 2.0f);
    if (!hn::AllTrue(df, hn::Lt(hn::Abs(place), far))) return false;
    if (clamped) place = hn::Min(hn::Max(place, hn::Zero(df)), hn::Set(df, 1.0f));
    const VF at = hn::Sub(hn::Mul(place, hn::Set(df, static_cast<float>(size))), hn::Set(df, 0.5f));
    const VI whole = hn::ConvertTo(di, at);
    const auto below = hn::Lt(at, hn::ConvertTo(df, whole));
    texel = hn::Add(whole, hn::BitCast(di, hn::VecFromMask(df, below)));
    share = hn::Sub(at, hn::ConvertTo(df, texel));
    return hn::AllTrue(
        di, hn::And(hn::Gt(texel, hn::Set(di, -1)), hn::Lt(texel, hn::Set(di, size - 1))));
}

template <int kShift>
HWY_INLINE VF channel(hn::Vec<DU> texels) {
    const DF df;
    const DI di;
    const auto byte = hn::And(hn::ShiftRight<kShift>(texels), hn::Set(DU(), 255u));
    return hn::ConvertTo(df, hn::BitCast(di, byte));
}

bool coloursImpl(const TextureSamples& s, PixelColours& out) {
    const DD dd;
    const DSpan half;
    const DF df;
    const DI di;
    HWY_ALIGN float u[64], v[64];
    const auto px = hn::Set(dd, s.px), py = hn::Set(dd, s.py);
    const int pieces = (s.count + 15) / 16;
    for (int i = 0; i < 16 * pieces; i += static_cast<int>(hn::Lanes(dd))) {
        const auto x = hn::Add(px, hn::LoadU(dd, s.x + i)), y = hn::Add(py, hn::LoadU(dd, s.y + i));
        const auto at = [&](const Affine& f) HWY_ATTR {
            return hn::Add(hn::Mul(hn::Set(dd, f.a), x),
                           hn::Add(hn::Mul(hn::Set(dd, f.b), y), hn::Set(dd, f.c)));
        };
        if (s.edges) {
            const auto e0 = at(s.edges[0]), e1 = at(s.edges[1]), e2 = at(s.edges[2]);
            const auto scale = hn::Div(hn::Set(dd, 1.0), hn::Add(hn::Add(e0, e1), e2));
            const auto b0 = hn::DemoteTo(half, hn::Mul(e0, scale)),
                       b1 = hn::DemoteTo(half, hn::Mul(e1, scale)),
                       b2 = hn::DemoteTo(half, hn::Mul(e2, scale));
            const auto mixed = [&](float c0, float c1, float c2) HWY_ATTR {
                return hn::Add(
                    hn::Add(hn::Mul(hn::Set(half, c0), b0), hn::Mul(hn::Set(half, c1), b1)),
                    hn::Mul(hn::Set(half, c2), b2));
            };
            hn::StoreU(mixed(s.uvs[0].x, s.uvs[1].x, s.uvs[2].x), half, u + i);
            hn::StoreU(mixed(s.uvs[0].y, s.uvs[1].y, s.uvs[2].y), half, v + i);
            continue;
        }
        const auto inverse = hn::Div(hn::Set(dd, 1.0), at(*s.total));
        hn::StoreU(hn::DemoteTo(half, hn::Mul(at(*s.u), inverse)), half, u + i);
        hn::StoreU(hn::DemoteTo(half, hn::Mul(at(*s.v), inverse)), half, v + i);
    }
    const auto width = hn::Set(di, s.width);
    for (int i = 0; i < 16 * pieces; i += static_cast<int>(hn::Lanes(df))) {
        VI column = hn::Zero(di), row = column;
        VF right = hn::Zero(df), down = right;
        if (!between(hn::LoadU(df, u + i), s.clampU, s.width, column, right) ||
            !between(hn::LoadU(df, v + i), s.clampV, s.height, row, down))
            return false;
        const VI first = hn::Add(hn::Mul(row, width), column), second = hn::Add(first, width);
        const VI one = hn::Set(di, 1);
        const DU du;
        const auto a = hn::GatherIndex(du, s.texels, first),
                   b = hn::GatherIndex(du, s.texels, hn::Add(first, one)),
                   c = hn::GatherIndex(du, s.texels, second),
                   d = hn::GatherIndex(du, s.texels, hn::Add(second, one));
        const VF left = hn::Sub(hn::Set(df, 1.0f), right), up = hn::Sub(hn::Set(df, 1.0f), down);
        const auto mean = [&](VF ca, VF cb, VF cc, VF cd) HWY_ATTR {
            const VF top = hn::Add(hn::Mul(ca, left), hn::Mul(cb, right));
            const VF bottom = hn::Add(hn::Mul(cc, left), hn::Mul(cd, right));
            return hn::Mul(hn::Add(hn::Mul(top, up), hn::Mul(bottom, down)),
                           hn::Set(df, 1.0f / 255.0f));
        };
        hn::StoreU(mean(channel<0>(a), channel<0>(b), channel<0>(c), channel<0>(d)), df,
                   out.red.data() + i);
        hn::StoreU(mean(channel<8>(a), channel<8>(b), channel<8>(c), channel<8>(d)), df,
                   out.green.data() + i);
        hn::StoreU(mean(channel<16>(a), channel<16>(b), channel<16>(c), channel<16>(d)), df,
                   out.blue.data() + i);
    }
    return true;
}

}  // namespace stx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx {

HWY_EXPORT(nearerImpl);
HWY_EXPORT(nearerInsideImpl);
HWY_EXPORT(coloursImpl);

void nearerSamples(const Span& span, float* depth, std::uint32_t* ids) {
    HWY_DYNAMIC_DISPATCH(nearerImpl)(span, depth, ids);
}

void nearerInside(const Patch& patch, float* depth, std::uint32_t* ids) {
    HWY_DYNAMIC_DISPATCH(nearerInsideImpl)(patch, depth, ids);
}

PixelSamples::PixelSamples(int side) : count_(side * side) {
    const double step = 1.0 / side;
    for (int k = 0; k < 64; ++k) {
        const int sample = std::min(k, count_ - 1);
        x_[k] = (sample % side + 0.5) * step;
        y_[k] = (sample / side + 0.5) * step;
    }
}

bool PixelSamples::colours(const MeshTexture& texture, TextureSamples& s, int px, int py,
                           PixelColours& out) const {
    const auto& image = texture.pixels;
    // Places of texels are counted in 32 bits.
    if (texture.nearest || image.count() > std::numeric_limits<std::int32_t>::max()) return false;
    s.x = x_.data();
    s.y = y_.data();
    s.count = count_;
    s.px = px;
    s.py = py;
    s.texels = reinterpret_cast<const std::uint32_t*>(image.data());
    s.width = image.width();
    s.height = image.height();
    s.clampU = texture.wrapU == MeshTexture::Wrap::clamp;
    s.clampV = texture.wrapV == MeshTexture::Wrap::clamp;
    return HWY_DYNAMIC_DISPATCH(coloursImpl)(s, out);
}

std::optional<glm::vec3> PixelSamples::sum(const MeshTexture& texture, const Affine& u,
                                           const Affine& v, const Affine& total, int px,
                                           int py) const {
    TextureSamples s;
    s.u = &u;
    s.v = &v;
    s.total = &total;
    PixelColours all;
    if (!colours(texture, s, px, py, all)) return {};
    // One after the other: in another order they would round otherwise.
    glm::vec3 sum(0.0f);
    for (int k = 0; k < count_; ++k) sum += all.at(k);
    return sum;
}

bool PixelSamples::colours(const MeshTexture& texture, const Affine* edges,
                           const std::array<glm::vec2, 3>& uvs, int px, int py,
                           PixelColours& out) const {
    TextureSamples s;
    s.edges = edges;
    s.uvs = uvs;
    return colours(texture, s, px, py, out);
}

bool clipSpan(const Affine* edges, double y, double step, double origin, int& from, int& to) {
    // A few samples are asked one by one.
    if (to - from < kFewSamples) {
        const auto &p = edges[0], &q = edges[1], &r = edges[2];
        const double atP = p.b * y + p.c, atQ = q.b * y + q.c, atR = r.b * y + r.c;
        const auto inside = [&](int i) {
            const double x = origin + i * step;
            return p.a * x + atP >= 0 && q.a * x + atQ >= 0 && r.a * x + atR >= 0;
        };
        while (from <= to && !inside(from)) ++from;
        while (from <= to && !inside(to)) --to;
        return from <= to;
    }
    // Shrink [from, to] by each edge; the exact predicate decides at the ends, and being monotone
    // in x it holds in between.
    const double perStep = 1.0 / step;
    for (const auto& e : std::span(edges, 3)) {
        const double rest = e.b * y + e.c;
        const auto inside = [&](int i) { return e.a * (origin + i * step) + rest >= 0; };
        if (e.a == 0) {
            if (rest < 0) return false;
            continue;
        }
        // Near enough to begin with; std::ceil() and std::floor() would be calls.
        const double zero = (-rest / e.a - origin) * perStep;
        if (e.a > 0) {
            int i = ceilToInt(std::clamp(zero, from - 1.0, to + 2.0));
            i = std::max(i, from);
            while (i > from && inside(i - 1)) --i;
            while (i <= to && !inside(i)) ++i;
            from = i;
        } else {
            int i = floorToInt(std::clamp(zero, from - 2.0, to + 1.0));
            i = std::min(i, to);
            while (i < to && inside(i + 1)) ++i;
            while (i >= from && !inside(i)) --i;
            to = i;
        }
        if (from > to) return false;
    }
    return true;
}

}  // namespace stx
#endif
