#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lib/render/scene/page_set.hpp"

namespace stx::splat {

/// RectangleImages pixels are worked on in square blocks of this side.
inline constexpr int kBlock = 16;

/// Tilt of the surface at a pixel: change of dist per sample spacing, along x and down y (the
/// tangent of the angle to the image plane, along the line of sight), times kSlopeScale.
struct Slope {
    std::int16_t u = 0, v = 0;

    /// The lowest bit of u: of an opaque point, all four neighbours are opaque points of the same
    /// surface; of another, it is glass, which half of the pixel shows or more (glassCoverage()),
    /// and hides what is behind it whatever its alpha is. The lowest bit of v: the surface ends
    /// here, a neighbour lies behind or is empty.
    static constexpr int kLinked = 1, kGlass = 1, kRim = 1;
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
    bool glass = false;  ///< some of its points are glass
    /// Of each quarter (upper left, upper right, lower left, lower right), a bit for each view of
    /// PreparedRectangle::others that shows all its points, too. Of findOthers().
    std::array<std::uint16_t, 4> shownBy{};
    glm::vec3 middle{0.0f};  ///< in the world; of findOthers()
};

/// Views that may show what a rectangle shows: their directions from a point of the world are
/// `at` * point - (x, y, z), of no certain length.
struct Others {
    static constexpr std::size_t kMost = 16;
    /// Those that are not there are at (1, 0, 0), in all directions.
    std::array<float, kMost> x = filled(1.0f), y{}, z{}, at{};

    void set(std::size_t number, glm::vec4 view) {
        x[number] = view.x;
        y[number] = view.y;
        z[number] = view.z;
        at[number] = view.w;
    }

  private:
    static std::array<float, kMost> filled(float value) {
        std::array<float, kMost> out{};
        out.fill(value);
        return out;
    }
};

/// What is known of each texel of a page before any camera is. Arrays of one value per texel.
struct PreparedPage {
    Pixels<Slope> slopes;
    Pixels<glm::i8vec4> normals;   ///< in the world, * 127; empty when not needed
    Pixels<std::uint8_t> sizes;    ///< splat sizes * 64 where the file gives them, else empty
    std::uint32_t firstPoint = 0;  ///< number of texel 0, counted over all pages
};

/// A rectangle of a PageSet and its blocks, in pixels of PageRectangle::window.
struct PreparedRectangle {
    const PageRectangle* rectangle = nullptr;
    std::vector<BlockInfo> blocks;  ///< those that hold points
    Others others;                  ///< of findOthers()

    [[nodiscard]] const Camera& camera() const { return rectangle->window; }
};

/// A PageSet made ready for splatting; its images stay where they are.
struct PreparedPages {
    std::vector<PreparedPage> pages;
    std::vector<PreparedRectangle> rectangles;
    double radius = 0;   ///< of the scene, scene units
    bool glass = false;  ///< some block has glass
};

/// Tilts from splatU x splatV, else the normals, else the neighbours' depths (never over a depth
/// discontinuity), sizes, block tables, and normals when asked for.
[[nodiscard]] PreparedPages preparePages(const PageSet& set, bool wantNormals);

}  // namespace stx::splat
