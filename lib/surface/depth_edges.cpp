#include "lib/surface/depth_edges.hpp"

#include <atomic>
#include <cmath>

#include <glm/glm.hpp>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

// Chosen by trial on the project's image sets.
/// A jump of this share of the nearer distance is an edge.
constexpr float kEdge = 0.01f;
/// Edges are moved by a pixel a round.
constexpr int kRounds = 2;
/// Colours are learnt within this many pixels.
constexpr int kReach = 4;
/// A pixel belongs in front from this share of the front's colour on. Below a half, because a pixel
/// left behind by mistake is seen against the wrong surface, one taken along hardly shows.
constexpr float kShare = 0.35f;
/// Squared distance of two colours (0..1 each) from which on they are two surfaces.
constexpr float kContrast = 3 * 0.01f * 0.01f;

constexpr int kBeside[8][2] = {{1, 0}, {-1, 0},  {0, 1},  {0, -1},
                               {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};

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
        glm::vec3 frontColour(0), backColour(0);
        float frontWeight = 0, backWeight = 0;
        for (int j = -kReach; j <= kReach; ++j) {
            for (int i = -kReach; i <= kReach; ++i) {
                const int u = x + i, v = y + j, away = i * i + j * j;
                if (away == 0 || away > kReach * kReach || !distances_.contains(u, v)) continue;
                const float d = distances_.at(u, v);
                const bool isFront = together(d, front);
                if ((!isFront && !together(d, own)) || besideEdge(u, v)) continue;
                const glm::vec4 c = texture_.at(u, v);
                if (c.a < 1) continue;
                const float weight = 1.0f / static_cast<float>(away);
                (isFront ? frontColour : backColour) += weight * glm::vec3(c);
                (isFront ? frontWeight : backWeight) += weight;
            }
        }
        if (frontWeight == 0 || backWeight == 0) return 0;
        backColour /= backWeight;
        const glm::vec3 apart = frontColour / frontWeight - backColour;
        const float squared = glm::dot(apart, apart);
        if (squared < kContrast) return 0;
        return glm::dot(glm::vec3(texture_.at(x, y)) - backColour, apart) / squared;
    }
    /// Its colour may be a mixture.
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
