#include "lib/model/light_ratio.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace stx {
namespace {

// Chosen by trial on rooms whose light drifts.
/// Colours that differ by more from what a ratio explains are of something else, in each round.
constexpr std::array<float, 4> kOutlier = {0.16f, 0.08f, 0.05f, 0.03f};
/// Too dark or too bright to tell light.
constexpr float kDarkest = 0.03f, kBrightest = 0.97f;
/// Fewer pairs than these tell no light.
constexpr int kFewPairs = 50;
constexpr float kMostRatio = 2;

}  // namespace

glm::vec3 lightRatio(std::span<const LitPair> pairs) {
    glm::vec3 ratio(1.0f);
    for (int channel = 0; channel < 3; ++channel) {
        // A quotient of sums is not drawn to whole steps as a median of quotients is.
        for (const float outlier : kOutlier) {
            double sumA = 0, sumB = 0;
            int count = 0;
            for (const LitPair& p : pairs) {
                const float a = p.a[channel], b = p.b[channel];
                if (!(a > kDarkest && b > kDarkest && a < kBrightest && b < kBrightest)) continue;
                if (std::abs(b - ratio[channel] * a) > outlier) continue;
                sumA += a;
                sumB += b;
                ++count;
            }
            if (count < kFewPairs) break;
            ratio[channel] =
                std::clamp(static_cast<float>(sumB / sumA), 1 / kMostRatio, kMostRatio);
        }
    }
    return ratio;
}

}  // namespace stx
