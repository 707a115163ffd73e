#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/model/reference_view.hpp"

/// A room whose every pixel is known, filmed by a camera that walks through it. It has boxes in it,
/// a sphere that crosses it, and another one that stands still for most of the time before it
/// leaves.
namespace walked {

inline constexpr int kWidth = 320, kHeight = 240, kFrames = 36;

inline double timeOf(int frame) {
    return frame / 12.0;
}

/// Along an arc, turning towards the middle of the back wall. `aside`: scene units to the right of
/// the path.
inline stx::Camera cameraAt(int frame, double aside = 0) {
    const double t = static_cast<double>(frame) / (kFrames - 1);
    const glm::dvec3 eye(-0.8 + 1.6 * t, 0.1 + 0.15 * std::sin(3 * t), 0.3 - 0.5 * t * t);
    const glm::dquat turn = *stx::lookAt(eye, {0.9 - 1.8 * t, -0.1, -4.4});
    return stx::Camera::fromFieldOfView(eye + turn * glm::dvec3(aside, 0, 0), turn, {1.05, 0.82},
                                        false, kWidth, kHeight);
}

/// Smooth patterns with edges here and there, of 20 to 235.
inline glm::vec3 paint(int material, double u, double v) {
    const double k = material + 1;
    glm::vec3 colour;
    for (int c = 0; c < 3; ++c) {
        const double wave = std::sin(u * (5 + 1.7 * k) + 1.3 * c) * std::cos(v * (4 + 2.3 * c) + k);
        const double fine = std::sin(u * 23 + v * 17 * (c + 1) + k);
        const double tiles = std::sin(9 * u + k) * std::sin(8 * v) > 0 ? 1 : -1;
        colour[c] = static_cast<float>(128 + 30 * std::sin(k * (2.1 + c)) + 32 * wave + 12 * fine +
                                       14 * tiles);
    }
    return glm::clamp(colour, 20.0f, 235.0f);
}

struct Hit {
    double distance = std::numeric_limits<double>::infinity();
    glm::vec3 colour{0.0f};
    bool moves = false;
};

inline void meetBox(Hit& hit, glm::dvec3 eye, glm::dvec3 ray, glm::dvec3 low, glm::dvec3 high,
                    int material, bool inside) {
    double enter = -1e30, leave = 1e30;
    int enterAxis = 0, leaveAxis = 0;
    for (int axis = 0; axis < 3; ++axis) {
        double a = (low[axis] - eye[axis]) / ray[axis], b = (high[axis] - eye[axis]) / ray[axis];
        if (a > b) std::swap(a, b);
        if (a > enter) enter = a, enterAxis = axis;
        if (b < leave) leave = b, leaveAxis = axis;
    }
    const double t = inside ? leave : enter;
    const int axis = inside ? leaveAxis : enterAxis;
    if (enter > leave || t <= 0 || t >= hit.distance) return;
    const glm::dvec3 p = eye + t * ray;
    const int face = 2 * axis + (ray[axis] > 0 ? 1 : 0);
    hit = {t, paint(material + face, p[(axis + 1) % 3], p[(axis + 2) % 3]), false};
}

inline void meetBall(Hit& hit, glm::dvec3 eye, glm::dvec3 ray, glm::dvec3 centre, double radius,
                     int material) {
    const glm::dvec3 from = eye - centre;
    const double a = glm::dot(ray, ray), b = glm::dot(from, ray);
    const double root = b * b - a * (glm::dot(from, from) - radius * radius);
    if (root <= 0) return;
    const double t = (-b - std::sqrt(root)) / a;
    if (t <= 0 || t >= hit.distance) return;
    const glm::dvec3 n = (from + t * ray) / radius;
    hit = {t, paint(material, 2 * std::atan2(n.x, n.z), 3 * n.y), true};
}

/// `ray` has one unit along the camera's axis, so distances are planar.
inline Hit look(glm::dvec3 eye, glm::dvec3 ray, double time, bool empty) {
    Hit hit;
    meetBox(hit, eye, ray, {-2.2, -1.3, -4.5}, {2.2, 1.3, 1.5}, 0, true);
    meetBox(hit, eye, ray, {0.5, -1.3, -3.9}, {1.1, -0.5, -3.2}, 7, false);
    meetBox(hit, eye, ray, {-1.6, -1.3, -4.3}, {-1.1, -0.2, -3.8}, 14, false);
    if (empty) return hit;
    const double t = time / timeOf(kFrames - 1);
    meetBall(hit, eye, ray, {-1.7 + 3.4 * t, -0.3, -2.6 - 0.2 * std::sin(9 * t)}, 0.34, 21);
    const double gone = std::clamp((t - 0.72) / 0.2, 0.0, 1.0);
    meetBall(hit, eye, ray, {-0.35 - 2.2 * gone, 0.25, -3.1}, 0.36, 24);
    return hit;
}

/// What a camera sees at a time; colours are means of nine rays, depth that of the middle one.
inline stx::ReferenceView see(const stx::Camera& camera, double time, bool empty) {
    stx::ReferenceView view;
    view.name = "walk";
    view.camera = camera;
    view.nearPlane = 0.3;
    view.farPlane = 12;
    view.depthBits = 32;
    view.depth = stx::Image<float>(kWidth, kHeight);
    stx::Rgba8Image colours(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            glm::vec3 sum(0.0f);
            for (int k = 0; k < 9; ++k) {
                const glm::dvec3 ray =
                    camera.orientation *
                    camera.unproject(x + (k % 3 + 0.5) / 3, y + (k / 3 + 0.5) / 3, 1);
                const Hit hit = look(camera.position, ray, time, empty);
                sum += hit.colour;
                if (k == 4) view.depth.at(x, y) = static_cast<float>(hit.distance);
            }
            colours.at(x, y) = glm::u8vec4(glm::u8vec3(sum / 9.0f + 0.5f), 255);
        }
    }
    view.texture = std::move(colours);
    return view;
}

inline stx::ReferenceView frame(int number) {
    return see(cameraAt(number), timeOf(number), false);
}

}  // namespace walked
