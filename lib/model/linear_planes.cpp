#include "lib/model/linear_planes.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/model/linear_planes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include "lib/model/srgb8.hpp"
#include "lib/model/texture.hpp"

#ifndef STX_LINEAR_PLANES_ONCE
#define STX_LINEAR_PLANES_ONCE
namespace stx {
/// The coded value of one channel, 0 or more.
inline float linearOfAny(float coded, const LinearTable& table) {
    return coded > 1.0f ? linearFromSrgb(coded) : table.linear(coded);
}

inline glm::vec4 linearPixel(glm::vec4 p, const LinearTable& table) {
    if (!(p.a > 0.0f)) return p;
    // Divided first: the curve and the alpha do not commute.
    const glm::vec3 c = glm::vec3(p) / p.a;
    return {
        glm::vec3(linearOfAny(c.r, table), linearOfAny(c.g, table), linearOfAny(c.b, table)) * p.a,
        p.a};
}
}  // namespace stx
#endif

HWY_BEFORE_NAMESPACE();
namespace stx::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;

/// LinearTable::linear() of values up to 1.
HWY_INLINE VF linearOf(VF coded, const LinearTable& table) {
    const DF d;
    const DI di;
    const VF s = hn::Mul(hn::Min(coded, hn::Set(d, 1.0f)), hn::Set(d, LinearTable::kSteps));
    const auto i =
        hn::Max(hn::Min(hn::ConvertTo(di, s), hn::Set(di, LinearTable::kSteps - 1)), hn::Zero(di));
    const VF at = hn::GatherIndex(d, table.values(), i),
             next = hn::GatherIndex(d, table.values() + 1, i);
    const VF value = hn::Add(at, hn::Mul(hn::Sub(next, at), hn::Sub(s, hn::ConvertTo(d, i))));
    return hn::IfThenElseZero(hn::Gt(coded, hn::Zero(d)), value);
}

void planesImpl(const glm::vec4* pixels, std::size_t count, const std::array<float*, 4>& planes,
                const LinearTable& table) {
    const DF d;
    const std::size_t lanes = hn::Lanes(d);
    const VF one = hn::Set(d, 1.0f);
    std::size_t i = 0;
    const auto plain = [&](std::size_t end) {
        for (; i < end; ++i) {
            const glm::vec4 p = linearPixel(pixels[i], table);
            for (int c = 0; c < 4; ++c) planes[c][i] = p[c];
        }
    };
    while (i + lanes <= count) {
        VF r = one, g = one, b = one, a = one;
        hn::LoadInterleaved4(d, &pixels[i].x, r, g, b, a);
        const auto covered = hn::Gt(a, hn::Zero(d));
        const VF red = hn::Div(r, a), green = hn::Div(g, a), blue = hn::Div(b, a);
        const auto bright = hn::Or(hn::Gt(red, one), hn::Or(hn::Gt(green, one), hn::Gt(blue, one)));
        if (!hn::AllFalse(d, hn::And(covered, bright))) {
            plain(i + lanes);
            continue;
        }
        hn::StoreU(hn::IfThenElse(covered, hn::Mul(linearOf(red, table), a), r), d, planes[0] + i);
        hn::StoreU(hn::IfThenElse(covered, hn::Mul(linearOf(green, table), a), g), d,
                   planes[1] + i);
        hn::StoreU(hn::IfThenElse(covered, hn::Mul(linearOf(blue, table), a), b), d, planes[2] + i);
        hn::StoreU(a, d, planes[3] + i);
        i += lanes;
    }
    plain(count);
}

}  // namespace stx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx {

HWY_EXPORT(planesImpl);

void linearPlanes(const glm::vec4* pixels, std::size_t count, const std::array<float*, 4>& planes) {
    HWY_DYNAMIC_DISPATCH(planesImpl)(pixels, count, planes, linearTable());
}

}  // namespace stx
#endif
