#include "lib/render/surface/fill/fill_rays.hpp"

#include <cmath>

namespace stx::surface {
namespace {

/// The rays of a batch in one direction, `rays.length` long at first, go on until each met surface
/// or left the picture.
void walkRays(const RayBatch::Start& start, glm::vec2 direction, std::size_t count,
              RayBatch::Rays& rays) {
    const auto stride = static_cast<std::int32_t>(start.width);
    for (std::size_t i = 0; i < count; ++i) {
        // The pixel that is so far along, kNone where the ray left the picture or is too long.
        const auto pixelAt = [&](float along) {
            const float x = start.x[i] + direction.x * along, y = start.y[i] + direction.y * along;
            const bool in =
                x >= 0 && y >= 0 && along <= kLongestRay && x < start.width && y < start.height;
            return in ? static_cast<std::int32_t>(y) * stride + static_cast<std::int32_t>(x)
                      : RayBatch::kNone;
        };
        float& along = rays.length[i];
        while (true) {
            rays.rim[i] = pixelAt(along);
            if (rays.rim[i] == RayBatch::kNone) {
                along = 2 * kLongestRay;
                break;
            }
            const std::uint8_t distance = start.distances[rays.rim[i]];
            if (distance == 0) break;
            along += static_cast<float>(distance);
        }
        rays.behind[i] = pixelAt(along + 1);
    }
}

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

RayBatch::RayBatch(const Image<std::uint8_t>& distances)
    : start_{distances.data(), static_cast<float>(distances.width()),
             static_cast<float>(distances.height())} {}

void RayBatch::add(int x, int y, int distance) {
    start_.x[count_] = static_cast<float>(x) + 0.5f;
    start_.y[count_] = static_cast<float>(y) + 0.5f;
    first_[count_] = static_cast<float>(distance);
    ++count_;
}

void RayBatch::walk() {
    for (std::size_t k = 0; k < kRays; ++k) {
        rays_[k].length = first_;
        walkRays(start_, rayDirections()[k], count_, rays_[k]);
    }
}

}  // namespace stx::surface
