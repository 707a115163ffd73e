#pragma once

#include <vector>

#include "lib/panorama/matching.hpp"

namespace stx::panorama {

/// All that is looked for: where each picture looked, and through which lens.
struct TurnModel {
    std::vector<glm::dquat> worldFromCamera;  ///< of each picture
    std::vector<bool> known;                  ///< pictures that are part of the whole
    TurnLens lens;
};

struct AdjustSettings {
    double pixel = 1e-3;     ///< of the pictures as they were matched, halves of the diagonal
    double huberPixels = 2;  ///< beyond this, differences count linearly (Huber 1964)
    bool fixFocal = false;
    bool fixDistortion = false;
    double expectedFocal = 1;  ///< where pictures cannot tell, it stays near this
    double focalSpread = 0.3;  ///< how near: standard deviation of the logarithm
    /// Differences that matches have, pixels: the less, the less what is expected counts.
    double noisePixels = 1;
    int iterations = 40;
};

/// Block adjustment (Shum and Szeliski 2000; Brown and Lowe 2007): moves all known rotations, the
/// focal length and k1 together so that matches of all pairs fall onto each other in the pictures
/// (Levenberg-Marquardt). The first known picture stays. Gives the cost, squared pixels.
double adjust(TurnModel& model, const std::vector<Pair>& pairs, const AdjustSettings& settings);

/// Where b sees what a saw at `p`; nothing when it is behind b.
[[nodiscard]] std::optional<glm::dvec2> seenBy(const TurnModel& model, int a, int b, glm::dvec2 p);

/// How far apart a match is, in pixels of `pixel`: the mean of both pictures; a large number when
/// it cannot be seen.
[[nodiscard]] double differenceOf(const TurnModel& model, const Pair& pair, const Match& match,
                                  double pixel);

}  // namespace stx::panorama
