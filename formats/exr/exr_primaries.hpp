#pragma once

#include <optional>

#include <glm/glm.hpp>

namespace stx {

/// The chromaticities (CIE 1931 x, y) of R, G and B, and of the white that they make together.
struct Primaries {
    glm::dvec2 red{0.64, 0.33}, green{0.30, 0.60}, blue{0.15, 0.06}, white{0.3127, 0.3290};
};

/// What linear R, G, B of these primaries are multiplied with to be of Rec. 709, white to white:
/// through the CIE XYZ of both (SMPTE RP 177), adapted by Bradford's matrix (Lam 1985) where the
/// whites differ. Empty where no mix of the primaries gives the white.
[[nodiscard]] std::optional<glm::dmat3> rec709From(const Primaries& primaries);

}  // namespace stx
