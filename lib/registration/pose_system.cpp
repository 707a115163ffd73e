#include "lib/registration/pose_system.hpp"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

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
    const auto unknowns = static_cast<Eigen::Index>(6 * moved_.size());
    Eigen::VectorXd right =
        -prior * Eigen::Map<const Eigen::VectorXd>(moved_.front().data(), unknowns);
    Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(unknowns, prior);
    std::vector<Eigen::Triplet<double>> terms;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const int from = 6 * pairs[i].from, to = 6 * pairs[i].to;
        for (int r = 0; r < 6; ++r) {
            right[from + r] -= equations[i].right[r];
            right[to + r] += equations[i].right[r];
            diagonal[from + r] += equations[i].matrix[r][r];
            diagonal[to + r] += equations[i].matrix[r][r];
            for (int c = 0; c < 6; ++c) {
                const double pull = equations[i].matrix[r][c];
                terms.emplace_back(from + r, from + c, pull);
                terms.emplace_back(to + r, to + c, pull);
                terms.emplace_back(from + r, to + c, -pull);
                terms.emplace_back(to + r, from + c, -pull);
            }
        }
    }
    for (int k = 0; k < static_cast<int>(unknowns); ++k)
        terms.emplace_back(k, k, prior + kDamping * diagonal[k]);
    Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
    matrix.setFromTriplets(terms.begin(), terms.end());
    Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
    solver.setTolerance(kSolved);
    solver.setMaxIterations(20 * unknowns);
    const Eigen::VectorXd solved = solver.compute(matrix).solve(right);
    if (!solved.allFinite()) return 0;
    std::vector<Twist> twist(moved_.size());
    std::copy(solved.begin(), solved.end(), twist.front().begin());

    // A common motion of connected views changes no difference: take it out.
    std::vector<Twist> mean(twist.size(), Twist{});
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
