#pragma once

#include <array>
#include <cstdint>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/model/texture.hpp"

/// Of the step `raise`: which surfaces a sample of coarse depth has around it, and which of them a
/// pixel of the finer picture may show.

namespace stx {

/// Samples whose 1/z differ by a smaller share belong to one surface.
inline constexpr float kAlikeDepth = 0.02f;
/// Most surfaces that one pixel may go to.
inline constexpr int kRaisedSurfaces = 3;
/// Samples to each side of a pixel's own that it looks at.
inline constexpr int kRaiseReach = 2;
inline constexpr int kRaiseSide = 2 * kRaiseReach + 1, kRaiseSamples = kRaiseSide * kRaiseSide;

/// The surfaces that the samples around one sample show, nearest first.
struct SurfacesAround {
    static constexpr std::uint8_t kNone = 255;
    struct Surface {
        float low = 0, high = 0;  ///< of 1/z of its samples; 0: where no depth is
        glm::vec3 plane{0};       ///< 1/z = plane . (1, x, y), in samples from the middle one

        [[nodiscard]] float at(float x, float y) const {
            return glm::clamp(plane.x + plane.y * x + plane.z * y, low, high);
        }
    };
    int count = 0;
    std::array<Surface, kRaisedSurfaces> surfaces;
    /// To which of them each sample belongs, row by row; kNone: to none of them, or not there.
    std::array<std::uint8_t, kRaiseSamples> of;
};

/// Depth on a coarse grid and the picture of the same shape on a fine one. Positions of pixels are
/// in samples, (0, 0) in the middle of the first one.
class CoarseDepth {
  public:
    /// `matte`: what of the picture belongs to a person, 0..255, of any size of the same shape,
    /// which has to stay there; null: nobody tells.
    CoarseDepth(const Image<float>& depth, const Texture& picture,
                const Image<std::uint8_t>* matte);

    [[nodiscard]] int width() const { return inverse_.width(); }
    [[nodiscard]] int height() const { return inverse_.height(); }
    /// Whether the four samples around a place are one surface; `inverse` is 1/z between them (0:
    /// no depth), also where they are not.
    [[nodiscard]] bool isOneSurface(glm::dvec2 at, float& inverse) const;
    [[nodiscard]] SurfacesAround surfacesAround(int x, int y) const;
    /// What it costs a pixel with that colour to go to each of the surfaces around sample `middle`:
    /// minus the logarithm of how well the colours and places of its samples explain it, and how
    /// far their matte is from the pixel's.
    [[nodiscard]] std::array<float, kRaisedSurfaces> costs(const SurfacesAround& around,
                                                           glm::ivec2 middle, glm::dvec2 at,
                                                           glm::vec3 colour) const;

  private:
    struct Colours {
        glm::vec3 mean{0};
        glm::vec3 sharpness{0};  ///< 1 / variance
        float norm = 0;          ///< the share of the density of the narrowest colours
        float matte = 0;         ///< 0..1
    };

    void findMixed();
    void gatherColours(const Texture& picture);
    [[nodiscard]] float clampedAt(int x, int y) const;
    [[nodiscard]] float matteAt(glm::dvec2 at) const;

    Image<float> inverse_;  ///< 1/z; 0: no depth
    Image<std::uint8_t> mixed_;
    Image<Colours> colours_;
    const Image<std::uint8_t>* matte_;
};

}  // namespace stx
