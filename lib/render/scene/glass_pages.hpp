#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lib/base/image.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// How much of each pixel glass covers, 1..255: all of those inside of it (translucentInside()),
/// and of those in part around, as far as translucentSurfaces() reaches, their alpha as a share of
/// the largest inside. 0 elsewhere, and where alpha is 0 or 1. Empty where nothing is inside of
/// glass. Both images have one size.
[[nodiscard]] Image<std::uint8_t> glassCoverage(const Texture& texture, const Image<float>& depth);

/// From this glassCoverage() on half of a pixel or more is glass.
inline constexpr std::uint8_t kHalfGlass = 128;

/// glassCoverage() of all pages of a PageSet. In glass alpha says how much of the light it stops,
/// and not how much of a pixel is covered, as elsewhere.
class GlassPages {
  public:
    /// Looks at all pages that have pixels, one after the other. What is found goes into the set's
    /// spool, if it has one, which must outlive it.
    explicit GlassPages(const PageSet& set);

    /// Whether no page has any.
    [[nodiscard]] bool none() const { return none_; }
    /// Whether a page has none.
    [[nodiscard]] bool none(std::size_t page) const { return coverage_[page].empty(); }
    /// Of a texel of a page, which must be there: 0 where it does not show glass.
    [[nodiscard]] std::uint8_t coverage(std::size_t page, std::size_t texel) const {
        return none(page) ? std::uint8_t{0} : coverage_[page].data()[texel];
    }

  private:
    std::vector<Image<std::uint8_t>> coverage_;  ///< by page; empty where none is
    bool none_ = true;
};

}  // namespace stx
