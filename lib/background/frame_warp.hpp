#pragma once

#include <cstdint>
#include <optional>

#include <glm/glm.hpp>

#include "lib/background/frame_gauge.hpp"

/// What a frame of one pose shows along the rays of another.
namespace stx::temporal {

/// A frame, ready to be looked up from other poses.
struct WarpFrame {
    Camera camera;              ///< perspective
    Image<float> inverse;       ///< inverse distances, 0 = no point
    Image<std::uint8_t> mixed;  ///< 1 beside depth edges
    Image<glm::vec3> colour;    ///< as stepsOf() gives it
    /// Largest inverse distance within two pixels; infinite where one of them is not known. Only
    /// for carving (see clearView()).
    Image<float> nearest;
    float step = 0;  ///< scene units between codes of depth, 0 of floats
};

/// `camera`: of the frame, once it is registered.
[[nodiscard]] WarpFrame warpFrame(const ReferenceView& view, const Camera& camera,
                                  const DepthNoise& noise);
/// Only what clearView() needs. `emptyIsFar`: pixels without a point
/// and without colour are empty space; else they are what the sensor missed.
[[nodiscard]] WarpFrame carveFrame(const ReferenceView& view, const Camera& camera,
                                   bool emptyIsFar);

/// Points of one perspective camera in the pixels of another. Distances are planar, each
/// from the camera that is named with it.
class CameraPair {
  public:
    CameraPair(const Camera& from, const Camera& to);

    /// The ray of a pixel position of `from`, in the axes of `to`.
    struct Ray {
        glm::vec3 direction;  ///< of one unit of distance in `from`
        /// Distance in `to` of a point at a distance in `from` is slope times it plus offset.
        float slope;
    };
    [[nodiscard]] Ray ray(float x, float y) const {
        const glm::vec3 d = turn_ * glm::vec3((x - fromCentre_.x) * fromUnit_.x,
                                              -(y - fromCentre_.y) * fromUnit_.y, -1.0f);
        return {d, -d.z};
    }
    /// Pixel position in `to` and distance there, of the point at a distance in `from`; the
    /// distance is 0 or less behind `to`.
    [[nodiscard]] glm::vec3 at(const Ray& ray, float distance) const {
        const glm::vec3 p = ray.direction * distance + shift_;
        const float scale = 1 / -p.z;
        return {toCentre_.x + toFocal_.x * p.x * scale, toCentre_.y - toFocal_.y * p.y * scale,
                -p.z};
    }
    /// The distance in `from` of the point of a ray that has a distance in `to`.
    [[nodiscard]] float back(const Ray& ray, float distance) const {
        return (distance + shift_.z) / ray.slope;
    }

  private:
    glm::mat3 turn_;
    glm::vec3 shift_;
    glm::vec2 fromCentre_, fromUnit_, toCentre_, toFocal_;
};

/// What a frame shows at a pixel position.
struct Spot {
    float inverse = 0;   ///< 0: nothing
    bool whole = false;  ///< one surface all around: interpolated; else the nearest pixel's
    int x = 0, y = 0;    ///< the nearest pixel
};
[[nodiscard]] Spot spotAt(const WarpFrame& frame, float x, float y);

/// Colour at a pixel position: Catmull-Rom where all is one surface, else the nearest pixel's.
[[nodiscard]] glm::vec3 colourAt(const WarpFrame& frame, const Spot& spot, float x, float y);

/// Whether a frame looks through a place of its pixels at this distance: everything within two
/// pixels is known and farther by more than a share.
[[nodiscard]] inline bool clearView(const WarpFrame& frame, glm::vec3 at, float share) {
    if (!(at.z > 0)) return false;
    if (!(at.x >= 0 && at.y >= 0 && at.x < static_cast<float>(frame.nearest.width()) &&
          at.y < static_cast<float>(frame.nearest.height())))
        return false;
    const float nearest = frame.nearest.at(static_cast<int>(at.x), static_cast<int>(at.y));
    return nearest * at.z * (1 + share) < 1;
}

}  // namespace stx::temporal
