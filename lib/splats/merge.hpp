#pragma once

#include <cstddef>
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
/// there. Returns what is left of each image, row by row of the largest squares; the sum is above
/// `most` where no square is left to merge.
[[nodiscard]] std::vector<std::vector<Disc>> mergeDiscs(std::vector<Image<Disc>> images,
                                                        std::size_t most);

}  // namespace stx::splats
