#pragma once

#include <vector>

#include "lib/panorama/adjust.hpp"
#include "lib/panorama/order.hpp"

namespace stx::panorama {

inline constexpr double kDegree = M_PI / 180;

/// A camera that turned around the vertical axis by equal steps, one picture each; radians.
inline TurnModel turnedBy(double step, int pictures, TurnLens lens) {
    TurnModel model;
    model.lens = lens;
    for (int k = 0; k < pictures; ++k) {
        model.worldFromCamera.push_back(glm::angleAxis(step * k, glm::dvec3(0, 1, 0)));
        model.known.push_back(true);
    }
    return model;
}

/// Where both pictures show the same, on a grid of 9 x 7 positions of `a`, without any error.
inline Pair exactPair(const TurnModel& truth, int a, int b) {
    Pair pair;
    pair.a = a;
    pair.b = b;
    pair.bFromA = glm::inverse(truth.worldFromCamera[static_cast<std::size_t>(b)]) *
                  truth.worldFromCamera[static_cast<std::size_t>(a)];
    for (int y = -3; y <= 3; ++y)
        for (int x = -4; x <= 4; ++x) {
            const glm::dvec2 p(0.19 * x, 0.19 * y);
            const auto seen = seenBy(truth, a, b, p);
            if (seen && std::abs(seen->x) < 0.8 && std::abs(seen->y) < 0.6)
                pair.matches.push_back({p, *seen});
        }
    return pair;
}

/// The largest angle between the turns of a model and the true ones, from the first picture,
/// degrees.
inline double worstTurn(const TurnModel& found, const TurnModel& truth) {
    double worst = 0;
    const auto fromFirst = [](const TurnModel& m, std::size_t k) {
        return glm::inverse(m.worldFromCamera[0]) * m.worldFromCamera[k];
    };
    for (std::size_t k = 0; k < truth.worldFromCamera.size(); ++k)
        worst = std::max(worst, angleBetween(fromFirst(found, k), fromFirst(truth, k)));
    return worst / kDegree;
}

}  // namespace stx::panorama
