#pragma once

#include <array>
#include <vector>

#include "lib/panorama/adjust.hpp"

namespace stx::panorama {

/// Luma of a work copy at three sizes, slightly smoothed: 1, 1/2, 1/4.
using Pyramid = std::array<Image<float>, 3>;
[[nodiscard]] Pyramid pyramidOf(const Image<std::uint8_t>& grey);

struct PatchSettings {
    int most = 120;       ///< patches of a pair, half of them around features of either picture
    double reach = 6;     ///< pixels of the work copy that the model may be wrong by
    double alike = 0.88;  ///< correlation of two patches that show the same
};

/// Matches of two pictures to a twentieth of a pixel: patches around features of one, drawn as the
/// model says that the other shows them, are moved until they are most alike (Lucas and Kanade
/// 1981; the patches of Shum and Szeliski 2000). Gain and offset of the light do not matter.
[[nodiscard]] std::vector<Match> alignPatches(const std::vector<WorkCopy>& copies,
                                              const std::vector<Pyramid>& pyramids,
                                              const std::vector<Features>& features,
                                              const TurnModel& model, int a, int b,
                                              const PatchSettings& settings);

}  // namespace stx::panorama
