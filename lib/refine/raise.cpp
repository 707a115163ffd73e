#include "lib/refine/raise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/refine/raise_specks.hpp"
#include "lib/refine/raise_surfaces.hpp"

namespace stx {
namespace {

/// Neighbours on different surfaces: what it costs, and how little of that where their colours
/// differ by more than kEdgeColour (of 0..1), so that edges lie where the picture has some.
constexpr float kApart = 2.0f, kApartAnyway = 0.02f, kEdgeColour = 0.06f;
/// Shares of 1/z by which neighbours may differ for nothing, and from which on all is to be paid.
constexpr float kFreeStep = 0.005f, kFullStep = 0.035f;
/// Rounds of messages. Each goes two pixels far.
constexpr int kMessageRounds = 10;
/// Rows that are done at a time, and rows around them that are looked at.
constexpr int kStripRows = 128, kMarginRows = 16;

/// Neighbours that differ by more than the first and at most the second share of 1/z are brought
/// together with what is around them within a sample.
constexpr float kSmallStep = 0.003f, kLargestSmallStep = 0.012f;

/// Steps to the pixels to the right, left, below and above.
constexpr int kBeside[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};

using PerSurface = std::array<float, kRaisedSurfaces>;

/// A pixel at an edge.
struct RaisedPixel {
    int x = 0, y = 0, count = 0;
    PerSurface inverse{}, cost{};
    /// Pixels to the right, left, below and above that are at an edge, too, or -1; what it costs to
    /// be on another surface than they, and what they say of each of this pixel's surfaces.
    std::array<int, 4> beside{-1, -1, -1, -1};
    std::array<float, 4> apart{};
    std::array<PerSurface, 4> heard{};
};

float costOfStep(float a, float b) {
    const float most = std::max(a, b);
    if (most <= 0) return 0;
    return std::clamp((std::abs(a - b) / most - kFreeStep) / (kFullStep - kFreeStep), 0.0f, 1.0f);
}

/// Some rows of the picture.
class RaisedStrip {
  public:
    RaisedStrip(const CoarseDepth& coarse, const Texture& picture, int top, int bottom)
        : coarse_(coarse),
          picture_(picture),
          top_(top),
          index_(picture.width(), bottom - top, -1),
          inverse_(picture.width(), bottom - top) {}

    void run() {
        findPixelsAtEdges();
        for (RaisedPixel& pixel : pixels_) link(pixel);
        for (int half = 0; half < 2 * kMessageRounds; ++half)
            for (RaisedPixel& pixel : pixels_)
                if (((pixel.x + pixel.y + half) & 1) == 0) tell(pixel);
        for (const RaisedPixel& pixel : pixels_)
            inverse_.at(pixel.x, pixel.y - top_) = pixel.inverse[bestOf(pixel)];
    }

    [[nodiscard]] float depthAt(int x, int y) const {
        const float inverse = inverse_.at(x, y - top_);
        return inverse > 0 ? 1 / inverse : kNoDepth;
    }

  private:
    void findPixelsAtEdges() {
        const glm::dvec2 scale(1.0 * coarse_.width() / picture_.width(),
                               1.0 * coarse_.height() / picture_.height());
        // Pixels of one sample have the same surfaces around them.
        std::vector<SurfacesAround> ofRow(static_cast<std::size_t>(coarse_.width()));
        std::vector<int> rowOf(ofRow.size(), -1);
        for (int y = top_; y < top_ + index_.height(); ++y) {
            for (int x = 0; x < index_.width(); ++x) {
                const glm::dvec2 at = (glm::dvec2(x, y) + 0.5) * scale - 0.5;
                float inverse = 0;
                const bool one = coarse_.isOneSurface(at, inverse);
                inverse_.at(x, y - top_) = inverse;
                if (one) continue;
                const glm::ivec2 middle(
                    glm::clamp(glm::round(at), glm::dvec2(0),
                               glm::dvec2(coarse_.width() - 1, coarse_.height() - 1)));
                const auto k = static_cast<std::size_t>(middle.x);
                if (rowOf[k] != middle.y) {
                    rowOf[k] = middle.y;
                    ofRow[k] = coarse_.surfacesAround(middle.x, middle.y);
                }
                addPixel({x, y}, at, middle, ofRow[k]);
            }
        }
    }

    void addPixel(glm::ivec2 pixel, glm::dvec2 at, glm::ivec2 middle,
                  const SurfacesAround& around) {
        RaisedPixel out;
        out.x = pixel.x;
        out.y = pixel.y;
        out.count = around.count;
        const glm::vec2 off(at - glm::dvec2(middle));
        for (int k = 0; k < around.count; ++k) {
            const auto n = static_cast<std::size_t>(k);
            out.inverse[n] = around.surfaces[n].at(off.x, off.y);
        }
        if (around.count == 1) {
            inverse_.at(pixel.x, pixel.y - top_) = out.inverse[0];
            return;
        }
        out.cost = coarse_.costs(around, middle, at, glm::vec3(picture_.at(pixel.x, pixel.y)));
        index_.at(pixel.x, pixel.y - top_) = static_cast<int>(pixels_.size());
        pixels_.push_back(out);
    }

    /// Finds the neighbours of a pixel; of those on one surface it hears at once.
    void link(RaisedPixel& pixel) {
        const glm::vec3 own(picture_.at(pixel.x, pixel.y));
        for (std::size_t way = 0; way < 4; ++way) {
            const int x = pixel.x + kBeside[way][0], y = pixel.y + kBeside[way][1];
            if (!index_.contains(x, y - top_)) continue;
            const glm::vec3 unlike = glm::vec3(picture_.at(x, y)) - own;
            pixel.apart[way] = kApart * (kApartAnyway + std::exp(-glm::dot(unlike, unlike) /
                                                                 (2 * kEdgeColour * kEdgeColour)));
            pixel.beside[way] = index_.at(x, y - top_);
            if (pixel.beside[way] >= 0) continue;
            for (int k = 0; k < pixel.count; ++k) {
                const auto n = static_cast<std::size_t>(k);
                pixel.cost[n] +=
                    pixel.apart[way] * costOfStep(pixel.inverse[n], inverse_.at(x, y - top_));
            }
        }
    }

    static PerSurface costsOf(const RaisedPixel& pixel) {
        PerSurface sum = pixel.cost;
        for (const PerSurface& heard : pixel.heard)
            for (std::size_t n = 0; n < sum.size(); ++n) sum[n] += heard[n];
        return sum;
    }

    /// Says to each neighbour what each of its surfaces would cost here.
    void tell(const RaisedPixel& pixel) {
        const PerSurface sum = costsOf(pixel);
        for (std::size_t way = 0; way < 4; ++way) {
            if (pixel.beside[way] < 0) continue;
            RaisedPixel& other = pixels_[pixel.beside[way]];
            PerSurface& out = other.heard[way ^ 1];
            float least = std::numeric_limits<float>::max();
            for (int l = 0; l < other.count; ++l) {
                const auto m = static_cast<std::size_t>(l);
                float best = std::numeric_limits<float>::max();
                for (int k = 0; k < pixel.count; ++k) {
                    const auto n = static_cast<std::size_t>(k);
                    best = std::min(best, sum[n] - pixel.heard[way][n] +
                                              pixel.apart[way] *
                                                  costOfStep(pixel.inverse[n], other.inverse[m]));
                }
                out[m] = best;
                least = std::min(least, best);
            }
            for (int l = 0; l < other.count; ++l) out[l] -= least;
        }
    }

    static std::size_t bestOf(const RaisedPixel& pixel) {
        const PerSurface sum = costsOf(pixel);
        return static_cast<std::size_t>(std::min_element(sum.begin(), sum.begin() + pixel.count) -
                                        sum.begin());
    }

    const CoarseDepth& coarse_;
    const Texture& picture_;
    int top_;
    Image<int> index_;      ///< of pixels_, or -1
    Image<float> inverse_;  ///< 1/z; 0: no depth
    std::vector<RaisedPixel> pixels_;
};

/// By how much two distances or two of their inverses differ, share of the larger.
float shareApart(float a, float b) {
    return std::abs(a - b) / std::max(a, b);
}

/// The pixels with a depth that are within `reach` of a small step.
std::vector<std::int32_t> besideSmallSteps(const Image<float>& depth, int reach) {
    const int w = depth.width(), h = depth.height();
    Image<std::uint8_t> near(w, h, 0);
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            const float own = depth.at(x, y);
            // To the right and down: each pair once.
            for (const int way : {0, 2}) {
                const int dx = kBeside[way][0], dy = kBeside[way][1];
                if (!hasPoint(own) || !depth.contains(x + dx, y + dy)) continue;
                const float other = depth.at(x + dx, y + dy);
                if (!hasPoint(other)) continue;
                const float step = shareApart(own, other);
                if (step <= kSmallStep || step > kLargestSmallStep) continue;
                for (int v = std::max(0, y - reach); v <= std::min(h - 1, y + dy + reach); ++v)
                    for (int u = std::max(0, x - reach); u <= std::min(w - 1, x + dx + reach); ++u)
                        near.at(u, v) = 1;
            }
        }
    }
    std::vector<std::int32_t> list;
    for (std::size_t i = 0; i < near.count(); ++i)
        if (near.data()[i] != 0 && hasPoint(depth.data()[i]))
            list.push_back(static_cast<std::int32_t>(i));
    return list;
}

/// Makes slopes of steps between pixels of one surface: where some of them lie between samples and
/// others on a plane of their own, they need not meet. Renderers would cut a surface there, and
/// nothing is behind such a cut. Each round brings 1/z an eighth of the way to each neighbour.
void smoothSmallSteps(Image<float>& depth, int reach) {
    const std::vector<std::int32_t> list = besideSmallSteps(depth, reach);
    std::vector<float> inverse(list.size());
    const auto inverseAt = [&](int x, int y) { return 1 / depth.at(x, y); };
    for (int round = 0; round < 2 * reach; ++round) {
        parallelFor(0, list.size(), 1 << 14, [&](std::size_t k) {
            const int x = list[k] % depth.width(), y = list[k] / depth.width();
            const float own = inverseAt(x, y);
            float sum = 0;
            for (const auto& [dx, dy] : kBeside) {
                if (!depth.contains(x + dx, y + dy) || !hasPoint(depth.at(x + dx, y + dy)))
                    continue;
                const float other = inverseAt(x + dx, y + dy);
                if (shareApart(own, other) <= kLargestSmallStep) sum += other - own;
            }
            inverse[k] = own + sum / 8;
        });
        for (std::size_t k = 0; k < list.size(); ++k) depth.data()[list[k]] = 1 / inverse[k];
    }
}

}  // namespace

Image<float> raiseDepth(const Image<float>& depth, const Texture& picture,
                        const Image<std::uint8_t>* matte) {
    const CoarseDepth coarse(depth, picture, matte);
    const int width = picture.width(), height = picture.height();
    Image<float> out(width, height, kNoDepth);
    // Strips are always the same ones, so that bytes do not depend on the number of threads.
    parallelFor(0, (height + kStripRows - 1) / kStripRows, [&](int k) {
        const int from = k * kStripRows, to = std::min(height, from + kStripRows);
        RaisedStrip strip(coarse, picture, std::max(0, from - kMarginRows),
                          std::min(height, to + kMarginRows));
        strip.run();
        for (int y = from; y < to; ++y)
            for (int x = 0; x < width; ++x) out.at(x, y) = strip.depthAt(x, y);
    });
    joinSpecks(out, picture, 1.0 * width / depth.width());
    smoothSmallSteps(out, std::max(1, width / depth.width()));
    return out;
}

}  // namespace stx
