#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/geometry/bounds.hpp"
#include "lib/model/mesh.hpp"

namespace stx {

/// A drawn piece of an object, for findStrays(): a point, or the box of a triangle.
struct Piece {
    glm::dvec3 min{0.0};
    glm::dvec3 max{0.0};
};

/// Pieces that lie far outside of the rest: outliers of a scan, dust of a modelling program.
struct Strays {
    Bounds bounds;                      ///< of all other pieces
    std::vector<std::uint64_t> pieces;  ///< numbers of the strays, rising
    glm::dvec3 farthest{0.0};           ///< of the strays, the one farthest from `bounds`
};

/// The core of an object is the box, widened on each side by ten times its largest side, that holds
/// 99 in 100 of its pieces on each axis. A stray lies outside of it and is smaller than the core;
/// one in a thousand pieces may be strays, else there are none (then it is the object's shape).
[[nodiscard]] Strays findStrays(std::uint64_t count,
                                const std::function<Piece(std::uint64_t)>& piece);

/// The same of a mesh: its triangles, then its points. Bounds of splats hold what
/// SplatCloud::reach() says.
[[nodiscard]] Strays findStrays(const Mesh& mesh);

/// "2 of 60000 points lie far outside of the rest, the farthest at 1000000 0 0: …"; `shift` is
/// added to the place.
void noteStrays(const Strays& strays, std::uint64_t count, const char* what, glm::dvec3 shift,
                Job& job);

/// Takes the strays out of a mesh; its vertices stay, and splats become transparent in a copy of
/// their cloud. Errors (invalidInput): that copy is over the memory limit.
[[nodiscard]] Result<void> dropStrays(Mesh& mesh, const Strays& strays, const Limits& limits);

}  // namespace stx
