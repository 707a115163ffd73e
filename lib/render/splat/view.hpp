#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lib/model/bundle.hpp"

namespace stx::splat {

/// Source pixels are worked on in square blocks of this side.
inline constexpr int kBlock = 16;

/// Tilt of the surface at a pixel: change of dist per sample spacing, along x and down y (the
/// tangent of the angle to the image plane, along the line of sight), times kSlopeScale.
struct Slope {
    std::int16_t u = 0, v = 0;

    /// The lowest bit of u: all four neighbours are opaque points of the same surface. The lowest
    /// bit of v: the surface ends here, a neighbour lies behind or is empty.
    static constexpr int kLinked = 1, kRim = 1;
};
inline constexpr float kSlopeScale = 2048.0f;

/// What is known of a block of source pixels before any camera is.
struct BlockInfo {
    std::uint16_t u0 = 0, v0 = 0, u1 = 0, v1 = 0;  ///< pixels, u1 and v1 one past the last
    float zMin = 0, zMax = 0;                      ///< of its points
    Slope slopeMin, slopeMax;
    float size = 1;      ///< largest size of its splats, relative to what closes the lattice
    bool linked = true;  ///< all its points are linked
    bool opaque = true;  ///< all its points have full alpha
};

/// A reference view made ready for splatting; its images stay in the bundle.
struct ViewInfo {
    const ReferenceView* view = nullptr;
    std::vector<Slope> slopes;  ///< one per pixel
    std::vector<glm::i8vec4>
        normals;                      ///< world normals * 127, one per pixel; empty when not needed
    std::vector<std::uint8_t> sizes;  ///< splat sizes * 64 where the file says them, else empty
    std::vector<BlockInfo> blocks;    ///< those that hold points
    std::uint32_t firstPoint = 0;     ///< of pixel 0, counted over all views
};

/// Tilts from splatU x splatV, else the normals, else the neighbours' depths (never over a depth
/// discontinuity), sizes, block tables, and normals when asked for.
[[nodiscard]] std::vector<ViewInfo> prepareViews(const Bundle& bundle, bool wantNormals);

}  // namespace stx::splat
