#include "lib/model/splat_cloud.hpp"

#include <cmath>

#include <glm/gtc/packing.hpp>

namespace stx {
namespace {

/// Beyond it squares of sizes in pixels are more than doubles hold; nothing that is meant is so
/// large.
constexpr float kLargest = 1e15f;

bool finite(glm::vec3 v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace

void SplatCloud::setHarmonic(std::size_t splat, int coefficient, int channel, float value) {
    const auto padded = static_cast<std::size_t>(paddedCount(degree));
    harmonics[(splat * 3 + static_cast<std::size_t>(channel)) * padded +
              static_cast<std::size_t>(coefficient)] = glm::packHalf1x16(value);
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

Result<void> SplatCloud::dropBroken(Job& job) {
    const std::size_t count = positions.size();
    const auto padded = static_cast<std::size_t>(paddedCount(degree)) * 3;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 size = scales[i];
        const glm::dvec4 turn(rotations[i]);
        const double length = std::sqrt(glm::dot(turn, turn));
        bool sound = finite(positions[i]) && finite(size) && finite(colours[i]) &&
                     glm::all(glm::greaterThanEqual(size, glm::vec3(0.0f))) &&
                     glm::all(glm::lessThanEqual(size, glm::vec3(kLargest))) &&
                     std::isfinite(length) && length > 1e-12 && opacities[i] >= 0.0f;
        // Half floats that are infinite or no number have all bits of their exponent.
        for (std::size_t h = i * padded; sound && h < (i + 1) * padded; ++h)
            sound = (harmonics[h] & 0x7c00) != 0x7c00;
        if (!sound) continue;
        positions[kept] = positions[i];
        scales[kept] = size;
        rotations[kept] = glm::vec4(turn / length);
        opacities[kept] = std::min(opacities[i], 1.0f);
        colours[kept] = colours[i];
        if (kept != i)
            std::copy_n(harmonics.begin() + static_cast<std::ptrdiff_t>(i * padded), padded,
                        harmonics.begin() + static_cast<std::ptrdiff_t>(kept * padded));
        ++kept;
    }
    if (kept == 0)
        return fail(ErrorCode::invalidInput,
                    "none of the {} splats can be drawn; finite positions, sizes, rotations, "
                    "opacities and colours are expected",
                    count);
    if (kept == count) return {};
    job.note(fmt::format(
        "{} of {} splats left out: a value is not finite, a size or opacity is below 0 or a "
        "rotation has no length",
        count - kept, count));
    positions.resize(kept);
    scales.resize(kept);
    rotations.resize(kept);
    opacities.resize(kept);
    colours.resize(kept);
    harmonics.resize(kept * padded);
    return {};
}

}  // namespace stx
