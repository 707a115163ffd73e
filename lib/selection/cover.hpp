#pragma once

#include <cstdint>
#include <vector>

namespace stx {

/// What one view sees of one surface sample.
struct CoverItem {
    std::uint32_t sample = 0;
    float quality = 0;  ///< 0..1
};

/// Views to choose among, and what a set S of them is worth: F(S) = sum over samples of weight *
/// max over views in S of quality. F is monotone and submodular, so that a greedy choice is near
/// the best (Nemhauser, Wolsey and Fisher 1978).
struct CoverProblem {
    std::vector<double> weights;                ///< area of each sample
    std::vector<std::vector<CoverItem>> views;  ///< per view its samples, ascending
};

struct CoverSolution {
    std::vector<int> chosen;     ///< views, the most valuable first
    std::vector<double> values;  ///< F after each of them
    double all = 0;              ///< F of all views together
    /// No choice of as many views has an F above this.
    double bound = 0;
};

/// Chooses views by lazy greedy, then exchanges chosen for unchosen ones while that helps. Stops at
/// `most` views, or when F reaches `share` of F(all), or when no view adds anything. Where a share
/// below 1 is reached, a view less is tried in the same way as long as that reaches it, too. Ties
/// go to the lower index; the result is the same on any number of threads.
[[nodiscard]] CoverSolution chooseCover(const CoverProblem& problem, int most, double share);

}  // namespace stx
