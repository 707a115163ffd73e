#include "lib/model/depth_values.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/model/depth_values.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <vector>

HWY_BEFORE_NAMESPACE();
namespace stx::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using DD = hn::RepartitionToWide<DF>;
using DI = hn::RebindToSigned<DF>;

void depthSummaryImpl(std::span<const float> distances, DepthSummary& summary) {
    const DF d;
    const DI di;
    // So many that 32 bits hold what each lane counts.
    constexpr std::size_t kPiece = std::size_t{1} << 24;
    const std::size_t lanes = hn::Lanes(d);
    const auto none = hn::Set(d, kNoDepth), zero = hn::Zero(d);
    auto nearest = none, farthest = hn::Neg(none);
    auto wrong = hn::Lt(zero, zero);  // none
    std::size_t i = 0;
    while (i + lanes <= distances.size()) {
        const std::size_t end = std::min(distances.size() - lanes + 1, i + kPiece);
        auto missing = hn::Zero(di);
        std::size_t seen = 0;
        for (; i < end; i += lanes, seen += lanes) {
            const auto v = hn::LoadU(d, distances.data() + i);
            const auto point = hn::Lt(v, none);
            // A mask is -1 in each of its lanes.
            missing = hn::Add(missing, hn::BitCast(di, hn::VecFromMask(d, hn::Not(point))));
            nearest = hn::Min(nearest, hn::IfThenElse(point, v, none));
            farthest = hn::Max(farthest, hn::IfThenElse(point, v, hn::Neg(none)));
            wrong = hn::Or(wrong, hn::Not(hn::Ge(v, zero)));
        }
        std::int32_t each[hn::MaxLanes(DI())];
        hn::StoreU(missing, di, each);
        summary.points += static_cast<std::int64_t>(seen);
        for (std::size_t k = 0; k < lanes; ++k) summary.points += each[k];
    }
    summary.nearest = hn::GetLane(hn::MinOfLanes(d, nearest));
    summary.farthest = hn::GetLane(hn::MaxOfLanes(d, farthest));
    summary.wrong = !hn::AllFalse(d, wrong);
    for (; i < distances.size(); ++i) {
        const float v = distances[i];
        summary.wrong = summary.wrong || !(v >= 0);
        if (!hasPoint(v)) continue;
        ++summary.points;
        summary.nearest = std::min(summary.nearest, v);
        summary.farthest = std::max(summary.farthest, v);
    }
}

using VD = hn::Vec<DD>;

/// As many points or directions as a vector has lanes.
struct Points {
    VD x, y, z;
};

HWY_INLINE Points cross(const Points& a, const Points& b) {
    return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(b.y, a.z)),
            hn::Sub(hn::Mul(a.z, b.x), hn::Mul(b.z, a.x)),
            hn::Sub(hn::Mul(a.x, b.y), hn::Mul(b.x, a.y))};
}

/// The operations of ReferenceView::worldPoint(), in its order.
struct ToWorld {
    Points axis, eye;
    VD angle;

    explicit ToWorld(const Camera& c)
        : axis{hn::Set(DD(), c.orientation.x), hn::Set(DD(), c.orientation.y),
               hn::Set(DD(), c.orientation.z)},
          eye{hn::Set(DD(), c.position.x), hn::Set(DD(), c.position.y),
              hn::Set(DD(), c.position.z)},
          angle(hn::Set(DD(), c.orientation.w)) {}

    HWY_INLINE Points operator()(const Points& p) const {
        const Points once = cross(axis, p), twice = cross(axis, once);
        const auto turned = [&](VD eyeAt, VD at, VD first, VD second) HWY_ATTR {
            const VD both = hn::Add(hn::Mul(first, angle), second);
            return hn::Add(eyeAt, hn::Add(at, hn::Mul(both, hn::Set(DD(), 2.0))));
        };
        return {turned(eye.x, p.x, once.x, twice.x), turned(eye.y, p.y, once.y, twice.y),
                turned(eye.z, p.z, once.z, twice.z)};
    }
};

/// `columns`: what unproject() gives along x at distance 1, for each pixel of a row and as many
/// more as fill a vector.
void boundsImpl(const Image<float>& distances, const Camera& camera, const double* columns,
                Bounds& bounds) {
    const DD d;
    const hn::Rebind<float, DD> df;
    const std::size_t lanes = hn::Lanes(d);
    const auto width = static_cast<std::size_t>(distances.width());
    const ToWorld toWorld(camera);
    const VD one = hn::Set(d, 1.0), none = hn::Set(d, static_cast<double>(kNoDepth));
    Points least{none, none, none}, most{hn::Neg(none), hn::Neg(none), hn::Neg(none)};
    for (int y = 0; y < distances.height(); ++y) {
        const float* row = distances.row(y).data();
        const VD down = hn::Set(d, -(y + 0.5 - camera.cy) / camera.fy);
        const auto add = [&](const float* from, std::size_t x) HWY_ATTR {
            const VD dist = hn::PromoteTo(d, hn::LoadU(df, from));
            const auto point = hn::Lt(dist, none);
            const VD scale = camera.orthographic ? one : dist;
            const Points p = toWorld(
                {hn::Mul(hn::LoadU(d, columns + x), scale), hn::Mul(down, scale), hn::Neg(dist)});
            const auto widen = [&](VD at, VD& low, VD& high) HWY_ATTR {
                low = hn::Min(low, hn::IfThenElse(point, at, none));
                high = hn::Max(high, hn::IfThenElse(point, at, hn::Neg(none)));
            };
            widen(p.x, least.x, most.x);
            widen(p.y, least.y, most.y);
            widen(p.z, least.z, most.z);
        };
        std::size_t x = 0;
        for (; x + lanes <= width; x += lanes) add(row + x, x);
        if (x == width) continue;
        float last[hn::MaxLanes(DD())];
        std::fill_n(last, lanes, kNoDepth);
        std::copy(row + x, row + width, last);
        add(last, x);
    }
    const auto lowest = [&](VD v) HWY_ATTR { return hn::GetLane(hn::MinOfLanes(d, v)); };
    const auto highest = [&](VD v) HWY_ATTR { return hn::GetLane(hn::MaxOfLanes(d, v)); };
    bounds.min = {lowest(least.x), lowest(least.y), lowest(least.z)};
    bounds.max = {highest(most.x), highest(most.y), highest(most.z)};
}

std::size_t lanesOfBounds() {
    return hn::Lanes(DD());
}

}  // namespace stx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx {

HWY_EXPORT(depthSummaryImpl);
HWY_EXPORT(boundsImpl);
HWY_EXPORT(lanesOfBounds);

DepthSummary summariseDepth(std::span<const float> distances) {
    DepthSummary summary;
    HWY_DYNAMIC_DISPATCH(depthSummaryImpl)(distances, summary);
    return summary;
}

Bounds boundsTogether(std::span<const Bounds> each) {
    Bounds all;
    for (const Bounds& one : each) {
        if (one.empty()) continue;
        all.add(one.min);
        all.add(one.max);
    }
    return all;
}

Bounds boundsOfPoints(const Image<float>& distances, const Camera& camera) {
    const std::size_t beyond = HWY_DYNAMIC_DISPATCH(lanesOfBounds)();
    std::vector<double> columns(static_cast<std::size_t>(distances.width()) + beyond);
    for (int x = 0; x < distances.width(); ++x) columns[x] = (x + 0.5 - camera.cx) / camera.fx;
    Bounds bounds;
    HWY_DYNAMIC_DISPATCH(boundsImpl)(distances, camera, columns.data(), bounds);
    return bounds;
}

void roundToCode(std::span<float> distances, const DepthCode& code) {
    for (float& distance : distances)
        if (hasPoint(distance)) distance = static_cast<float>(code.decode(code.encode(distance)));
}

}  // namespace stx
#endif
