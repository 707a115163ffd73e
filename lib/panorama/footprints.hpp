#pragma once

#include <algorithm>
#include <vector>

#include "lib/panorama/panorama.hpp"
#include "lib/panorama/turn_lens.hpp"

namespace stx::panorama {

/// A rectangle of an equirectangular grid around what a picture sees. Columns go on across the
/// grid's edge: column x is column x modulo the grid's width.
struct GridBox {
    int x = 0, y = 0, width = 0, height = 0;
};

/// The lens of one picture: that of all, but for its own focal length.
[[nodiscard]] TurnLens lensOf(const PanoramaAlignment& alignment, const PanoramaCamera& camera);

/// The box of a picture on a grid of `gridWidth` x gridWidth / 2 cells.
[[nodiscard]] GridBox boxOf(const PanoramaCamera& camera, const TurnLens& lens, int gridWidth);

/// A picture on a coarse equirectangular grid, where gains, seams and soft corrections are found.
struct Footprint {
    int picture = 0;
    GridBox box;
    Image<glm::vec3> colour;  ///< linear light, before gains; of cells that it sees
    /// How far inside of the picture: 0 = not seen, 1 = the middle.
    Image<float> inside;
    /// Square of the distance from the picture's middle, halves of its diagonal; of cells it sees.
    Image<float> radius2;
    /// The factor that makes up for the lens, which is darker towards its edge; empty = 1.
    Image<float> clearing;
    /// Cells that the picture fills wholly, so that seams may be in them.
    Image<std::uint8_t> whole;

    [[nodiscard]] float clearingAt(std::size_t cell) const {
        return clearing.empty() ? 1.0f : clearing.pixels()[cell];
    }
    /// Column of the box for one of the grid; -1 = not in the box.
    [[nodiscard]] int column(int gridX, int gridWidth) const {
        const int x = ((gridX - box.x) % gridWidth + gridWidth) % gridWidth;
        return x < box.width ? x : -1;
    }
};

/// Cells of a grid on which a picture of the series is about 160 wide, 256 to 2048, even and no
/// more than the panorama has.
[[nodiscard]] int gridWidthFor(const PanoramaAlignment& alignment, int panoramaWidth);

/// Footprints of all used pictures. Errors: those of the source; cancelled.
[[nodiscard]] Result<std::vector<Footprint>> footprintsOf(PictureSource& source,
                                                          const PanoramaAlignment& alignment,
                                                          int gridWidth, Job& job);

/// The vignetting that explains how pictures differ where they overlap, least squares over the
/// logarithms of their light's ratios, with weights that leave out what moved (Goldman 2010, with
/// an even polynomial). None where it is weak, where it explains little, or where the upper and
/// lower halves of overlaps do not say the same.
[[nodiscard]] Vignetting findVignetting(const std::vector<Footprint>& footprints, int gridWidth);

/// Sets Footprint::clearing by a vignetting.
void clearVignetting(std::vector<Footprint>& footprints, const Vignetting& vignetting);

/// Gains of linear light that make pictures agree where they overlap, least squares over the
/// medians of pairs, no gain in the mean; of each footprint.
[[nodiscard]] std::vector<glm::dvec3> findGains(const std::vector<Footprint>& footprints,
                                                int gridWidth);

/// Linear light with a gain. What is clipped in the picture stays white when it is made darker:
/// above kNearlyClipped of white gains below 1 lose their effect, and at white they have none.
inline constexpr float kNearlyClipped = 0.7f;
[[nodiscard]] inline glm::vec3 withGain(glm::vec3 light, glm::vec3 gain) {
    const float highest = std::max(light.r, std::max(light.g, light.b));
    const float t = std::clamp((highest - kNearlyClipped) / (1 - kNearlyClipped), 0.0f, 1.0f);
    return light * glm::mix(gain, glm::max(gain, glm::vec3(1)), t * t * (3 - 2 * t));
}

/// Linear light without the picture's vignetting (see Vignetting::clearing()). The brightest become
/// less brighter, so that clouds near corners keep their shades: what is not white stays below it.
[[nodiscard]] inline glm::vec3 cleared(glm::vec3 light, float clearing) {
    const float highest = std::max(light.r, std::max(light.g, light.b));
    const float squared = highest * highest;
    return light * (clearing / (1 + (clearing - 1) * squared * squared));
}

/// The light that cleared() makes this of: as dark as the lens makes it there.
[[nodiscard]] inline glm::vec3 uncleared(glm::vec3 light, float clearing) {
    const float highest = std::max(light.r, std::max(light.g, light.b));
    if (!(highest > 0)) return light;
    // Bisection: to a 65536th of white, below the finest codes.
    constexpr int kHalvings = 16;
    float low = 0, high = 1;
    for (int halving = 0; halving < kHalvings; ++halving) {
        const float middle = 0.5f * (low + high);
        (cleared(glm::vec3(middle), clearing).r < highest ? low : high) = middle;
    }
    return light * (low / highest);
}

/// For each cell the index of the footprint to show, -1 = none: seams run where pictures agree
/// (alpha expansion; Boykov, Veksler and Zabih 2001, with the cost of Kwatra et al. 2003). Edges of
/// what is seen are extended by two cells.
[[nodiscard]] Result<Image<int>> findSeams(const std::vector<Footprint>& footprints,
                                           const std::vector<glm::dvec3>& gains, int gridWidth,
                                           bool hideSeams, Job& job);

/// What is left of differences in light: by how much the light of each footprint is to be
/// multiplied, on its box, so that pictures melt into each other where `labels` (of findSeams()) go
/// from one to the other. Two bands, as in Burt and Adelson (1983): light is mixed over an eighth
/// of a picture and as far as both look, details change at the seam.
[[nodiscard]] std::vector<Image<glm::vec3>> findCorrections(
    const std::vector<Footprint>& footprints, const std::vector<glm::dvec3>& gains,
    const Image<int>& labels);

}  // namespace stx::panorama
