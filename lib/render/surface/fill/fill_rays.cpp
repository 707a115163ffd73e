#include "lib/render/surface/fill/fill_rays.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/render/surface/fill/fill_rays.cpp"
#include <hwy/foreach_target.h>  // NOLINT: must come before highway.h
#include <hwy/highway.h>

#include <bit>
#include <cmath>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace stx::surface::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;

/// The rays of a batch in one direction, `rays.length` long at first, go on until each met surface
/// or left the picture. Rays beside each other go together: they are about as long.
void walkRaysImpl(const RayBatch::Start& start, glm::vec2 direction, std::size_t count,
                  RayBatch::Rays& rays) {
    const DF d;
    const DI di;
    const VF dx = hn::Set(d, direction.x), dy = hn::Set(d, direction.y), zero = hn::Zero(d);
    const VF width = hn::Set(d, start.width), height = hn::Set(d, start.height);
    const VF longest = hn::Set(d, kLongestRay);
    const VI stride = hn::Set(di, static_cast<std::int32_t>(start.width));
    const VI none = hn::Set(di, RayBatch::kNone);
    for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
        const VF x0 = hn::LoadU(d, &start.x[i]), y0 = hn::LoadU(d, &start.y[i]);
        // The pixels at this distance along the rays, kNone where rays left the picture or are too
        // long.
        const auto pixelsAt = [&](VF along) HWY_ATTR {
            const VF x = hn::Add(x0, hn::Mul(dx, along)), y = hn::Add(y0, hn::Mul(dy, along));
            const auto in =
                hn::And(hn::And(hn::And(hn::Ge(x, zero), hn::Ge(y, zero)), hn::Le(along, longest)),
                        hn::And(hn::Lt(x, width), hn::Lt(y, height)));
            const VI pixel = hn::Add(hn::Mul(hn::ConvertTo(di, y), stride), hn::ConvertTo(di, x));
            return hn::IfThenElse(hn::RebindMask(di, in), pixel, none);
        };
        VF along = hn::LoadU(d, &rays.length[i]);
        VI rim;
        while (true) {
            rim = pixelsAt(along);
            const auto in = hn::Gt(rim, none);
            const VI word = hn::GatherIndex(di, start.distances,
                                            hn::IfThenElseZero(in, hn::ShiftRight<2>(rim)));
            const VI shift = hn::ShiftLeft<3>(hn::And(rim, hn::Set(di, 3)));
            const VI distance = hn::And(hn::Shr(word, shift), hn::Set(di, 0xff));
            const auto goes = hn::And(in, hn::Gt(distance, hn::Zero(di)));
            if (hn::AllFalse(di, goes)) break;
            along = hn::Add(along, hn::ConvertTo(d, hn::IfThenElseZero(goes, distance)));
        }
        const auto met = hn::RebindMask(d, hn::Gt(rim, none));
        along = hn::IfThenElse(met, along, hn::Set(d, 2 * kLongestRay));
        hn::StoreU(along, d, &rays.length[i]);
        hn::StoreU(rim, di, &rays.rim[i]);
        hn::StoreU(pixelsAt(hn::Add(along, hn::Set(d, 1.0f))), di, &rays.behind[i]);
    }
    static_assert(kRayBatch % hn::MaxLanes(DF()) == 0, "vectors end with the batch");
}

}  // namespace stx::surface::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace stx::surface {
namespace {

HWY_EXPORT(walkRaysImpl);

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

DistanceWords::DistanceWords(const Image<std::uint8_t>& distances)
    : width(static_cast<float>(distances.width())), height(static_cast<float>(distances.height())) {
    static_assert(std::endian::native == std::endian::little, "the first pixel is the lowest");
    words.resize(distances.count() / 4 + 1);
    std::memcpy(words.data(), distances.data(), distances.count());
}

RayBatch::RayBatch(const DistanceWords& distances)
    : start_{distances.words.data(), distances.width, distances.height} {}

void RayBatch::add(int x, int y, int distance) {
    start_.x[count_] = static_cast<float>(x) + 0.5f;
    start_.y[count_] = static_cast<float>(y) + 0.5f;
    first_[count_] = static_cast<float>(distance);
    ++count_;
}

void RayBatch::walk() {
    for (std::size_t k = 0; k < kRays; ++k) {
        rays_[k].length = first_;
        HWY_DYNAMIC_DISPATCH(walkRaysImpl)(start_, rayDirections()[k], count_, rays_[k]);
    }
}

}  // namespace stx::surface

#endif
