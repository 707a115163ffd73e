#pragma once

#include <cmath>
#include <vector>

#include "lib/panorama/matching.hpp"

namespace stx::panorama {

/// All that is looked for: where each picture looked, and through which lens.
struct TurnModel {
    std::vector<glm::dquat> worldFromCamera;  ///< of each picture
    std::vector<bool> known;                  ///< pictures that are part of the whole
    TurnLens lens;
    /// Logarithm of each picture's focal length over the lens's, of a camera that focused anew;
    /// empty = 0.
    std::vector<double> stretch;

    /// The lens of one picture. What it distorts stays where it is in the picture.
    [[nodiscard]] TurnLens lensOf(int k) const {
        if (stretch.empty()) return lens;
        const double factor = std::exp(stretch[k]);
        return {lens.focal * factor, lens.k1 * factor * factor};
    }
};

struct AdjustSettings {
    double pixel = 1e-3;     ///< size of a pixel of the work copies, halves of the diagonal
    double huberPixels = 2;  ///< beyond this, differences count linearly (Huber 1964)
    /// Beyond that they count by their logarithm, as Cauchy's distribution has them: what half of
    /// the matches agree on wins, once it is near.
    bool cauchy = false;
    bool fixFocal = false;
    bool fixDistortion = false;
    bool ownFocals = false;    ///< each picture has its own focal length, near to that of all
    double expectedFocal = 1;  ///< where pictures cannot tell, it stays near this
    double focalSpread = 0.3;  ///< how near: standard deviation of the logarithm
    /// Differences that matches have, pixels: the less, the less what is expected counts.
    double noisePixels = 1;
    int iterations = 40;  ///< steps at most
};

/// Block adjustment (Shum and Szeliski 2000; Brown and Lowe 2007): moves all known rotations, the
/// focal length (or all of them) and k1 together so that matches of all pairs fall onto each other
/// in the pictures (Levenberg-Marquardt). The first known picture stays. Gives the cost, squared
/// pixels.
double adjust(TurnModel& model, const std::vector<Pair>& pairs, const AdjustSettings& settings);

/// Where b sees what a saw at `p`; nothing when it is behind b.
[[nodiscard]] std::optional<glm::dvec2> seenBy(const TurnModel& model, int a, int b, glm::dvec2 p);

/// How far apart a match is, in pixels of `pixel`: the mean of both pictures; a large number when
/// it cannot be seen.
[[nodiscard]] double differenceOf(const TurnModel& model, const Pair& pair, const Match& match,
                                  double pixel);

}  // namespace stx::panorama
