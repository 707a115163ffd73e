#include "lib/render/surface/prepare/rims.hpp"

#include <bit>
#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx::surface {
namespace {

// Chosen on one view of each of five pairs of Middlebury, drawn at the other's place (dB of Y, in
// the order Books, Dolls, Laundry, Cones, Teddy; without rims 31.18, 34.11, 31.00, 31.23, 33.73),
// before kBehindRim was less than kLinkedSamples.

/// A pixel belongs to the front by this share at least: 0.5, 0.8, 0.9 and 0.97 give 31.17, 33.94,
/// 30.83, 31.48, 34.23; 31.15, 34.04, 30.90, 31.53, 34.17; 31.15, 34.08, 30.94, 31.52, 34.08; and
/// 31.15, 34.10, 30.95, 31.49, 34.05.
constexpr float kFront = 0.9f;
/// The colours of front and back are read so many pixels away from those at the edge, which the
/// camera's optics mix. 1 and 3 differ by 0.05 dB at most.
constexpr int kIntoSurface = 2;
/// Colours that differ by less (length over R, G and B, of 1) do not tell; then the pixel counts as
/// the front's. Half of it changes nothing.
constexpr float kContrast = 40.0f / 255.0f;

class Rims {
  public:
    Rims(const Source& s, const Draft& d)
        : s_(s), d_(d), own_(s.whole ? Texture() : s.set->textureOfView(s.number)) {}

    /// Whether the colour of a pixel at an edge is that of its own surface towards all neighbours
    /// that lie behind it.
    [[nodiscard]] bool isRim(glm::ivec2 p) const {
        float share = 0, asked = 0;
        for (const glm::ivec2 step : {glm::ivec2(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
            if (!isBefore(p, step)) continue;
            const glm::ivec2 inside = p - kIntoSurface * step,
                             behind = p + (kIntoSurface + 1) * step;
            if (!onSurface(inside, p) || !onSurface(behind, p + step)) continue;
            const glm::vec3 back = colour(behind), axis = colour(inside) - back;
            const float length = glm::dot(axis, axis);
            if (length < kContrast * kContrast) continue;
            share += glm::clamp(glm::dot(colour(p) - back, axis) / length, 0.0f, 1.0f);
            asked += 1;
        }
        return share >= kFront * asked;
    }

  private:
    /// The neighbour lies on another surface, behind the pixel's.
    [[nodiscard]] bool isBefore(glm::ivec2 p, glm::ivec2 step) const {
        const glm::ivec2 to = p + step, first = glm::min(p, to);
        if (!s_.contains(to.x, to.y)) return false;
        const bool linked = step.x ? d_.linkRight(first.x, first.y) : d_.linkDown(first.x, first.y);
        const float q = d_.q.at(to.x, to.y);
        return !linked && q > 0 && q < d_.q.at(p.x, p.y);
    }
    [[nodiscard]] bool onSurface(glm::ivec2 p, glm::ivec2 of) const {
        if (!s_.contains(p.x, p.y)) return false;
        const float q = d_.q.at(p.x, p.y), there = d_.q.at(of.x, of.y);
        return q > 0 && std::abs(q - there) < s_.space.axis.relativeScale(there) * kLinkedSamples;
    }
    [[nodiscard]] glm::vec3 colour(glm::ivec2 p) const {
        return glm::vec3((s_.whole ? *s_.whole->texture : own_).at(p.x, p.y));
    }

    const Source& s_;
    const Draft& d_;
    const Texture own_;  ///< of a view in rectangles
};

}  // namespace

void findRims(Source& s, const Draft& d) {
    const Rims rims(s, d);
    parallelFor(0, s.blocksY, [&](std::int64_t by) {
        for (int bx = 0; bx < s.blocksX; ++bx) {
            SourceBlock& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
            for (int j = 0; block.anyEdge && j < kBlock; ++j) {
                for (unsigned left = block.edges[j]; left; left &= left - 1) {
                    const int i = std::countr_zero(left);
                    const glm::ivec2 p(bx * kBlock + i, static_cast<int>(by) * kBlock + j);
                    if (d.info.at(p.x, p.y) & Info::kBesideBackground) continue;
                    if (rims.isRim(p)) block.rims[j] |= static_cast<std::uint16_t>(1u << i);
                }
            }
        }
    });
}

}  // namespace stx::surface
