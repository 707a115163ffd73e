#include "lib/registration/camera_moves.hpp"

#include <algorithm>
#include <cmath>

namespace stx {
namespace {

/// Rotation vector of a unit quaternion: its axis times its angle, radians.
glm::dvec3 vectorOf(glm::dquat turn) {
    if (turn.w < 0) turn = -turn;
    const glm::dvec3 axis(turn.x, turn.y, turn.z);
    const double sine = glm::length(axis);
    return sine > 0 ? axis * (2 * std::atan2(sine, turn.w) / sine) : 2.0 * axis;
}

glm::dquat turnOf(glm::dvec3 vector) {
    const double angle = glm::length(vector);
    return angle > 0 ? glm::angleAxis(angle, vector / angle) : glm::dquat(1, 0, 0, 0);
}

}  // namespace

CameraMove moveBetween(const Camera& from, const Camera& to) {
    return {to.position - from.position,
            glm::normalize(to.orientation * glm::conjugate(from.orientation))};
}

void moveCamera(ViewHeader& view, const CameraMove& move) {
    view.camera.position += move.shift;
    view.camera.orientation = glm::normalize(move.turn * view.camera.orientation);
    const CameraMove before = view.refined.moved.value_or(CameraMove{});
    view.refined.moved =
        CameraMove{before.shift + move.shift, glm::normalize(move.turn * before.turn)};
}

Bounds movedBounds(const Bounds& bounds, const Camera& from, const Camera& to) {
    if (bounds.empty() || from == to) return bounds;
    const CameraMove move = moveBetween(from, to);
    Bounds out;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 at(corner & 1 ? bounds.max.x : bounds.min.x,
                            corner & 2 ? bounds.max.y : bounds.min.y,
                            corner & 4 ? bounds.max.z : bounds.min.z);
        out.add(to.position + move.turn * (at - from.position));
    }
    return out;
}

MovedCamera MovedCamera::of(const ViewHeader& view) {
    return {view.camera, view.refined.moved.value_or(CameraMove{}),
            std::sqrt(view.nearPlane * view.farPlane)};
}

Camera alignedAmong(const Camera& camera, std::span<const MovedCamera> views) {
    if (std::ranges::all_of(views, [](const auto& v) { return v.move == CameraMove{}; }))
        return camera;
    // A view from the same pose outweighs all others.
    constexpr double kSamePose = 1e-18;
    double sum = 0;
    glm::dvec3 shift(0.0), turn(0.0);
    for (const MovedCamera& view : views) {
        const glm::dvec3 apart =
            (view.camera.position - view.move.shift - camera.position) / view.distance;
        const glm::dquat given = glm::conjugate(view.move.turn) * view.camera.orientation;
        const glm::dvec3 looks = given * glm::dvec3(0, 0, -1) - camera.forward();
        const double weight = 1 / (glm::dot(apart, apart) + glm::dot(looks, looks) + kSamePose);
        sum += weight;
        shift += weight * view.move.shift;
        turn += weight * vectorOf(view.move.turn);
    }
    Camera out = camera;
    out.position += shift / sum;
    out.orientation = glm::normalize(turnOf(turn / sum) * camera.orientation);
    return out;
}

}  // namespace stx
