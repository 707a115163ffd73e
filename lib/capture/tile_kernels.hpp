#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <glm/glm.hpp>

#include "lib/model/mesh.hpp"

/// The inner loops of the rasteriser, in vectors (Highway). Each does what its plain loop would do,
/// in the same order: the same bits on every processor.
namespace stx {

/// a x + b y + c over pixel positions.
struct Affine {
    double a = 0, b = 0, c = 0;
    [[nodiscard]] double at(double x, double y) const { return a * x + (b * y + c); }
};

/// Values that may lie behind the last sample of a tile, since vectors read and write whole.
constexpr std::size_t kSpanPadding = 8;

/// Samples of one line, at x = origin + i * step.
struct Span {
    int from = 0, to = 0;         ///< the first and the last
    double origin = 0, step = 0;  ///< pixels
    double slope = 0, base = 0;   ///< nearness is slope * x + base
    bool perspective = true;      ///< in front of the viewpoint it is above 0; else at most 0
    std::uint32_t slot = 0;       ///< whose samples they are
};

/// Where a sample is in front and nearer than `depth` there, its nearness goes there and its slot
/// to `ids`. Both hold kSpanPadding values more than `span.to` names.
void nearerSamples(const Span& span, float* depth, std::uint32_t* ids);

/// Samples of a line that are too few to be worth more than a plain loop.
constexpr int kFewSamples = 4;

/// Shrinks [from, to] to the samples of a line, at x = origin + i * step, that are inside three
/// edges (at least 0); false when none is.
[[nodiscard]] bool clipSpan(const Affine* edges, double y, double step, double origin, int& from,
                            int& to);

/// A triangle in the samples of a tile.
struct Patch {
    const Affine* edges = nullptr;  ///< three, at least 0 inside
    const Affine* nearness = nullptr;
    int left = 0, right = 0;  ///< samples that it may cover, the first and the last
    int top = 0, bottom = 0;
    double x = 0, y = 0, step = 0;  ///< where the first sample lies, and the next; pixels
    int side = 0;                   ///< samples of a line of the tile
    bool perspective = true;        ///< as in Span
    std::uint32_t slot = 0;
};

/// nearerSamples() of the samples inside all three edges. `depth` and `ids` are of the tile, line
/// by line, with kSpanPadding values behind the last.
void nearerInside(const Patch& patch, float* depth, std::uint32_t* ids);

/// Colours at the samples of a pixel, row by row.
struct PixelColours {
    alignas(64) std::array<float, 64> red, green, blue;  ///< of the samples; behind them anything
    [[nodiscard]] glm::vec3 at(int sample) const {
        return {red[sample], green[sample], blue[sample]};
    }
};

struct TextureSamples;

/// Where the samples of a pixel lie in it, row by row.
class PixelSamples {
  public:
    /// `side` samples along each axis, 1 to 8.
    explicit PixelSamples(int side);
    /// Sum over the samples of pixel (px, py) of what sampleTexture() gives at (u / total, v /
    /// total), without alpha; nothing where a sample is not between four texels of the texture.
    [[nodiscard]] std::optional<glm::vec3> sum(const MeshTexture& texture, const Affine& u,
                                               const Affine& v, const Affine& total, int px,
                                               int py) const;
    /// What sampleTexture() gives at the samples of pixel (px, py), where a triangle with these
    /// three edges and corners has barycentrics, as floats. False as above, and of samples outside
    /// the triangle, too.
    [[nodiscard]] bool colours(const MeshTexture& texture, const Affine* edges,
                               const std::array<glm::vec2, 3>& uvs, int px, int py,
                               PixelColours& out) const;

  private:
    bool colours(const MeshTexture& texture, TextureSamples& samples, int px, int py,
                 PixelColours& out) const;

    int count_;
    std::array<double, 64> x_{}, y_{};  ///< the last again behind the last
};

}  // namespace stx
