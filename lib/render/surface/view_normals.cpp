#include "lib/render/surface/view_normals.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/view_normals.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using MF = hn::Mask<DF>;

/// A vector for each of x, y and z.
struct Three {
    VF x, y, z;
};

HWY_INLINE Three gathered(const float* normals, VI at) {
    const DF d;
    return {hn::GatherIndex(d, normals, at), hn::GatherIndex(d, normals + 1, at),
            hn::GatherIndex(d, normals + 2, at)};
}

HWY_INLINE void addWeighted(Three& sum, VF weight, const Three& n) {
    sum.x = hn::Add(sum.x, hn::Mul(weight, n.x));
    sum.y = hn::Add(sum.y, hn::Mul(weight, n.y));
    sum.z = hn::Add(sum.z, hn::Mul(weight, n.z));
}

/// In the order of operations of SurfaceRenderer::normalAt(), so that both give the same bits. `x`
/// and `y` are the first of the four pixels; lanes outside of `in` get anything.
HWY_INLINE Three between(const ViewNormals& view, MF in, VF u, VF v, VF x, VF y) {
    const DF d;
    const DI di;
    const VF one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    const VI column = hn::ConvertTo(di, hn::IfThenElse(in, x, zero));
    const VI row = hn::ConvertTo(di, hn::IfThenElse(in, y, zero));
    const VI pixel = hn::Add(hn::Mul(row, hn::Set(di, view.width)), column);
    const VI at = hn::Add(hn::Add(pixel, pixel), pixel);
    const VF tu = hn::Sub(u, x), tv = hn::Sub(v, y);
    const VF su = hn::Sub(one, tu), sv = hn::Sub(one, tv);
    const float* first = &view.normals->x;
    const float* below = first + 3 * static_cast<std::ptrdiff_t>(view.width);
    Three sum{zero, zero, zero};
    addWeighted(sum, hn::Mul(su, sv), gathered(first, at));
    addWeighted(sum, hn::Mul(tu, sv), gathered(first + 3, at));
    addWeighted(sum, hn::Mul(su, tv), gathered(below, at));
    addWeighted(sum, hn::Mul(tu, tv), gathered(below + 3, at));
    const VF length = hn::Sqrt(
        hn::Add(hn::Add(hn::Mul(sum.x, sum.x), hn::Mul(sum.y, sum.y)), hn::Mul(sum.z, sum.z)));
    const MF has = hn::Gt(length, hn::Set(d, 1e-6f));
    return {hn::IfThenElseZero(has, hn::Div(sum.x, length)),
            hn::IfThenElseZero(has, hn::Div(sum.y, length)),
            hn::IfThenElseZero(has, hn::Div(sum.z, length))};
}

bool normalsImpl(std::span<const glm::vec3> origins, std::span<const ViewNormals> views,
                 glm::vec3* normals) {
    const DF d;
    const std::size_t lanes = hn::Lanes(d);
    bool all = true;
    float first[3 * hn::MaxLanes(d)], last[3 * hn::MaxLanes(d)];
    for (std::size_t i = 0; i < origins.size(); i += lanes) {
        const float* from = &origins[i].x;
        float* to = &normals[i].x;
        const std::size_t count = std::min(lanes, origins.size() - i);
        if (count < lanes) {
            for (std::size_t k = 0; k < 3 * lanes; ++k) first[k] = k < 3 * count ? from[k] : -1.0f;
            from = first;
            to = last;
        }
        VF number, u, v;
        hn::LoadInterleaved3(d, from, number, u, v);
        u = hn::Sub(u, hn::Set(d, 0.5f));
        v = hn::Sub(v, hn::Set(d, 0.5f));
        const VF x = hn::Floor(u), y = hn::Floor(v);
        const VF none = hn::Zero(d);
        Three out{none, none, none};
        MF open = hn::Ge(number, none);
        while (!hn::AllFalse(d, open)) {
            const auto lane = static_cast<std::size_t>(hn::FindFirstTrue(d, open));
            const float which = from[3 * lane];
            const ViewNormals& view = views[static_cast<std::size_t>(which)];
            const MF same = hn::And(open, hn::Eq(number, hn::Set(d, which)));
            open = hn::AndNot(same, open);
            if (!view.normals) {
                all = false;
                continue;
            }
            const VF right = hn::Set(d, static_cast<float>(view.width - 1));
            const VF bottom = hn::Set(d, static_cast<float>(view.height - 1));
            const MF in = hn::And(same, hn::And(hn::And(hn::Ge(x, none), hn::Lt(x, right)),
                                                hn::And(hn::Ge(y, none), hn::Lt(y, bottom))));
            if (!hn::AllFalse(d, hn::AndNot(in, same))) all = false;
            const Three found = between(view, in, u, v, x, y);
            out = {hn::IfThenElse(in, found.x, out.x), hn::IfThenElse(in, found.y, out.y),
                   hn::IfThenElse(in, found.z, out.z)};
        }
        hn::StoreInterleaved3(out.x, out.y, out.z, d, to);
        if (count < lanes) std::copy_n(last, 3 * count, &normals[i].x);
    }
    return all;
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::surface {

HWY_EXPORT(normalsImpl);

bool normalsBetween(std::span<const glm::vec3> origins, std::span<const ViewNormals> views,
                    glm::vec3* normals) {
    return HWY_DYNAMIC_DISPATCH(normalsImpl)(origins, views, normals);
}

bool isBetween(const ViewNormals& view, float u, float v) {
    const float x = std::floor(u - 0.5f), y = std::floor(v - 0.5f);
    return view.normals && x >= 0 && y >= 0 && x < static_cast<float>(view.width - 1) &&
           y < static_cast<float>(view.height - 1);
}

}  // namespace stx::surface
#endif
