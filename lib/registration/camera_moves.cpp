#include "lib/registration/camera_moves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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

/// Fewer views are too few to tell whether moves of neighbours are alike: of 8 that moved each by
/// its own, the share that neighbours seem to tell is 0 to 0.2.
constexpr std::size_t kFewestViews = 8;
/// So many views tell how alike moves are: all of thousands would take seconds.
constexpr std::size_t kMostLeftOut = 128;
/// Cameras this close are one: what rounding leaves between a view's camera and that of a file, as
/// MovedCamera::distance and radians.
constexpr double kSameCamera = 1e-6;

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

void moveCamera(ReferenceView& view, const CameraMove& move) {
    moveCamera(static_cast<ViewHeader&>(view), move);
    for (Image<glm::vec3>* image : {&view.normal, &view.splatU, &view.splatV})
        for (glm::vec3& vector : image->pixels())
            vector = glm::vec3(move.turn * glm::dvec3(vector));
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

MovesOfNeighbours::MovesOfNeighbours(std::vector<MovedCamera> views) : views_(std::move(views)) {
    still_ = std::ranges::all_of(views_, [](const auto& v) { return v.move == CameraMove{}; });
    if (still_ || views_.size() < kFewestViews) return;
    const auto size = [](glm::dvec3 shift, glm::dvec3 turn, double distance) {
        return glm::dot(shift, shift) / (distance * distance) + glm::dot(turn, turn);
    };
    double all = 0, left = 0;
    std::vector<double> nearest;
    const std::size_t step = (views_.size() + kMostLeftOut - 1) / kMostLeftOut;
    for (std::size_t i = 0; i < views_.size(); i += step) {
        const MovedCamera& view = views_[i];
        Camera given = view.camera;
        given.position -= view.move.shift;
        given.orientation = glm::conjugate(view.move.turn) * given.orientation;
        const Mean others = meanFor(given, i);
        nearest.push_back(others.nearest);
        const glm::dvec3 turn = vectorOf(view.move.turn);
        all += size(view.move.shift, turn, view.distance);
        left += size(view.move.shift - others.shift, turn - others.turn, view.distance);
    }
    if (all > 0) share_ = std::clamp(1 - left / all, 0.0, 1.0);
    const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
    std::ranges::nth_element(nearest, middle);
    usualGap_ = *middle;
}

MovesOfNeighbours::Mean MovesOfNeighbours::meanFor(const Camera& camera,
                                                   std::size_t without) const {
    // A view from the same pose outweighs all others.
    constexpr double kSamePose = 1e-18;
    Mean out;
    double sum = 0;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < views_.size(); ++i) {
        if (i == without) continue;
        const MovedCamera& view = views_[i];
        const glm::dvec3 apart =
            (view.camera.position - view.move.shift - camera.position) / view.distance;
        const glm::dquat given = glm::conjugate(view.move.turn) * view.camera.orientation;
        const glm::dvec3 looks = given * glm::dvec3(0, 0, -1) - camera.forward();
        const double squared = glm::dot(apart, apart) + glm::dot(looks, looks);
        const double weight = 1 / (squared + kSamePose);
        nearest = std::min(nearest, squared);
        sum += weight;
        out.shift += weight * view.move.shift;
        out.turn += weight * vectorOf(view.move.turn);
    }
    out.shift /= sum;
    out.turn /= sum;
    out.nearest = std::sqrt(nearest);
    return out;
}

Camera MovesOfNeighbours::aligned(const Camera& camera) const {
    if (still_) return camera;
    const Mean mean = meanFor(camera, views_.size());
    // Half way between two views is as far from one as a camera between views usually is.
    const double own = std::clamp(1 - mean.nearest / (0.5 * usualGap_ + kSameCamera), 0.0, 1.0);
    const double share = share_ + (1 - share_) * own;
    Camera out = camera;
    out.position += share * mean.shift;
    out.orientation = glm::normalize(turnOf(share * mean.turn) * camera.orientation);
    return out;
}

}  // namespace stx
