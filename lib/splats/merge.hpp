#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"

namespace stx::splats {

/// A flat ellipse in space with a colour: a texel, or a block of them that are as good as one.
struct Disc {
    glm::vec3 centre{0.0f};
    glm::vec3 u{0.0f}, v{0.0f};  ///< conjugate half axes
    glm::vec4 colour{0.0f};      ///< coded, straight, with alpha, 0..1; alpha 0: no disc
};

/// Merges squares of 2 x 2 discs of images, and then squares of those, until no more than `most`
/// are left: first those where colour and surface lose least. A square is merged when all of it is
/// there. Images are looked at one after the other, twice: here, and in left().
class DiscMerging {
  public:
    /// `spool`: that of the images, if any. What is kept of squares meanwhile, four bytes for three
    /// discs, is there, too.
    DiscMerging(std::span<const Image<Disc>> images, std::size_t most, PixelSpool* spool = nullptr);

    /// Discs that are left of all images; above `most` where no square is left to merge.
    [[nodiscard]] std::size_t count() const { return count_; }
    /// Calls with what is left of each row of the largest squares of one of them.
    void left(const Image<Disc>& image,
              const std::function<void(const std::vector<Disc>&)>& each) const;

  private:
    PixelSpool* spool_;
    std::size_t count_ = 0;
    float loss_ = -1;  ///< squares that lose no more become one disc
};

}  // namespace stx::splats
