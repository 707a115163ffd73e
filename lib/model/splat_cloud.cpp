#include "lib/model/splat_cloud.hpp"

#include <algorithm>
#include <cmath>

#include <glm/gtc/packing.hpp>
#include <glm/gtc/quaternion.hpp>

namespace stx {
namespace {

/// Beyond it squares of sizes in pixels are more than doubles hold; nothing that is meant is so
/// large.
constexpr float kLargest = 1e15f;

/// The alpha to which a splat counts for what a cloud reaches. Where pictures have depth, an alpha
/// of one half, is further out than where one splat alone has that: of seven clouds of 9 to 1000
/// splats framed so 0.5 to 7 % of the side are cut off, with 0.25 0.5 % of one cloud, with 0.15
/// nothing, but nearly twice as much stays free around the others (by the centres alone 4 to 28 %
/// are cut off).
constexpr double kEdge = 0.25;
/// Or, if that is more, this share of its opacity: the same for one of an opacity of one half, from
/// which on it gives pictures depth alone.
constexpr double kEdgeOfFaint = 0.5;

bool finite(glm::vec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

void SplatCloud::setHarmonic(std::size_t splat, int coefficient, int channel, float value) {
    const auto padded = static_cast<std::size_t>(paddedCount(degree));
    harmonics[(splat * 3 + static_cast<std::size_t>(channel)) * padded +
              static_cast<std::size_t>(coefficient)] = glm::packHalf1x16(value);
}

double SplatCloud::mostReach(std::size_t i) const {
    const glm::dvec3 size(scales[i]);
    return std::sqrt(2.0 * std::log(1.0 / kEdge)) * std::max({size.x, size.y, size.z});
}

glm::dmat3 SplatCloud::reach(std::size_t i) const {
    const double deviations =
        std::sqrt(2.0 * std::log(std::max(opacities[i] / kEdge, 1.0 / kEdgeOfFaint)));
    const glm::dvec4 q(rotations[i]);
    glm::dmat3 axes = glm::mat3_cast(glm::dquat(q.w, q.x, q.y, q.z));
    for (int k = 0; k < 3; ++k) axes[k] *= static_cast<double>(scales[i][k]);
    glm::dmat3 covariance = axes * glm::transpose(axes);
    for (int k = 0; k < 3; ++k) {
        const double along = std::sqrt(covariance[k][k]);
        covariance[k] *= along > 0 ? deviations / along : 0.0;
    }
    return covariance;
}

Result<void> SplatCloud::resize(std::size_t count, int degreeToHold, const Limits& limits) {
    STX_CHECK(limits.checkAllocation(count, bytesEach(degreeToHold), "the splats"));
    degree = degreeToHold;
    positions.resize(count);
    scales.resize(count);
    rotations.resize(count);
    opacities.resize(count);
    colours.resize(count);
    harmonics.resize(count * 3 * static_cast<std::size_t>(paddedCount(degree)));
    return {};
}

bool SplatCloud::isSound(std::size_t i) const {
    const glm::vec3 size = scales[i];
    const double length = glm::length(glm::dvec4(rotations[i]));
    if (!finite(positions[i]) || !finite(size) || !finite(colours[i]) ||
        !glm::all(glm::greaterThanEqual(size, glm::vec3(0.0f))) ||
        !glm::all(glm::lessThanEqual(size, glm::vec3(kLargest))) || !std::isfinite(length) ||
        !(length > 1e-12) || !(opacities[i] >= 0.0f))
        return false;
    // Half floats that are infinite or no number have all bits of their exponent.
    const auto own = static_cast<std::size_t>(paddedCount(degree)) * 3;
    return std::all_of(harmonics.begin() + static_cast<std::ptrdiff_t>(i * own),
                       harmonics.begin() + static_cast<std::ptrdiff_t>((i + 1) * own),
                       [](std::uint16_t h) { return (h & 0x7c00) != 0x7c00; });
}

Result<void> SplatCloud::dropBroken(Job& job) {
    const std::size_t count = positions.size();
    const auto padded = static_cast<std::size_t>(paddedCount(degree)) * 3;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (!isSound(i)) continue;
        positions[kept] = positions[i];
        scales[kept] = scales[i];
        const glm::dvec4 turn(rotations[i]);
        rotations[kept] = glm::vec4(turn / glm::length(turn));
        opacities[kept] = std::min(opacities[i], 1.0f);
        colours[kept] = colours[i];
        if (kept != i)
            std::copy_n(harmonics.begin() + static_cast<std::ptrdiff_t>(i * padded), padded,
                        harmonics.begin() + static_cast<std::ptrdiff_t>(kept * padded));
        ++kept;
    }
    if (count == 0)
        return fail(ErrorCode::invalidInput, "there are no splats; at least one is expected");
    if (kept == 0)
        return fail(ErrorCode::invalidInput,
                    "none of the {} splats can be drawn; finite positions, rotations, opacities "
                    "and colours, and sizes of at most {:g} are expected",
                    count, kLargest);
    if (kept == count) return {};
    job.note(fmt::format(
        "{} of {} splats left out: a value is not finite, a size is below 0 or above {:g}, an "
        "opacity is below 0 or a rotation has no length",
        count - kept, count, kLargest));
    positions.resize(kept);
    scales.resize(kept);
    rotations.resize(kept);
    opacities.resize(kept);
    colours.resize(kept);
    harmonics.resize(kept * padded);
    return {};
}

}  // namespace stx
