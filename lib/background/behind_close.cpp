#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "lib/background/behind_layer.hpp"
#include "lib/base/parallel.hpp"

namespace stx::behind {
namespace {

constexpr float kNothingThere = std::numeric_limits<float>::infinity();
/// Of what is nearly infinitely far away, pixels.
constexpr float kLeastParallax = 1e-3f;
/// Pixels by which what is hidden goes on under what is before it: triangles end in the middles of
/// pixels, an eye that goes to the side turns, and slopes hide what is behind them. With 3, 0.002 %
/// of cards before a wall are open from 8 % aside; with 8, nothing.
constexpr int kGrownPixels = 8;
/// Passes that carry values around corners of a region; more change nothing that is seen.
constexpr int kCornerPasses = 3;

/// The least of all blocks' values plus the way to them times `slope`, the way from a block to the
/// next one being 1 (Borgefors 1986). `inside(x, y)`: whether a block takes part; ways lead through
/// such blocks only. `level` goes along with the value that a block takes.
template <class Inside>
void spreadLeast(Image<float>& least, float slope, const Inside& inside,
                 Image<float>* level = nullptr) {
    const int w = least.width(), h = least.height();
    const float diagonal = slope * 1.41421356f;
    const auto sweep = [&](int from, int to, int way) {
        for (int y = from; y != to; y += way) {
            for (int i = 0; i < w; ++i) {
                const int x = way > 0 ? i : w - 1 - i;
                if (!inside(x, y)) continue;
                float& v = least.at(x, y);
                const auto take = [&](int u, int t, float more) {
                    if (!least.contains(u, t) || !inside(u, t)) return;
                    if (!(least.at(u, t) + more < v)) return;
                    v = least.at(u, t) + more;
                    if (level) level->at(x, y) = level->at(u, t);
                };
                take(x - way, y, slope);
                take(x, y - way, slope);
                take(x - 1, y - way, diagonal);
                take(x + 1, y - way, diagonal);
            }
        }
    };
    for (int pass = 0; pass < kCornerPasses; ++pass) {
        sweep(0, h, 1);
        sweep(h - 1, -1, -1);
    }
}

/// Logarithms of parallax, so that slopes are shares of it.
float codeOf(float parallax) {
    return std::log(std::max(parallax, kLeastParallax));
}

/// What goes on around the frame falls to what is beside it: around the frame, and hidden.
void bevelAround(Layer& layer, Image<float>& closed, bool toHidden) {
    Image<float> least(closed.width(), closed.height(), kNothingThere);
    const auto inside = [&](int x, int y) {
        const Part part = layer.part.at(x, y);
        return part == Part::around || (toHidden && part == Part::hidden);
    };
    for (int y = 0; y < layer.height(); ++y)
        for (int x = 0; x < layer.width(); ++x)
            if (inside(x, y)) least.at(x, y) = codeOf(closed.at(x, y));
    Image<float> level = layer.parallax;
    spreadLeast(least, steepestBehind(layer), inside, &level);
    for (std::size_t i = 0; i < least.count(); ++i) {
        if (layer.part.data()[i] != Part::around) continue;
        closed.data()[i] = std::exp(least.data()[i]);
        layer.parallax.data()[i] = level.data()[i];
    }
}

/// Blocks of the photograph that the eye sees behind, where what goes on around the frame is
/// farther than they are: that goes on behind them.
void hideBesideAround(Layer& layer, Image<float>& closed) {
    const auto everywhere = [](int, int) { return true; };
    Image<float> seen(layer.width(), layer.height(), kNothingThere), ramp = seen;
    Image<float> level = layer.parallax;
    for (std::size_t i = 0; i < seen.count(); ++i) {
        if (layer.part.data()[i] != Part::around) continue;
        seen.data()[i] = closed.data()[i];
        ramp.data()[i] = codeOf(closed.data()[i]);
    }
    spreadLeast(seen, static_cast<float>(layer.step), everywhere);
    spreadLeast(ramp, steepestBehind(layer), everywhere, &level);
    for (int y = layer.border.y; y < layer.border.y + layer.photo.y; ++y) {
        for (int x = layer.border.x; x < layer.border.x + layer.photo.x; ++x) {
            Part& part = layer.part.at(x, y);
            if (part == Part::hidden || !(layer.front.at(x, y) > seen.at(x, y) + kUncovered))
                continue;
            part = Part::hidden;
            closed.at(x, y) = std::min(std::exp(ramp.at(x, y)), layer.front.at(x, y));
            layer.parallax.at(x, y) = std::min(level.at(x, y), layer.front.at(x, y));
        }
    }
}

/// What is hidden rises to what goes on around the frame, and falls to what is beside it.
void bevelHidden(Layer& layer, Image<float>& closed) {
    const auto isHidden = [&](int x, int y) { return layer.part.at(x, y) == Part::hidden; };
    const float slope = steepestBehind(layer);
    Image<float> below(layer.width(), layer.height(), kNothingThere), least = below;
    for (std::size_t i = 0; i < below.count(); ++i)
        if (layer.part.data()[i] == Part::around) below.data()[i] = -codeOf(closed.data()[i]);
    spreadLeast(below, slope, [&](int x, int y) {
        return layer.part.at(x, y) == Part::around || isHidden(x, y);
    });
    Image<float> level = layer.parallax;
    for (int y = 0; y < layer.height(); ++y) {
        for (int x = 0; x < layer.width(); ++x) {
            if (!isHidden(x, y)) continue;
            float& v = least.at(x, y);
            v = std::min(std::max(codeOf(closed.at(x, y)), -below.at(x, y)),
                         codeOf(layer.front.at(x, y)));
            for (int t = std::max(0, y - 1); t <= std::min(layer.height() - 1, y + 1); ++t) {
                for (int u = std::max(0, x - 1); u <= std::min(layer.width() - 1, x + 1); ++u) {
                    if (!layer.inPhoto(u, t) || isHidden(u, t) || layer.far.at(u, t) < 0) continue;
                    const float beside = codeOf(layer.far.at(u, t)) + slope;
                    if (!(beside < v)) continue;
                    v = beside;
                    level.at(x, y) = std::min(level.at(x, y), layer.far.at(u, t));
                }
            }
        }
    }
    spreadLeast(least, slope, isHidden, &level);
    for (std::size_t i = 0; i < least.count(); ++i) {
        if (layer.part.data()[i] != Part::hidden) continue;
        closed.data()[i] = std::exp(least.data()[i]);
        layer.parallax.data()[i] = level.data()[i];
    }
}

/// Blocks at the edge of the photograph do not fall away from what is beside the frame: its
/// outermost pixels are half a pixel within it, and from the side one would see past them.
void reachFrame(const Layer& layer, Image<float>& closed) {
    const glm::ivec2 first = layer.border, last = first + layer.photo - 1;
    const auto rise = [&](int x, int y, glm::ivec2 outwards) {
        const glm::ivec2 beside = glm::ivec2(x, y) + outwards;
        if (layer.part.at(x, y) != Part::hidden || !layer.part.contains(beside.x, beside.y) ||
            layer.part.at(beside.x, beside.y) != Part::around)
            return;
        float& own = closed.at(x, y);
        own = std::min(std::max(own, closed.at(beside.x, beside.y)), layer.front.at(x, y));
    };
    for (int x = first.x; x <= last.x; ++x) {
        rise(x, first.y, {0, -1});
        rise(x, last.y, {0, 1});
    }
    for (int y = first.y; y <= last.y; ++y) {
        rise(first.x, y, {-1, 0});
        rise(last.x, y, {1, 0});
    }
}

/// Below which parallax what is behind each block is seen from some side: past a block where the
/// parallax falls by more than the way to the next one, as far as that block moves more. Minus
/// infinity: from nowhere.
Image<float> seenBelow(const Layer& layer) {
    const int w = layer.width(), h = layer.height();
    const auto shown = [&](const Image<float>& photo, int x, int y) {
        return layer.part.at(x, y) == Part::around ? layer.parallax.at(x, y) : photo.at(x, y);
    };
    // Negative, since spreadLeast() looks for the least.
    Image<float> seen(w, h, kNothingThere);
    parallelFor(0, h, [&](int y) {
        for (int x = 0; x < w; ++x) {
            const float own = shown(layer.front, x, y);
            if (own < 0) continue;
            bool falls = false;
            for (int v = std::max(0, y - 1); v <= std::min(h - 1, y + 1); ++v) {
                for (int u = std::max(0, x - 1); u <= std::min(w - 1, x + 1); ++u) {
                    const float beside = shown(layer.far, u, v);
                    falls = falls || (beside >= 0 &&
                                      own - beside > static_cast<float>(layer.step) + kUncovered);
                }
            }
            if (falls) seen.at(x, y) = -own;
        }
    });
    spreadLeast(seen, static_cast<float>(layer.step), [](int, int) { return true; });
    for (float& value : seen.pixels()) value = -value;
    return seen;
}

}  // namespace

Image<float> closeSteps(Layer& layer) {
    Image<float> closed = layer.parallax;
    for (const bool toHidden : {false, true}) {
        bevelAround(layer, closed, toHidden);
        hideBesideAround(layer, closed);
        bevelHidden(layer, closed);
    }
    reachFrame(layer, closed);
    return closed;
}

void growUnder(Layer& layer, Sources& sources) {
    constexpr std::array<glm::ivec2, 4> kBesideBlock = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    const int always = (kGrownPixels + layer.step - 1) / layer.step;
    const Image<float> seen = seenBelow(layer);
    std::vector<glm::ivec2> rim, next;
    for (int y = layer.border.y; y < layer.border.y + layer.photo.y; ++y)
        for (int x = layer.border.x; x < layer.border.x + layer.photo.x; ++x)
            if (layer.part.at(x, y) == Part::hidden) rim.emplace_back(x, y);
    for (int round = 0; !rim.empty(); ++round, rim.swap(next), next.clear()) {
        for (const glm::ivec2 from : rim) {
            const float parallax = layer.parallax.at(from.x, from.y);
            for (const glm::ivec2 step : kBesideBlock) {
                const int x = from.x + step.x, y = from.y + step.y;
                if (!layer.inPhoto(x, y) || layer.part.at(x, y) != Part::shown) continue;
                if (!(layer.far.at(x, y) > parallax)) continue;
                if (round >= always && !(seen.at(x, y) > parallax)) continue;
                layer.part.at(x, y) = Part::hidden;
                layer.parallax.at(x, y) = parallax;
                layer.colour.at(x, y) = layer.colour.at(from.x, from.y);
                const glm::ivec2 source = sources.at(from.x, from.y);
                sources.at(x, y) = source.x < 0 ? source : source + step;
                next.emplace_back(x, y);
            }
        }
    }
    reachFrame(layer, layer.parallax);
}

}  // namespace stx::behind
