#include "lib/refine/align.hpp"

#include <atomic>
#include <cmath>

#include <glm/glm.hpp>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/refine/edge_colours.hpp"

namespace stx {
namespace {

// Chosen by trial on the project's image sets.
/// A jump of this share of the nearer distance is an edge.
constexpr float kEdge = 0.01f;
/// Edges are moved by a pixel a round.
constexpr int kRounds = 2;
/// A pixel belongs in front from this share of the front's colour on. Below a half, because a pixel
/// left behind by mistake is seen against the wrong surface, one taken along hardly shows.
constexpr float kShare = 0.35f;
/// Squared distance of two colours (0..1 each) from which on they are two surfaces.
constexpr float kTellsApart = 3 * 0.01f * 0.01f;

bool together(float a, float b) {
    return hasPoint(a) && hasPoint(b) && std::abs(a - b) <= kEdge * std::min(a, b);
}

class Round {
  public:
    Round(const Image<float>& distances, const Texture& texture)
        : distances_(distances), texture_(texture) {}

    /// The distance of the surface in front that the pixel belongs to; its own if to none.
    [[nodiscard]] float belongsAt(int x, int y) const {
        const float own = distances_.at(x, y);
        float best = own, share = kShare;
        for (int i = 0; i < 4; ++i) {
            const int u = x + kBeside[i][0], v = y + kBeside[i][1];
            if (!distances_.contains(u, v)) continue;
            const float front = distances_.at(u, v);
            if (!hasPoint(front) || front >= own || together(front, own)) continue;
            const float s = shareOf(front, x, y);
            if (s <= share) continue;
            share = s;
            best = front;
        }
        return best;
    }

  private:
    /// How much of the pixel's colour is that of the surface at `front`, 0..1 and beyond.
    [[nodiscard]] float shareOf(float front, int x, int y) const {
        const float own = distances_.at(x, y);
        const EdgeColours colours = coloursAround(texture_, x, y, [&](int u, int v) {
            if (!distances_.contains(u, v)) return EdgeSide::neither;
            const float d = distances_.at(u, v);
            const bool isFront = together(d, front);
            if ((!isFront && !together(d, own)) || besideEdge(u, v)) return EdgeSide::neither;
            return isFront ? EdgeSide::front : EdgeSide::back;
        });
        if (!colours.known()) return 0;
        const glm::vec3 apart = colours.apart();
        if (glm::dot(apart, apart) < kTellsApart) return 0;
        return colours.shareOf(glm::vec3(texture_.at(x, y)));
    }
    /// Whether a pixel lies beside an edge, where its colour may be a mixture.
    [[nodiscard]] bool besideEdge(int x, int y) const {
        for (const auto& d : kBeside) {
            const int u = x + d[0], v = y + d[1];
            if (distances_.contains(u, v) && !together(distances_.at(u, v), distances_.at(x, y)))
                return true;
        }
        return false;
    }

    const Image<float>& distances_;
    const Texture& texture_;
};

}  // namespace

std::int64_t alignDepthEdges(Image<float>& distances, const Texture& texture) {
    std::atomic<std::int64_t> moved = 0;
    for (int round = 0; round < kRounds; ++round) {
        const Image<float> before = distances;
        const Round edges(before, texture);
        parallelForBlocks(0, before.height(), 16, [&](std::int64_t from, std::int64_t to) {
            std::int64_t here = 0;
            for (int y = static_cast<int>(from); y < to; ++y) {
                for (int x = 0; x < before.width(); ++x) {
                    if (!hasPoint(before.at(x, y))) continue;
                    const float d = edges.belongsAt(x, y);
                    here += d != before.at(x, y);
                    distances.at(x, y) = d;
                }
            }
            moved += here;
        });
    }
    return moved;
}

}  // namespace stx
