#pragma once

#include <cstddef>
#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/panorama/features.hpp"
#include "lib/panorama/turn_lens.hpp"

/// The inner loops of panoramas, in vectors (Highway). Each does what its plain loop would do, in
/// the same order: the same bits on every processor.
namespace stx::panorama {

/// Descriptors that are compared at a time: they stay in the first cache.
constexpr std::size_t kDescriptorBlock = 128;
/// Farther apart than two descriptors can be.
constexpr std::int16_t kFarDescriptors = 32767;

/// Distances (sums of absolute differences) between `own` and `count` <= kDescriptorBlock others,
/// and the indices of those, in order, that are nearer than `most` or their own limit. `ownSum` and
/// `sums` are the sums of their bytes. Gives how many indices there are.
std::size_t nearDescriptors(const Descriptor& own, std::int16_t ownSum, const Descriptor* others,
                            const std::int16_t* sums, const std::int16_t* limits, std::size_t count,
                            std::int16_t most, std::int16_t* distances, std::uint8_t* indices);

/// Rays of one picture and where another one shows the same, one array for each coordinate.
struct RayMatches {
    const double *ax, *ay, *az, *bx, *by;
    std::size_t count;
};

/// How many rays, turned by `bFromA`, are seen (by a lens without distortion) nearer than
/// `tolerance` to where they should be. Exact when it is more than `most`.
[[nodiscard]] std::size_t countAgreeing(const RayMatches& matches, const glm::dmat3& bFromA,
                                        double focal, double tolerance, std::size_t most);

/// How pixels of a row of an equirectangular picture are seen by a camera.
struct RowOfRays {
    double sine = 0, cosine = 1;                        ///< of the row's latitude
    const double *sines = nullptr, *cosines = nullptr;  ///< of the pixels' longitudes, to the left
    std::size_t count = 0;
    glm::dmat3 worldFromCamera{1.0};
    TurnLens lens;
    glm::dvec2 extent{1}, size{1};  ///< of the picture: a TurnLens's units to its corner, pixels
};

/// A position that no picture has.
constexpr double kNowhere = -1e9;

/// Where the pixels of a row are in the picture (pixels; kNowhere: not in front of the camera).
void positionsOf(const RowOfRays& row, double* x, double* y);

/// Colours (0..1) between the pixels of a picture: Catmull-Rom over four by four of them, whose
/// edges go on. The last number of each has no meaning.
void cubicColours(const Image<glm::u8vec4>& picture, const double* x, const double* y,
                  std::size_t count, glm::vec4* out);

}  // namespace stx::panorama
