#include "lib/base/paeth.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/base/paeth.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace stx::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<std::uint8_t>;
using V = hn::Vec<D>;

HWY_INLINE V distanceOf(V a, V b) {
    return hn::Sub(hn::Max(a, b), hn::Min(a, b));
}

HWY_INLINE hn::Mask<D> isUpTo(V a, V b) {
    return hn::Eq(hn::Min(a, b), a);
}

/// In eight bits: left + above - 2 * corner is the sum of two differences, so its size is the sum
/// of their sizes where they have one sign (more than 255 is never the least), else the difference.
HWY_INLINE V expectedOf(V left, V above, V corner) {
    const V toLeft = distanceOf(above, corner), toAbove = distanceOf(left, corner);
    const auto apart = hn::Xor(isUpTo(left, corner), isUpTo(above, corner));
    const V toCorner =
        hn::IfThenElse(apart, distanceOf(toLeft, toAbove), hn::SaturatedAdd(toLeft, toAbove));
    const auto isLeft = hn::And(isUpTo(toLeft, toAbove), isUpTo(toLeft, toCorner));
    return hn::IfThenElse(isLeft, left, hn::IfThenElse(isUpTo(toAbove, toCorner), above, corner));
}

void paethImpl(const std::uint8_t* row, const std::uint8_t* above, std::size_t size,
               std::size_t step, std::uint8_t* out) {
    const D d;
    const std::size_t lanes = hn::Lanes(d);
    const auto at = [&](const std::uint8_t* x, const std::uint8_t* left, const std::uint8_t* up,
                        const std::uint8_t* corner, std::uint8_t* to) HWY_ATTR {
        const V expected = expectedOf(hn::LoadU(d, left), hn::LoadU(d, up), hn::LoadU(d, corner));
        hn::StoreU(hn::Sub(hn::LoadU(d, x), expected), d, to);
    };
    std::size_t i = 0;
    for (; i + lanes <= size; i += lanes)
        at(row + i, row + i - step, above + i, above + i - step, out + i);
    if (i == size) return;
    std::uint8_t last[5][hn::MaxLanes(d)] = {};
    const std::size_t left = size - i;
    std::copy_n(row + i, left, last[0]);
    std::copy_n(row + i - step, left, last[1]);
    std::copy_n(above + i, left, last[2]);
    std::copy_n(above + i - step, left, last[3]);
    at(last[0], last[1], last[2], last[3], last[4]);
    std::copy_n(last[4], left, out + i);
}

}  // namespace stx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace stx {

HWY_EXPORT(paethImpl);

void subtractPaeth(const std::uint8_t* row, const std::uint8_t* above, std::size_t size,
                   std::size_t step, std::uint8_t* out) {
    HWY_DYNAMIC_DISPATCH(paethImpl)(row, above, size, step, out);
}

}  // namespace stx
#endif
