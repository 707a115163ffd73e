#include "lib/render/surface/view_normals.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/view_normals.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#ifndef STX_VIEW_NORMALS_ONCE
#define STX_VIEW_NORMALS_ONCE
namespace stx::surface {
/// Whether the four pixels from (x, y) on lie in a view, and a value more behind the last of them.
inline bool holds(const ViewNormals& view, float x, float y) {
    return view.normals && x >= 0 && y >= 0 && x < static_cast<float>(view.width - 1) &&
           y < static_cast<float>(view.height - 1) &&
           (x < static_cast<float>(view.width - 2) || y < static_cast<float>(view.height - 2));
}
}  // namespace stx::surface
#endif

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using VF = hn::Vec<DF>;

/// In the order of operations of SurfaceRenderer::normalAt(), so that both give the same bits. The
/// four pixels are read one by one: gathering them takes longer.
bool normalsImpl(std::span<const glm::vec3> origins, std::span<const ViewNormals> views,
                 glm::vec3* normals) {
    const DF d;
    constexpr std::size_t kLanes = hn::MaxLanes(d);
    const std::size_t lanes = hn::Lanes(d);
    const VF one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f);
    bool all = true;
    HWY_ALIGN float x[kLanes], y[kLanes], weights[4][kLanes], sums[4 * kLanes];
    float first[3 * kLanes], last[3 * kLanes];
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
        u = hn::Sub(u, half);
        v = hn::Sub(v, half);
        const VF left = hn::Floor(u), top = hn::Floor(v);
        const VF tu = hn::Sub(u, left), tv = hn::Sub(v, top);
        const VF su = hn::Sub(one, tu), sv = hn::Sub(one, tv);
        hn::Store(left, d, x);
        hn::Store(top, d, y);
        hn::Store(hn::Mul(su, sv), d, weights[0]);
        hn::Store(hn::Mul(tu, sv), d, weights[1]);
        hn::Store(hn::Mul(su, tv), d, weights[2]);
        hn::Store(hn::Mul(tu, tv), d, weights[3]);
        for (std::size_t k = 0; k < lanes; ++k) {
            float sum[4] = {};
            if (const float which = from[3 * k]; which >= 0) {
                const ViewNormals& view = views[static_cast<std::size_t>(which)];
                if (holds(view, x[k], y[k])) {
                    const float* n = &view.normals[static_cast<std::ptrdiff_t>(y[k]) * view.width +
                                                   static_cast<std::ptrdiff_t>(x[k])]
                                          .x;
                    const float* below = n + 3 * static_cast<std::ptrdiff_t>(view.width);
                    // One value more than there are, so that each is a vector.
                    const auto add = [&](std::size_t w, const float* at) HWY_ATTR {
                        for (std::size_t c = 0; c < 4; ++c) sum[c] += weights[w][k] * at[c];
                    };
                    add(0, n);
                    add(1, n + 3);
                    add(2, below);
                    add(3, below + 3);
                } else {
                    all = false;
                }
            }
            std::copy_n(sum, 4, sums + 4 * k);
        }
        VF a, b, c, beyond;
        hn::LoadInterleaved4(d, sums, a, b, c, beyond);
        const VF length = hn::Sqrt(hn::Add(hn::Add(hn::Mul(a, a), hn::Mul(b, b)), hn::Mul(c, c)));
        const auto has = hn::Gt(length, hn::Set(d, 1e-6f));
        hn::StoreInterleaved3(hn::IfThenElseZero(has, hn::Div(a, length)),
                              hn::IfThenElseZero(has, hn::Div(b, length)),
                              hn::IfThenElseZero(has, hn::Div(c, length)), d, to);
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
    return holds(view, std::floor(u - 0.5f), std::floor(v - 0.5f));
}

}  // namespace stx::surface
#endif
