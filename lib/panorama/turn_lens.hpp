#pragma once

#include <cmath>
#include <optional>

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace stx::panorama {

/// What is less than this share of its length in front of the camera is behind it: far beyond any
/// lens that this model is for.
inline constexpr double kBehind = 1e-3;
/// Where the distortion moves what is farther out by less than this share of the usual, it is taken
/// to fold: positions beyond belong to no ray.
inline constexpr double kLeastSlope = 0.05;

/// The lens that all pictures of a series share. Positions in a picture are measured from its
/// middle, x right and y up, in halves of its diagonal: so portraits, landscapes and reduced copies
/// of one camera have one focal length. Rays are in camera space (it looks along -Z).
struct TurnLens {
    double focal = 1;  ///< halves of the diagonal
    /// Radial distortion as OpenCV's: a point at distance r of the axis in the plane at distance 1
    /// is seen at r (1 + k1 r^2).
    double k1 = 0;

    /// Where a ray is seen; nothing behind the camera, or where the distortion folds.
    [[nodiscard]] std::optional<glm::dvec2> position(glm::dvec3 ray) const {
        if (ray.z > -kBehind * glm::length(ray)) return std::nullopt;
        const glm::dvec2 plane = glm::dvec2(ray) / -ray.z;
        const double r2 = glm::dot(plane, plane);
        if (1 + 3 * k1 * r2 <= kLeastSlope) return std::nullopt;
        return focal * (1 + k1 * r2) * plane;
    }
    /// The unit ray of a position. Where the distortion folds, that of the fold.
    [[nodiscard]] glm::dvec3 ray(glm::dvec2 position) const {
        const glm::dvec2 seen = position / focal;
        const double distorted = glm::length(seen);
        double r = distorted;
        if (k1 != 0 && distorted > 0) {
            // Newton's method, until doubles hold no more; that takes a few steps.
            constexpr int kMostSteps = 20;
            constexpr double kExact = 1e-13;
            for (int i = 0; i < kMostSteps; ++i) {
                const double slope = 1 + 3 * k1 * r * r;
                if (slope <= kLeastSlope) {  // beyond the fold: stay on it
                    r = std::sqrt((kLeastSlope - 1) / (3 * k1));
                    break;
                }
                const double step = (r * (1 + k1 * r * r) - distorted) / slope;
                r -= step;
                if (std::abs(step) < kExact) break;
            }
        }
        const glm::dvec2 plane = distorted > 0 ? seen * (r / distorted) : seen;
        return glm::normalize(glm::dvec3(plane, -1.0));
    }
};

/// The rotation by a rotation vector (radians).
[[nodiscard]] inline glm::dquat quatOf(glm::dvec3 turn) {
    const double angle = glm::length(turn);
    // So small an angle cannot be divided by; the first terms of the series are exact then.
    if (angle < 1e-12) return glm::normalize(glm::dquat(1, turn.x / 2, turn.y / 2, turn.z / 2));
    return glm::angleAxis(angle, turn / angle);
}

/// The angle between two rotations, radians.
[[nodiscard]] inline double angleBetween(glm::dquat a, glm::dquat b) {
    const glm::dquat d = glm::inverse(a) * b;
    return 2 * std::atan2(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), std::abs(d.w));
}

}  // namespace stx::panorama
