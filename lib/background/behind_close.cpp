#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/background/behind_layer.hpp"

namespace stx::behind {
namespace {

constexpr float kNothingThere = std::numeric_limits<float>::infinity();
/// Of what is nearly infinitely far away, pixels.
constexpr float kLeastParallax = 1e-3f;
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

}  // namespace

Image<float> closeSteps(Layer& layer) {
    Image<float> closed = layer.parallax;
    for (const bool toHidden : {false, true}) {
        bevelAround(layer, closed, toHidden);
        hideBesideAround(layer, closed);
        bevelHidden(layer, closed);
    }
    return closed;
}

}  // namespace stx::behind
