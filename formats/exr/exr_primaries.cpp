#include "formats/exr/exr_primaries.hpp"

#include <cmath>
#include <limits>

namespace stx {
namespace {

glm::dvec3 xyz(glm::dvec2 xy) {
    return {xy, 1 - xy.x - xy.y};
}

/// XYZ of a white of luminance 1.
glm::dvec3 whiteOf(const Primaries& p) {
    return xyz(p.white) / p.white.y;
}

std::optional<glm::dmat3> xyzFromRgb(const Primaries& p) {
    const glm::dmat3 directions(xyz(p.red), xyz(p.green), xyz(p.blue));
    const glm::dvec3 shares = glm::inverse(directions) * whiteOf(p);
    // Numbers that are none fail here, too.
    for (int k = 0; k < 3; ++k)
        if (!(shares[k] > 0 && shares[k] < std::numeric_limits<double>::infinity())) return {};
    return glm::dmat3(directions[0] * shares[0], directions[1] * shares[1],
                      directions[2] * shares[2]);
}

}  // namespace

std::optional<glm::dmat3> rec709From(const Primaries& primaries) {
    const Primaries rec709;
    const auto from = xyzFromRgb(primaries), to = xyzFromRgb(rec709);
    if (!from || !to) return {};
    // Columns of the matrix that gives the answers of the eye's cones.
    const glm::dmat3 cones(0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367,
                           1.0296);
    const glm::dvec3 gain = (cones * whiteOf(rec709)) / (cones * whiteOf(primaries));
    const glm::dmat3 scale(gain.x, 0, 0, 0, gain.y, 0, 0, 0, gain.z);
    const glm::dmat3 out = glm::inverse(*to) * glm::inverse(cones) * scale * cones * *from;
    // A white that no eye answers to.
    for (int k = 0; k < 3; ++k)
        if (!std::isfinite(glm::dot(out[k], glm::dvec3(1)))) return {};
    return out;
}

}  // namespace stx
