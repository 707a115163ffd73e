#pragma once

#include <glm/glm.hpp>

#include "lib/model/texture.hpp"

/// At an edge of depth: whose colour a pixel has, that of the surface in front or of the one
/// behind.

namespace stx {

/// Neighbours of a pixel, those across its sides first.
inline constexpr int kBeside[8][2] = {{1, 0}, {-1, 0},  {0, 1},  {0, -1},
                                      {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};

enum class EdgeSide { neither, front, back };

/// Colours of one surface around a pixel; near ones weigh more.
struct SideColours {
    glm::vec3 sum{0};
    float squares = 0, weight = 0;

    [[nodiscard]] glm::vec3 mean() const { return sum / weight; }
    /// Of all channels together.
    [[nodiscard]] float variance() const { return squares / weight - glm::dot(mean(), mean()); }
};

struct EdgeColours {
    SideColours front, back;

    [[nodiscard]] bool known() const { return front.weight > 0 && back.weight > 0; }
    [[nodiscard]] glm::vec3 apart() const { return front.mean() - back.mean(); }
    /// How much of a colour is that of the surface in front: 0 = none, 1 = all, and beyond.
    [[nodiscard]] float shareOf(glm::vec3 colour) const {
        return glm::dot(colour - back.mean(), apart()) / glm::dot(apart(), apart());
    }
};

/// The colours within four pixels of (x, y), of covered pixels; `sideOf(u, v)` tells whose they are
/// (neither: beyond the picture, of something else, or mixed themselves).
template <class SideOf>
EdgeColours coloursAround(const Texture& texture, int x, int y, const SideOf& sideOf) {
    constexpr int kReach = 4;
    EdgeColours found;
    for (int v = y - kReach; v <= y + kReach; ++v) {
        for (int u = x - kReach; u <= x + kReach; ++u) {
            const int away = (u - x) * (u - x) + (v - y) * (v - y);
            if (away == 0 || away > kReach * kReach) continue;
            const EdgeSide side = sideOf(u, v);
            if (side == EdgeSide::neither) continue;
            const glm::vec4 c = texture.at(u, v);
            if (c.a < 1.0f) continue;
            const float weight = 1.0f / static_cast<float>(away);
            SideColours& colours = side == EdgeSide::front ? found.front : found.back;
            colours.sum += weight * glm::vec3(c);
            colours.squares += weight * glm::dot(glm::vec3(c), glm::vec3(c));
            colours.weight += weight;
        }
    }
    return found;
}

}  // namespace stx
