// Where a row of a view's pixels is in another picture. Compiled for each SIMD target: included
// once for each.

#if defined(STX_GEOMETRY_ROW_MAP_INL_HPP) == defined(HWY_TARGET_TOGGLE)
#ifdef STX_GEOMETRY_ROW_MAP_INL_HPP
#undef STX_GEOMETRY_ROW_MAP_INL_HPP
#else
#define STX_GEOMETRY_ROW_MAP_INL_HPP
#endif

#include <limits>

#include <hwy/highway.h>

#include "lib/geometry/pixel_map.hpp"

HWY_BEFORE_NAMESPACE();
namespace stx::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Rows are parts of blocks of this side.
constexpr int kRowPixels = 16;

using DF = hn::CappedTag<float, kRowPixels>;
using DI = hn::RebindToSigned<DF>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A row of a block: H = (a + i au) z + (b + i bu) for its i-th pixel.
struct RowMap {
    float a[3], au[3], av[3], b[3], bu[3], bv[3];
    RowMap(const PixelMap& m, int u, int v)
        : map_(m),
          a_(m.a0 + m.au * double(u) + m.av * double(v)),
          b_(m.b0 + m.bu * double(u) + m.bv * double(v)) {
        for (int k = 0; k < 3; ++k) {
            au[k] = static_cast<float>(m.au[k]);
            av[k] = static_cast<float>(m.av[k]);
            bu[k] = static_cast<float>(m.bu[k]);
            bv[k] = static_cast<float>(m.bv[k]);
        }
        round();
    }
    // Goes on to the row below.
    void next() {
        a_ += map_.av;
        b_ += map_.bv;
        round();
    }

  private:
    void round() {
        for (int k = 0; k < 3; ++k) {
            a[k] = static_cast<float>(a_[k]);
            b[k] = static_cast<float>(b_[k]);
        }
    }

    const PixelMap& map_;
    glm::dvec3 a_, b_;
};

// Depths of `count` pixels, infinity after them.
HWY_INLINE hn::Vec<DF> loadDepth(DF d, const float* from, int count) {
    if (count >= static_cast<int>(hn::Lanes(d))) return hn::LoadU(d, from);
    HWY_ALIGN float padded[kRowPixels];
    for (int i = 0; i < kRowPixels; ++i) padded[i] = i < count ? from[i] : kInfinity;
    return hn::Load(d, padded);
}

HWY_INLINE std::uint32_t bitsOf(DF d, hn::Mask<DF> mask) {
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return bytes[0] | (bytes[1] << 8);
}

}  // namespace stx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
