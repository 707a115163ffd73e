#pragma once

#include <array>
#include <vector>

#include <glm/glm.hpp>

#include "lib/registration/overlap.hpp"
#include "lib/registration/pose_sample.hpp"

namespace stx::registration {

/// A rigid motion to first order: a rotation vector about the scene's centre (radians), and a shift
/// in units of the scene's size.
using Twist = std::array<double, 6>;

/// Normal equations of one pair. A point of one view moves with its view and against the other, so
/// six by six numbers serve both.
struct PairEquations {
    std::array<std::array<double, 6>, 6> matrix{};  ///< sum of weight * j * j^T; symmetric
    Twist right{};                                  ///< sum of weight * j * difference
    void add(const Twist& j, double difference, double weight);
};

/// The equations of all poses together.
class PoseSystem {
  public:
    PoseSystem(const std::vector<PoseSample>& views, const std::vector<Pair>& pairs);

    /// How a difference changes with the twist of the view that its point belongs to; `gradient`:
    /// how it changes when the point moves in the world.
    [[nodiscard]] Twist jacobian(glm::dvec3 point, glm::dvec3 gradient) const;

    /// Solves for the twists of all views and moves their cameras. Connected views keep
    /// their mean pose. Gives the largest component of a twist.
    double solveAndMove(const std::vector<Pair>& pairs, const std::vector<PairEquations>& equations,
                        std::vector<PoseSample>& views);

  private:
    glm::dvec3 centre_{0.0};
    double size_ = 1;
    std::vector<int> group_;    ///< of each view: the least index of those it is connected to
    std::vector<Twist> moved_;  ///< so far
};

}  // namespace stx::registration
