#include <cmath>
#include <numbers>

#include "formats/stx/stx.hpp"
#include "lib/geometry/view_layout.hpp"

namespace stx {
namespace {

constexpr int kMostCameras = 1000000;

Result<void> check(const CameraSettings& s) {
    if (s.width < 1 || s.height < 1)
        return fail(ErrorCode::usage, "a picture of {}x{} is asked for; sizes are above 0", s.width,
                    s.height);
    if (!(s.fovRad > 0 && s.fovRad < std::numbers::pi))
        return fail(ErrorCode::usage,
                    "the field of view is {:g} degrees; it must be above 0 and below 180",
                    glm::degrees(s.fovRad));
    if (!(s.orthoHeight >= 0 && std::isfinite(s.orthoHeight)))
        return fail(ErrorCode::usage,
                    "the window of an orthographic camera is {:g} high; above 0, or 0 for a "
                    "perspective camera, is expected",
                    s.orthoHeight);
    if (!(glm::length(scaledToOne(s.up)) > 0))
        return fail(ErrorCode::usage, "up is 0,0,0; it must point somewhere");
    return {};
}

/// Distance at which a sphere fills the narrower side of the frame.
double framingDistance(double radius, const CameraSettings& s) {
    // Room around the object, so that no edge touches the frame.
    constexpr double kMargin = 1.02;
    const double aspect = static_cast<double>(s.width) / s.height;
    const double half = std::atan(std::min(1.0, aspect) * std::tan(s.fovRad * 0.5));
    return radius / std::sin(half) * kMargin;
}

}  // namespace

Result<Camera> cameraAt(glm::dvec3 eye, glm::dvec3 target, const CameraSettings& s) {
    STX_CHECK(check(s));
    STX_TRY(const auto orientation, lookAt(eye, target, s.up));
    Camera c;
    c.position = eye;
    c.orientation = orientation;
    c.width = s.width;
    c.height = s.height;
    c.orthographic = s.orthoHeight > 0;
    c.fx = c.fy =
        c.orthographic ? s.height / s.orthoHeight : s.height * 0.5 / std::tan(s.fovRad * 0.5);
    c.cx = s.width * 0.5;
    c.cy = s.height * 0.5;
    return c;
}

Result<std::vector<Camera>> orbitCameras(glm::dvec3 centre, double radius, int count,
                                         double elevationRad, const CameraSettings& s) {
    OrbitSettings orbit;
    orbit.count = count;
    orbit.elevationRad = elevationRad;
    return orbitCameras(centre, radius, orbit, s);
}

Result<std::vector<Camera>> orbitCameras(glm::dvec3 centre, double radius,
                                         const OrbitSettings& orbit, const CameraSettings& s) {
    STX_CHECK(check(s));
    const int count = orbit.count;
    if (!(orbit.distance >= 0 && std::isfinite(orbit.distance)))
        return fail(ErrorCode::usage, "the orbit's radius is {:g}; it must be 0 or more",
                    orbit.distance);
    if (count < 1 || count > kMostCameras)
        return fail(ErrorCode::usage, "an orbit of {} cameras is asked for; 1 to {} are possible",
                    count, kMostCameras);
    if (orbit.distance == 0 && !std::isfinite(radius))
        return fail(ErrorCode::usage, "the sphere's radius is {:g}; a finite number is expected",
                    radius);
    const double distance =
        orbit.distance > 0 ? orbit.distance : framingDistance(radius > 0 ? radius : 1e-9, s);
    const glm::dquat toUp = rotationToUp(s.up);
    const bool whole = std::abs(orbit.arcRad) >= 2 * std::numbers::pi - 1e-9;
    const double steps = whole ? count : std::max(count - 1, 1);
    const double e = orbit.elevationRad;
    std::vector<Camera> cameras;
    for (int i = 0; i < count; ++i) {
        const double a = orbit.startRad + orbit.arcRad * i / steps;
        const glm::dvec3 direction =
            toUp * glm::dvec3(std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e));
        CameraSettings turned = s;
        if (const auto up = upAtPole(a, e)) turned.up = toUp * *up;
        STX_TRY(const auto camera, cameraAt(centre + direction * distance, centre, turned));
        cameras.push_back(camera);
    }
    return cameras;
}

}  // namespace stx
