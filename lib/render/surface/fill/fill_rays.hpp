#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"

namespace stx::surface {

/// Directions that surface is looked for in.
inline constexpr int kRays = 16;
/// No ray is longer, pixels: what is farther weighs next to nothing beside what is near.
inline constexpr float kLongestRay = 512;
/// The number of pixels whose rays go together, direction by direction.
inline constexpr std::size_t kRayBatch = 128;

/// Distances of the pixels of a picture from surface, the larger of columns and rows, so that no
/// ray crosses more pixels in as many steps; 0 is surface. Four pixels a word, the first lowest,
/// for vectors that look up words.
struct DistanceWords {
    explicit DistanceWords(const Image<std::uint8_t>& distances);

    std::vector<std::int32_t> words;
    float width, height;
};

/// Rays from some pixels of a picture to the surface around them.
class RayBatch {
  public:
    /// No pixel.
    static constexpr std::int32_t kNone = -1;
    /// Rays of one direction, one from each pixel; those that met nothing have the pixel kNone.
    /// Pixels are counted by rows.
    struct Rays {
        std::array<float, kRayBatch> length{};
        std::array<std::int32_t, kRayBatch> rim{};  ///< the surface that was met
        std::array<std::int32_t, kRayBatch>
            behind{};  ///< the next pixel, kNone: not in the picture
    };
    /// Where rays begin.
    struct Start {
        const std::int32_t* distances;  ///< see DistanceWords
        float width, height;
        std::array<float, kRayBatch> x{}, y{};  ///< centres of pixels
    };

    explicit RayBatch(const DistanceWords& distances);

    [[nodiscard]] bool full() const { return count_ == kRayBatch; }
    [[nodiscard]] std::size_t count() const { return count_; }
    /// Adds a pixel that is `distance` from surface.
    void add(int x, int y, int distance);
    void clear() { count_ = 0; }

    /// Finds where the rays of all pixels meet surface.
    void walk();
    /// The rays of each direction; their pixels come in the order in which they were added.
    [[nodiscard]] const std::array<Rays, kRays>& rays() const { return rays_; }

  private:
    Start start_;
    std::size_t count_ = 0;
    std::array<float, kRayBatch> first_{};  ///< how far rays begin from their pixels
    std::array<Rays, kRays> rays_;
};

}  // namespace stx::surface
