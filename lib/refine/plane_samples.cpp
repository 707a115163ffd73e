#include "lib/refine/plane_samples.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/refine/plane_samples.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace stx::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;

/// A channel of texels, 0..255.
HWY_INLINE VF channel(VI texels, int number) {
    const DI di;
    return hn::ConvertTo(DF(), hn::And(hn::ShiftRightSame(texels, 8 * number), hn::Set(di, 0xff)));
}

HWY_INLINE VF mix(VF a, VF b, VF t) {
    return hn::Add(hn::Mul(a, hn::Sub(hn::Set(DF(), 1.0f), t)), hn::Mul(b, t));
}

}  // namespace

void differencesImpl(const PixelPlane& plane, float x, float y, const PlaneSamples& samples,
                     const OtherView& other, PlaneSamples::Floats& differences) {
    const DF d;
    const DI di;
    const glm::vec4 middle = other.warp.homogeneous(x, y, plane.q);
    const glm::vec4 alongX = other.warp.ofChange({1, 0, plane.gx, 0}),
                    alongY = other.warp.ofChange({0, 1, plane.gy, 0});
    const int width = other.q->width(), height = other.q->height();
    const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
    const VF right = hn::Set(d, static_cast<float>(width)),
             bottom = hn::Set(d, static_cast<float>(height));
    const VF most = hn::Set(d, kMostDifferent);
    const VI lastX = hn::Set(di, width - 1), lastY = hn::Set(di, height - 1),
             pitch = hn::Set(di, width);
    const auto* texels = reinterpret_cast<const std::int32_t*>(other.colours->data());
    for (std::size_t i = 0; i < PlaneSamples::kCount; i += hn::Lanes(d)) {
        const VF dx = hn::Load(d, samples.dx.data() + i), dy = hn::Load(d, samples.dy.data() + i);
        const VF q = hn::Add(hn::Add(hn::Set(d, plane.q), hn::Mul(hn::Set(d, plane.gx), dx)),
                             hn::Mul(hn::Set(d, plane.gy), dy));
        const auto before = hn::Gt(q, zero);
        const auto along = [&](int k) HWY_ATTR {
            return hn::Add(hn::Add(hn::Set(d, middle[k]), hn::Mul(dx, hn::Set(d, alongX[k]))),
                           hn::Mul(dy, hn::Set(d, alongY[k])));
        };
        const VF w = along(3);
        const VF inverse = hn::Div(one, w);
        const VF u = hn::Mul(along(0), inverse), v = hn::Mul(along(1), inverse),
                 there = hn::Mul(along(2), inverse);
        auto shows = hn::And(hn::And(before, hn::Gt(w, zero)),
                             hn::And(hn::And(hn::Ge(u, zero), hn::Ge(v, zero)),
                                     hn::And(hn::Lt(u, right), hn::Lt(v, bottom))));
        const VI column = hn::ConvertTo(di, hn::IfThenElseZero(shows, u)),
                 row = hn::ConvertTo(di, hn::IfThenElseZero(shows, v));
        const VF shown = hn::GatherIndex(d, other.q->data(), hn::Add(hn::Mul(row, pitch), column));
        const auto measured = hn::Gt(shown, zero);
        shows = hn::AndNot(
            hn::And(measured, hn::Gt(shown, hn::Mul(there, hn::Set(d, 1.0f + kSamePlaceThere)))),
            shows);
        const auto behind =
            hn::And(measured, hn::Lt(shown, hn::Mul(there, hn::Set(d, 1.0f - kSamePlaceThere))));

        const auto between = [&](VF at, VI last) HWY_ATTR {
            return hn::Min(hn::Max(hn::Sub(hn::IfThenElseZero(shows, at), half), zero),
                           hn::ConvertTo(d, last));
        };
        const VF px = between(u, lastX), py = between(v, lastY);
        const VI x0 = hn::ConvertTo(di, px), y0 = hn::ConvertTo(di, py);
        const VI x1 = hn::Min(hn::Add(x0, hn::Set(di, 1)), lastX);
        const VI y1 = hn::Min(hn::Add(y0, hn::Set(di, 1)), lastY);
        const VF tx = hn::Sub(px, hn::ConvertTo(d, x0)), ty = hn::Sub(py, hn::ConvertTo(d, y0));
        const VI row0 = hn::Mul(y0, pitch), row1 = hn::Mul(y1, pitch);
        const VI a = hn::GatherIndex(di, texels, hn::Add(row0, x0)),
                 b = hn::GatherIndex(di, texels, hn::Add(row0, x1)),
                 e = hn::GatherIndex(di, texels, hn::Add(row1, x0)),
                 f = hn::GatherIndex(di, texels, hn::Add(row1, x1));
        const auto apart = [&](const PlaneSamples::Floats& own, int number) HWY_ATTR {
            const VF c = mix(mix(channel(a, number), channel(b, number), tx),
                             mix(channel(e, number), channel(f, number), tx), ty);
            return hn::Abs(
                hn::Sub(hn::Load(d, own.data() + i), hn::Mul(c, hn::Set(d, 1.0f / 255.0f))));
        };
        const VF sum = hn::Add(hn::Add(apart(samples.red, 0), apart(samples.green, 1)),
                               apart(samples.blue, 2));
        const VF off = hn::Min(hn::Mul(sum, hn::Set(d, 1.0f / 3.0f)), most);
        const VF found =
            hn::IfThenElse(shows, hn::IfThenElse(behind, most, off), hn::Set(d, -1.0f));
        hn::Store(hn::IfThenElse(before, found, most), d, differences.data() + i);
    }
}

}  // namespace stx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx {

HWY_EXPORT(differencesImpl);

PlaneSamples::PlaneSamples() {
    for (std::size_t k = 0; k < kCount; ++k) {
        dx[k] = static_cast<float>((static_cast<int>(k) % kASide - kASide / 2) * kStep);
        dy[k] = static_cast<float>((static_cast<int>(k) / kASide - kASide / 2) * kStep);
    }
}

void differencesOn(const PixelPlane& plane, float x, float y, const PlaneSamples& samples,
                   const OtherView& other, PlaneSamples::Floats& differences) {
    HWY_DYNAMIC_DISPATCH(differencesImpl)(plane, x, y, samples, other, differences);
}

}  // namespace stx
#endif
