#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <vector>

#include "lib/background/behind_layer.hpp"
#include "lib/background/membrane.hpp"

namespace stx::behind {
namespace {

/// What is behind a pixel has a parallax that is smaller by this at least, pixels.
constexpr float kBehind = 1.5f;
/// Rounds of the membrane and how far each carries: what comes from rims 100 blocks apart is smooth
/// then, and more rounds move nothing by a pixel.
constexpr int kDepthRounds = 80;
constexpr float kDepthRelaxation = 1.9f;

struct Reached {
    float way;
    std::int32_t block;
    bool operator>(const Reached& other) const {
        return way != other.way ? way > other.way : block > other.block;
    }
};

/// The eight neighbours of a block, and the way to each.
struct Neighbour {
    int dx, dy;
    float way;
};
constexpr float kDiagonal = 1.41421356f;
constexpr std::array<Neighbour, 8> kAround = {{{1, 0, 1},
                                               {-1, 0, 1},
                                               {0, 1, 1},
                                               {0, -1, 1},
                                               {1, 1, kDiagonal},
                                               {-1, 1, kDiagonal},
                                               {1, -1, kDiagonal},
                                               {-1, -1, kDiagonal}}};

/// Each hidden block takes the parallax of the block beside hidden ones from where the way through
/// blocks that are before *it* is shortest (Dijkstra). Blocks that nothing reaches become `shown`,
/// and are what is behind others in turn: so is a wall with empty holes, behind which is nothing.
void takeNearestBehind(Layer& layer) {
    const int w = layer.width(), h = layer.height();
    Image<float> way(w, h, std::numeric_limits<float>::infinity());
    std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
    const auto spread = [&](int x, int y, float from, float parallax) {
        for (const Neighbour& n : kAround) {
            const int u = x + n.dx, v = y + n.dy;
            if (!layer.inPhoto(u, v) || layer.part.at(u, v) != Part::hidden) continue;
            if (!(layer.front.at(u, v) > parallax + kBehind)) continue;
            const float there = from + n.way;
            float& best = way.at(u, v);
            if (!(there < best)) continue;
            best = there;
            layer.parallax.at(u, v) = parallax;
            open.push({there, v * w + u});
        }
    };
    for (int y = layer.border.y; y < layer.border.y + layer.photo.y; ++y)
        for (int x = layer.border.x; x < layer.border.x + layer.photo.x; ++x)
            if (layer.part.at(x, y) != Part::hidden && layer.far.at(x, y) >= 0)
                spread(x, y, 0, layer.far.at(x, y));
    const auto goOn = [&] {
        while (!open.empty()) {
            const Reached next = open.top();
            open.pop();
            const int x = next.block % w, y = next.block / w;
            if (next.way > way.at(x, y)) continue;
            spread(x, y, next.way, layer.parallax.at(x, y));
        }
    };
    goOn();
    std::vector<std::int32_t> left;
    for (std::size_t i = 0; i < way.count(); ++i)
        if (layer.part.data()[i] == Part::hidden && std::isinf(way.data()[i]))
            left.push_back(static_cast<std::int32_t>(i));
    const float* front = layer.front.data();
    std::ranges::sort(left, [&](std::int32_t a, std::int32_t b) {
        return front[a] != front[b] ? front[a] < front[b] : a < b;
    });
    for (std::size_t begin = 0; begin < left.size();) {
        // The farthest ones, all that are not behind each other, at once: one by one each would
        // reach again much of what the one before did.
        const float last = front[left[begin]] + kBehind;
        std::size_t end = begin;
        for (; end < left.size() && front[left[end]] <= last; ++end)
            if (std::isinf(way.data()[left[end]])) layer.part.data()[left[end]] = Part::shown;
        for (; begin < end; ++begin) {
            const std::int32_t block = left[begin];
            if (layer.part.data()[block] == Part::shown)
                spread(block % w, block / w, 0, layer.far.data()[block]);
        }
        goOn();
    }
}

/// Makes the parallax of hidden blocks smooth where neighbours are one surface.
void smoothBehind(Layer& layer) {
    const int w = layer.width(), h = layer.height();
    Image<std::int32_t> number(w, h, -1);
    std::int32_t count = 0;
    for (std::size_t i = 0; i < number.count(); ++i)
        if (layer.part.data()[i] == Part::hidden) number.data()[i] = count++;
    Membrane<float> membrane;
    for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) {
            if (number.at(x, y) < 0) continue;
            const std::size_t at = static_cast<std::size_t>(y) * w + x;
            const float own = layer.parallax.at(x, y), tolerance = surfaceTolerance(layer, at);
            Membrane<float>::Unknown unknown;
            for (std::size_t k = 0; k < 4; ++k) {
                const int u = x + kAround[k].dx, v = y + kAround[k].dy;
                if (!layer.inPhoto(u, v)) continue;
                const bool hidden = number.at(u, v) >= 0;
                const float other = hidden ? layer.parallax.at(u, v) : layer.far.at(u, v);
                if (other < 0 || std::abs(other - own) > tolerance) continue;
                unknown.count += 1;
                if (hidden)
                    unknown.to[k] = number.at(u, v);
                else
                    unknown.known += other;
            }
            membrane.add(unknown, own, (x + y) % 2 != 0);
        }
    }
    membrane.solve(kDepthRounds, kDepthRelaxation);
    // Rounds that are not at their end yet may have gone too far: nothing is behind all that the
    // photograph shows.
    float farthest = std::numeric_limits<float>::infinity();
    for (const float parallax : layer.far.pixels())
        if (parallax >= 0) farthest = std::min(farthest, parallax);
    for (std::size_t i = 0; i < number.count(); ++i) {
        if (number.data()[i] < 0) continue;
        const float value = membrane.values[number.data()[i]];
        layer.parallax.data()[i] = std::min(std::max(value, farthest), layer.front.data()[i]);
    }
}

}  // namespace

void inventDepth(Layer& layer) {
    takeNearestBehind(layer);
    markMixed(layer);
    smoothBehind(layer);
}

}  // namespace stx::behind
