#include "lib/refine/mixed.hpp"

#include <atomic>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/geometry/like_steps.hpp"

namespace stx {
namespace {

/// A step between neighbours that is an edge, as a share of the distance: above the noise of depth
/// cameras (1.5 % at 4 m), below the edges that matter.
constexpr float kStepOfEdge = 0.025f;
/// How much larger than the slope of the surfaces beside it a step must be.
constexpr float kBeyondSlope = 3.0f;

/// Whether five samples in a row are of a slope around the third: its steps go on at both sides,
/// and beyond one of these. Between two surfaces the steps to them may be alike, those beyond are
/// not.
bool onSlope(float a2, float a, float z, float b, float b2) {
    if (!hasPoint(a) || !hasPoint(b)) return false;
    const float stepA = 1 / z - 1 / a, stepB = 1 / b - 1 / z;
    return likeSteps(stepA, stepB) && ((hasPoint(a2) && likeSteps(1 / a - 1 / a2, stepA)) ||
                                       (hasPoint(b2) && likeSteps(1 / b2 - 1 / b, stepB)));
}

}  // namespace

std::int64_t dropMixedPixels(Image<float>& distances) {
    const Image<float> before = distances;
    std::atomic<std::int64_t> dropped = 0;
    const auto get = [&](int x, int y) {
        return before.contains(x, y) ? before.at(x, y) : kNoDepth;
    };
    parallelForBlocks(0, before.height(), 32, [&](std::int64_t from, std::int64_t to) {
        std::int64_t here = 0;
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < before.width(); ++x) {
                const float z = before.at(x, y);
                if (!hasPoint(z)) continue;
                const float edge = kStepOfEdge * z;
                bool mixed = false, slope = false;
                int company = 0;
                static constexpr int kAxes[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
                for (const auto& axis : kAxes) {
                    const float a = get(x - axis[0], y - axis[1]);
                    const float b = get(x + axis[0], y + axis[1]);
                    company += hasPoint(a) && std::abs(a - z) <= edge;
                    company += hasPoint(b) && std::abs(b - z) <= edge;
                    if (!hasPoint(a) || !hasPoint(b)) continue;
                    const float stepA = z - a, stepB = b - z;
                    if (stepA * stepB <= 0 || std::abs(stepA) <= edge || std::abs(stepB) <= edge)
                        continue;
                    const float a2 = get(x - 2 * axis[0], y - 2 * axis[1]);
                    const float b2 = get(x + 2 * axis[0], y + 2 * axis[1]);
                    slope |= onSlope(a2, a, z, b, b2);
                    // Without either surface beside it, a steep one is as likely.
                    if (!hasPoint(a2) && !hasPoint(b2)) continue;
                    const float slopeA = hasPoint(a2) ? std::abs(a - a2) : 0.0f;
                    const float slopeB = hasPoint(b2) ? std::abs(b2 - b) : 0.0f;
                    mixed |= std::abs(stepA) > kBeyondSlope * slopeA &&
                             std::abs(stepB) > kBeyondSlope * slopeB;
                }
                if (mixed || (company == 0 && !slope)) {
                    distances.at(x, y) = kNoDepth;
                    ++here;
                }
            }
        }
        dropped += here;
    });
    return dropped;
}

}  // namespace stx
