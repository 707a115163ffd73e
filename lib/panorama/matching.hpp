#pragma once

#include <vector>

#include "lib/base/job.hpp"
#include "lib/panorama/features.hpp"
#include "lib/panorama/turn_lens.hpp"

namespace stx::panorama {

/// One direction that two pictures show, where each of them shows it (a TurnLens's units).
struct Match {
    glm::dvec2 a{0}, b{0};
};

/// What two pictures have in common.
struct Pair {
    int a = 0, b = 0;            ///< pictures, a < b
    std::vector<Match> matches;  ///< those that one rotation explains
    glm::dquat bFromA{1, 0, 0, 0};
};

/// Features of two pictures that are each other's nearest, and clearly nearer than the next.
[[nodiscard]] std::vector<Match> matchFeatures(const WorkCopy& copyA, const Features& a,
                                               const WorkCopy& copyB, const Features& b);

/// The rotation that most of the matches agree with, and those that do (RANSAC on two matches;
/// Fischler and Bolles 1981): at most `tolerance` apart. Few or none when nothing agrees.
[[nodiscard]] Pair agreeingMatches(const std::vector<Match>& matches, const TurnLens& lens,
                                   double tolerance);

/// The rotation that brings rays `a` nearest to rays `b`, least squares, from a start.
[[nodiscard]] glm::dquat turnOf(const std::vector<Match>& matches, const TurnLens& lensA,
                                const TurnLens& lensB, glm::dquat start);
[[nodiscard]] inline glm::dquat turnOf(const std::vector<Match>& matches, const TurnLens& lens,
                                       glm::dquat start) {
    return turnOf(matches, lens, lens, start);
}

struct PairSearch {
    std::vector<Pair> pairs;
    double focal = 1;  ///< that most matches agree with; halves of the diagonal
};

/// Looks for common features between all pictures, and for the focal length among `focals` with
/// which rotations explain most of them. Pairs with too few are left out. Errors: cancelled.
[[nodiscard]] Result<PairSearch> searchPairs(const std::vector<WorkCopy>& copies,
                                             const std::vector<Features>& features,
                                             const std::vector<double>& focals, Job& job);

}  // namespace stx::panorama
