// Rows of small splats that are opaque, of 8-bit colours: a vector of points at once. Included by
// kernels.cpp once for each SIMD target.

#if defined(STX_SPLAT_ROWS_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_SPLAT_ROWS_INL_HPP
#undef STX_SPLAT_ROWS_INL_HPP
#else
#define STX_SPLAT_ROWS_INL_HPP
#endif

#include <hwy/highway.h>

#include "lib/render/splat/cpu/accumulate-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::splat::HWY_NAMESPACE {

// What some neighbouring points add to: weights of their 2x2 pixels (0: none), how far they lie
// into the next, and how their colours go on.
struct RowOfPoints {
    VF w00, w10, w01, w11;
    VF fx, fy;
    VF uAcross, vAcross, uDown, vDown;
    const std::int32_t* offset;
    bool gradient;  // some colours go on
};

#if HWY_TARGET == HWY_SCALAR || HWY_HAVE_SCALABLE || HWY_MAX_BYTES < 32

constexpr bool kWholeRows = false;
HWY_INLINE void addRowOfPoints(const RectangleImages&, std::size_t, std::uint32_t,
                               const RowOfPoints&, const Region&) {}
HWY_INLINE void addNormalsOfRow(const RectangleImages&, std::size_t, std::uint32_t,
                                const RowOfPoints&, const Region&) {}

#else

constexpr bool kWholeRows = true;
using DB = hn::Repartition<std::uint8_t, DF>;
using VB = hn::Vec<DB>;

// Of each block of 16 bytes, four RGBA values, value kValue as whole numbers.
template <int kValue>
HWY_INLINE VI valueOf(VB bytes) {
    constexpr std::uint8_t kNone = 0x80, kFirst = 4 * kValue;
    alignas(16) static constexpr std::uint8_t kIndex[16] = {
        kFirst,     kNone, kNone, kNone, kFirst + 1, kNone, kNone, kNone,
        kFirst + 2, kNone, kNone, kNone, kFirst + 3, kNone, kNone, kNone};
    return hn::BitCast(DI(), hn::TableLookupBytesOr0(bytes, hn::LoadDup128(DB(), kIndex)));
}

// Adds to two pixels side by side of each of the points kPoint, kPoint + 4, ...: a block of four
// values each.
template <int kPoint>
HWY_INLINE void addPairs(float* sums, const std::int32_t* offset, VF left, VF right) {
    const hn::FixedTag<float, 8> d8;
    const auto add = [&](int point, hn::Vec<hn::FixedTag<float, 8> > pair) HWY_ATTR {
        float* to = sums + 4 * static_cast<std::ptrdiff_t>(offset[point]);
        hn::StoreU(hn::Add(hn::LoadU(d8, to), pair), d8, to);
    };
    const VF even = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(right), left);
    const VF odd = hn::OddEvenBlocks(right, hn::SwapAdjacentBlocks(left));
#if HWY_MAX_BYTES >= 64
    add(kPoint, hn::LowerHalf(d8, even));
    add(kPoint + 4, hn::LowerHalf(d8, odd));
    add(kPoint + 8, hn::UpperHalf(d8, even));
    add(kPoint + 12, hn::UpperHalf(d8, odd));
#else
    add(kPoint, even);
    add(kPoint + 4, odd);
#endif
}

// Adds those of the points whose `bits` are set, and zeros for others of their block.
HWY_INLINE void addRowOfPoints(const RectangleImages& s, std::size_t pixel, std::uint32_t bits,
                               const RowOfPoints& r, const Region& region) {
    const DF d;
    const DB db;
    const std::size_t row = static_cast<std::size_t>(s.stride);
    const std::uint8_t* at = s.rgba8 + 4 * pixel;
    const VB here = hn::LoadU(db, at);
    const VB left = hn::LoadU(db, at - 4), right = hn::LoadU(db, at + 4);
    const VB above = hn::LoadU(db, at - 4 * row), below = hn::LoadU(db, at + 4 * row);
    float* lower = region.colour + 4 * static_cast<std::ptrdiff_t>(region.stride);
    // Points four apart do not share pixels, mostly: a load that meets parts of stores still under
    // way waits for them.
    const auto group = [&](auto number) HWY_ATTR {
        constexpr int kPoint = decltype(number)::value;
        if (!(bits & (0x1111u << kPoint))) return;
        const VF fx = hn::Broadcast<kPoint>(r.fx), fy = hn::Broadcast<kPoint>(r.fy);
        VF c00 = hn::ConvertTo(d, valueOf<kPoint>(here));
        VF across = hn::Zero(d), down = across;
        if (r.gradient) {
            const VF u = hn::ConvertTo(d, hn::Sub(valueOf<kPoint>(right), valueOf<kPoint>(left)));
            const VF v = hn::ConvertTo(d, hn::Sub(valueOf<kPoint>(below), valueOf<kPoint>(above)));
            across = hn::MulAdd(v, hn::Broadcast<kPoint>(r.vAcross),
                                hn::Mul(u, hn::Broadcast<kPoint>(r.uAcross)));
            down = hn::MulAdd(v, hn::Broadcast<kPoint>(r.vDown),
                              hn::Mul(u, hn::Broadcast<kPoint>(r.uDown)));
            c00 = hn::NegMulAdd(fy, down, hn::NegMulAdd(fx, across, c00));
        }
        const VF c01 = hn::Add(c00, down);
        addPairs<kPoint>(region.colour, r.offset, hn::Mul(hn::Broadcast<kPoint>(r.w00), c00),
                         hn::Mul(hn::Broadcast<kPoint>(r.w10), hn::Add(c00, across)));
        addPairs<kPoint>(lower, r.offset, hn::Mul(hn::Broadcast<kPoint>(r.w01), c01),
                         hn::Mul(hn::Broadcast<kPoint>(r.w11), hn::Add(c01, across)));
    };
    group(std::integral_constant<int, 0>());
    group(std::integral_constant<int, 1>());
    group(std::integral_constant<int, 2>());
    group(std::integral_constant<int, 3>());
}

// The same for their normals; a splat has one normal.
HWY_INLINE void addNormalsOfRow(const RectangleImages& s, std::size_t pixel, std::uint32_t bits,
                                const RowOfPoints& r, const Region& region) {
    const DF d;
    const VB here = hn::LoadU(DB(), reinterpret_cast<const std::uint8_t*>(s.normals) + 4 * pixel);
    float* lower = region.normals + 4 * static_cast<std::ptrdiff_t>(region.stride);
    const auto group = [&](auto number) HWY_ATTR {
        constexpr int kPoint = decltype(number)::value;
        if (!(bits & (0x1111u << kPoint))) return;
        const VF n = hn::ConvertTo(d, hn::ShiftRight<24>(hn::ShiftLeft<24>(valueOf<kPoint>(here))));
        addPairs<kPoint>(region.normals, r.offset, hn::Mul(hn::Broadcast<kPoint>(r.w00), n),
                         hn::Mul(hn::Broadcast<kPoint>(r.w10), n));
        addPairs<kPoint>(lower, r.offset, hn::Mul(hn::Broadcast<kPoint>(r.w01), n),
                         hn::Mul(hn::Broadcast<kPoint>(r.w11), n));
    };
    group(std::integral_constant<int, 0>());
    group(std::integral_constant<int, 1>());
    group(std::integral_constant<int, 2>());
    group(std::integral_constant<int, 3>());
}

#endif

}  // namespace stx::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
