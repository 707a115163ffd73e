#include "lib/render/surface/fill/fill_rays.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/fill/fill_rays.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <cmath>
#include <utility>

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using DByte = hn::Rebind<std::uint8_t, DF>;

/// The rays of a batch in one direction, `rays.length` long at first, go on until all met surface
/// or left the picture. Those that did wait at surface, from where no distance takes them on.
void walkImpl(const RayBatch::Start& start, glm::vec2 direction, RayBatch::Rays& rays) {
    const DF df;
    const DI di;
    const DByte db;
    const std::size_t lanes = hn::Lanes(df);
    const auto zero = hn::Zero(df), one = hn::Set(df, 1.0f);
    const auto dx = hn::Set(df, direction.x), dy = hn::Set(df, direction.y);
    const auto width = hn::Set(df, start.width), height = hn::Set(df, start.height);
    const auto longest = hn::Set(df, kLongestRay), tooLong = hn::Set(df, 2 * kLongestRay);
    const auto stride = hn::Set(di, static_cast<std::int32_t>(start.width));
    const auto surface = hn::Set(di, start.surface), none = hn::Set(di, RayBatch::kNone);
    // The pixels that are so far along, kNone where rays left the picture or are too long.
    const auto pixelsAt = [&](std::size_t i, auto along) HWY_ATTR {
        const auto x = hn::Add(hn::LoadU(df, &start.x[i]), hn::Mul(dx, along));
        const auto y = hn::Add(hn::LoadU(df, &start.y[i]), hn::Mul(dy, along));
        const auto in =
            hn::And(hn::And(hn::And(hn::Ge(x, zero), hn::Ge(y, zero)), hn::Le(along, longest)),
                    hn::And(hn::Lt(x, width), hn::Lt(y, height)));
        const auto pixel = hn::Add(hn::Mul(hn::ConvertTo(di, y), stride), hn::ConvertTo(di, x));
        return hn::IfThenElse(hn::RebindMask(di, in), pixel, none);
    };
    alignas(64) std::array<std::int32_t, kRayBatch> places;
    alignas(64) std::array<std::uint8_t, kRayBatch> distances;
    // Where the vectors begin that have rays which go on.
    std::array<std::size_t, kRayBatch> going;
    std::size_t count = 0;
    for (std::size_t i = 0; i < kRayBatch; i += lanes) going[count++] = i;
    while (count > 0) {
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t i = going[k];
            const auto along = hn::LoadU(df, &rays.length[i]);
            const auto pixels = pixelsAt(i, along);
            const auto out = hn::Eq(pixels, none);
            hn::StoreU(hn::IfThenElse(hn::RebindMask(df, out), tooLong, along), df,
                       &rays.length[i]);
            hn::Store(hn::IfThenElse(out, surface, pixels), di, &places[i]);
        }
        for (std::size_t k = 0; k < count; ++k)
            for (std::size_t i = going[k]; i < going[k] + lanes; ++i)
                distances[i] = start.distances[places[i]];
        const std::size_t before = std::exchange(count, 0);
        for (std::size_t k = 0; k < before; ++k) {
            const std::size_t i = going[k];
            const auto distance = hn::PromoteTo(di, hn::Load(db, &distances[i]));
            if (hn::AllTrue(di, hn::Eq(distance, hn::Zero(di)))) continue;
            hn::StoreU(hn::Add(hn::LoadU(df, &rays.length[i]), hn::ConvertTo(df, distance)), df,
                       &rays.length[i]);
            going[count++] = i;
        }
    }
    for (std::size_t i = 0; i < kRayBatch; i += lanes) {
        const auto along = hn::LoadU(df, &rays.length[i]);
        hn::StoreU(pixelsAt(i, along), di, &rays.rim[i]);
        hn::StoreU(pixelsAt(i, hn::Add(along, one)), di, &rays.behind[i]);
    }
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx::surface {
namespace {

HWY_EXPORT(walkImpl);

const std::array<glm::vec2, kRays>& rayDirections() {
    static const auto rays = [] {
        std::array<glm::vec2, kRays> directions;
        for (int k = 0; k < kRays; ++k) {
            const float angle = static_cast<float>(k) * (6.2831853f / kRays);
            directions[static_cast<std::size_t>(k)] = {std::cos(angle), std::sin(angle)};
        }
        return directions;
    }();
    return rays;
}

}  // namespace

RayBatch::RayBatch(const Image<std::uint8_t>& distances, std::int32_t surface)
    : start_{distances.data(), static_cast<float>(distances.width()),
             static_cast<float>(distances.height()), surface} {}

void RayBatch::add(int x, int y, int distance) {
    start_.x[count_] = static_cast<float>(x) + 0.5f;
    start_.y[count_] = static_cast<float>(y) + 0.5f;
    first_[count_] = static_cast<float>(distance);
    ++count_;
}

void RayBatch::walk() {
    // Places that are not used wait as rays do that are done.
    for (std::size_t i = count_; i < kRayBatch; ++i) first_[i] = 2 * kLongestRay;
    for (std::size_t k = 0; k < kRays; ++k) {
        rays_[k].length = first_;
        HWY_DYNAMIC_DISPATCH(walkImpl)(start_, rayDirections()[k], rays_[k]);
    }
}

}  // namespace stx::surface
#endif
