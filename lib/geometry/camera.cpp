#include "lib/geometry/camera.hpp"

#include <algorithm>
#include <cmath>

namespace stx {

Camera Camera::fromFieldOfView(glm::dvec3 position, glm::dquat orientation, glm::dvec2 fieldOfView,
                               bool orthographic, int width, int height) {
    Camera c;
    c.position = position;
    c.orientation = orientation;
    c.orthographic = orthographic;
    c.width = width;
    c.height = height;
    if (orthographic) {
        c.fx = width / fieldOfView.x;
        c.fy = height / fieldOfView.y;
    } else {
        c.fx = width * 0.5 / std::tan(fieldOfView.x * 0.5);
        c.fy = height * 0.5 / std::tan(fieldOfView.y * 0.5);
    }
    c.cx = width * 0.5;
    c.cy = height * 0.5;
    return c;
}

glm::dvec2 Camera::fieldOfView() const {
    if (orthographic) return {width / fx, height / fy};
    return {2.0 * std::atan(width * 0.5 / fx), 2.0 * std::atan(height * 0.5 / fy)};
}

bool Camera::centred(double tolerance) const {
    return std::abs(cx - width * 0.5) <= tolerance && std::abs(cy - height * 0.5) <= tolerance;
}

glm::dmat4 Camera::worldFromCamera() const {
    glm::dmat4 m = glm::mat4_cast(orientation);
    m[3] = glm::dvec4(position, 1.0);
    return m;
}

glm::dmat4 Camera::cameraFromWorld() const {
    const glm::dmat3 r = glm::transpose(glm::mat3_cast(orientation));
    glm::dmat4 m(r);
    m[3] = glm::dvec4(-(r * position), 1.0);
    return m;
}

glm::dvec3 Camera::viewDirection(double x, double y) const {
    if (orthographic) return forward();
    return glm::normalize(orientation * unproject(x, y, 1.0));
}

Camera Camera::resized(int newWidth, int newHeight) const {
    Camera c = *this;
    const double sx = static_cast<double>(newWidth) / width;
    const double sy = static_cast<double>(newHeight) / height;
    c.width = newWidth;
    c.height = newHeight;
    c.fx *= sx;
    c.cx *= sx;
    c.fy *= sy;
    c.cy *= sy;
    return c;
}

Result<void> Camera::check() const {
    for (const double v : {position.x, position.y, position.z, orientation.w, orientation.x,
                           orientation.y, orientation.z, fx, fy, cx, cy}) {
        if (!std::isfinite(v))
            return fail(ErrorCode::invalidInput, "the camera has a value that is not finite ({})",
                        v);
    }
    if (width <= 0 || height <= 0)
        return fail(ErrorCode::invalidInput, "the camera's image is {}x{}; both must be at least 1",
                    width, height);
    if (fx <= 0 || fy <= 0)
        return fail(ErrorCode::invalidInput,
                    "the camera's focal lengths are {} and {}; both must be above 0", fx, fy);
    const double norm = glm::length(orientation);
    if (std::abs(norm - 1.0) > 1e-6)
        return fail(ErrorCode::invalidInput,
                    "the camera's orientation is not a rotation (quaternion of length {})", norm);
    return {};
}

glm::dvec3 scaledToOne(glm::dvec3 direction) {
    const glm::dvec3 size = glm::abs(direction);
    const double largest = std::max({size.x, size.y, size.z});
    if (!(largest > 0) || !std::isfinite(largest)) return direction;
    int exponent = 0;
    (void)std::frexp(largest, &exponent);
    // By each: 2 to that power may itself be no double.
    for (int k = 0; k < 3; ++k) direction[k] = std::ldexp(direction[k], -exponent);
    return direction;
}

Result<glm::dquat> lookAt(glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up) {
    up = scaledToOne(up);
    const auto text = [](glm::dvec3 v) {
        return fmt::format("({:.10g},{:.10g},{:.10g})", v.x, v.y, v.z);
    };
    for (const auto& [name, v] : {std::pair{"eye", eye}, std::pair{"target", target}})
        if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
            return fail(ErrorCode::usage, "the camera's {} is {}; finite numbers are expected",
                        name, text(v));
    const glm::dvec3 toEye = eye - target;
    const double distance = glm::length(toEye);
    if (!std::isfinite(distance))
        return fail(ErrorCode::usage,
                    "the camera's eye {} and target {} are too far apart; move one", text(eye),
                    text(target));
    if (!(distance > 0))
        return fail(ErrorCode::usage, "the camera's eye and target are the same point {}; move one",
                    text(eye));
    const glm::dvec3 z = toEye / distance;
    glm::dvec3 x = glm::cross(up, z);
    if (!(glm::length(x) > 1e-9 * glm::length(up))) {
        // Looking along `up`: any other axis keeps the picture upright in some way.
        const glm::dvec3 other = std::abs(z.y) > 0.9 ? glm::dvec3(0, 0, -z.y) : glm::dvec3(0, 1, 0);
        x = glm::cross(other, z);
    }
    x = glm::normalize(x);
    return glm::normalize(glm::quat_cast(glm::dmat3(x, glm::cross(z, x), z)));
}

glm::dvec4 axisAngleFromQuat(glm::dquat q) {
    // The angle ends up in [0, pi]; half turns that float rounding put just past pi keep their
    // axis, so that a field read from a file is written back as it was.
    if (q.w < -1e-6) q = -q;
    const glm::dvec3 v(q.x, q.y, q.z);
    const double s = glm::length(v);
    if (s < 1e-300) return {0, 0, 1, 0};
    return {v / s, 2.0 * std::atan2(s, q.w)};
}

glm::dquat quatFromAxisAngle(glm::dvec4 axisAngle) {
    const glm::dvec3 axis(axisAngle);
    const double norm = glm::length(axis);
    if (!(norm > 0)) return {1, 0, 0, 0};
    const double half = axisAngle.w * 0.5;
    const glm::dvec3 v = axis / norm * std::sin(half);
    return {std::cos(half), v.x, v.y, v.z};
}

}  // namespace stx
