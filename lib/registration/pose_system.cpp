#include "lib/registration/pose_system.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace stx::registration {
namespace {

/// How far off a pose is thought to be: radians, and share of the scene's size. Weak beside any
/// real overlap; holds what the images leave open (sliding along a bare wall).
constexpr double kPrior = 0.1;
/// Levenberg's damping, as a share of the diagonal.
constexpr double kDamping = 1e-4;
constexpr double kSolved = 1e-10;

using Vector = std::vector<Twist>;

double dot(const Vector& a, const Vector& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        for (int k = 0; k < 6; ++k) sum += a[i][k] * b[i][k];
    return sum;
}

void addScaled(Vector& to, double factor, const Vector& what) {
    for (std::size_t i = 0; i < to.size(); ++i)
        for (int k = 0; k < 6; ++k) to[i][k] += factor * what[i][k];
}

Twist times(const std::array<std::array<double, 6>, 6>& m, const Twist& v) {
    Twist out{};
    for (int r = 0; r < 6; ++r)
        for (int c = 0; c < 6; ++c) out[r] += m[r][c] * v[c];
    return out;
}

/// Solves matrix * x = right by conjugate gradients with a diagonal preconditioner; `apply` gives
/// matrix * v.
template <class Apply>
Vector conjugateGradients(const Vector& right, const Vector& diagonal, Apply&& apply) {
    const auto precondition = [&](const Vector& v) {
        Vector out = v;
        for (std::size_t i = 0; i < v.size(); ++i)
            for (int k = 0; k < 6; ++k) out[i][k] /= diagonal[i][k];
        return out;
    };
    Vector x(right.size(), Twist{}), rest = right, direction = precondition(rest);
    double size = dot(rest, direction);
    const double enough = kSolved * kSolved * size;
    const std::size_t most = 20 * right.size() * 6;
    for (std::size_t i = 0; i < most && size > enough && size > 0; ++i) {
        const Vector image = apply(direction);
        const double along = size / dot(direction, image);
        if (!std::isfinite(along)) break;
        addScaled(x, along, direction);
        addScaled(rest, -along, image);
        const Vector next = precondition(rest);
        const double nextSize = dot(rest, next);
        Vector turned = next;
        addScaled(turned, nextSize / size, direction);
        direction = std::move(turned);
        size = nextSize;
    }
    return x;
}

}  // namespace

void PairEquations::add(const Twist& j, double difference, double weight) {
    for (int r = 0; r < 6; ++r) {
        const double scaled = weight * j[r];
        for (int c = 0; c < 6; ++c) matrix[r][c] += scaled * j[c];
        right[r] += scaled * difference;
    }
}

PoseSystem::PoseSystem(const Bundle& bundle, const std::vector<Pair>& pairs)
    : group_(bundle.views.size()), moved_(bundle.views.size(), Twist{}) {
    const Bounds bounds = bundle.computeBounds();
    centre_ = bounds.empty() ? glm::dvec3(0.0) : bounds.centre();
    size_ = std::max(1e-12, bounds.radius());
    std::iota(group_.begin(), group_.end(), 0);
    for (bool changed = true; changed;) {
        changed = false;
        for (const Pair& pair : pairs) {
            int& a = group_[static_cast<std::size_t>(pair.from)];
            int& b = group_[static_cast<std::size_t>(pair.to)];
            if (a == b) continue;
            a = b = std::min(a, b);
            changed = true;
        }
    }
}

Twist PoseSystem::jacobian(glm::dvec3 point, glm::dvec3 gradient) const {
    const glm::dvec3 turn = glm::cross(point - centre_, gradient), shift = gradient * size_;
    return {turn.x, turn.y, turn.z, shift.x, shift.y, shift.z};
}

double PoseSystem::solveAndMove(const std::vector<Pair>& pairs,
                                const std::vector<PairEquations>& equations, Bundle& bundle) {
    const double prior = 1 / (kPrior * kPrior);
    Vector right(moved_.size(), Twist{}), diagonal(moved_.size(), Twist{});
    for (std::size_t i = 0; i < moved_.size(); ++i) {
        for (int k = 0; k < 6; ++k) {
            right[i][k] = -prior * moved_[i][k];
            diagonal[i][k] = prior;
        }
    }
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const auto from = static_cast<std::size_t>(pairs[i].from);
        const auto to = static_cast<std::size_t>(pairs[i].to);
        for (int k = 0; k < 6; ++k) {
            right[from][k] -= equations[i].right[k];
            right[to][k] += equations[i].right[k];
            diagonal[from][k] += equations[i].matrix[k][k];
            diagonal[to][k] += equations[i].matrix[k][k];
        }
    }
    Vector damping = diagonal;
    for (std::size_t i = 0; i < diagonal.size(); ++i) {
        for (int k = 0; k < 6; ++k) {
            damping[i][k] = prior + kDamping * diagonal[i][k];
            diagonal[i][k] += kDamping * diagonal[i][k];
        }
    }
    Vector twist = conjugateGradients(right, diagonal, [&](const Vector& v) {
        Vector out(v.size());
        for (std::size_t i = 0; i < v.size(); ++i)
            for (int k = 0; k < 6; ++k) out[i][k] = damping[i][k] * v[i][k];
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            const auto from = static_cast<std::size_t>(pairs[i].from);
            const auto to = static_cast<std::size_t>(pairs[i].to);
            Twist apart = v[from];
            for (int k = 0; k < 6; ++k) apart[k] -= v[to][k];
            const Twist pull = times(equations[i].matrix, apart);
            for (int k = 0; k < 6; ++k) {
                out[from][k] += pull[k];
                out[to][k] -= pull[k];
            }
        }
        return out;
    });

    // A common motion of connected views changes no difference: take it out.
    Vector mean(twist.size(), Twist{});
    std::vector<int> members(twist.size(), 0);
    for (std::size_t i = 0; i < twist.size(); ++i) {
        const auto group = static_cast<std::size_t>(group_[i]);
        ++members[group];
        for (int k = 0; k < 6; ++k) mean[group][k] += twist[i][k];
    }
    double largest = 0;
    for (std::size_t i = 0; i < twist.size(); ++i) {
        const auto group = static_cast<std::size_t>(group_[i]);
        for (int k = 0; k < 6; ++k) {
            twist[i][k] -= mean[group][k] / members[group];
            moved_[i][k] += twist[i][k];
            largest = std::max(largest, std::abs(twist[i][k]));
        }
        const glm::dvec3 turn(twist[i][0], twist[i][1], twist[i][2]);
        const glm::dvec3 shift = glm::dvec3(twist[i][3], twist[i][4], twist[i][5]) * size_;
        const double angle = glm::length(turn);
        const glm::dquat rotation =
            angle > 0 ? glm::angleAxis(angle, turn / angle) : glm::dquat(1, 0, 0, 0);
        Camera& camera = bundle.views[i].camera;
        camera.position = centre_ + rotation * (camera.position - centre_) + shift;
        camera.orientation = glm::normalize(rotation * camera.orientation);
    }
    return largest;
}

}  // namespace stx::registration
