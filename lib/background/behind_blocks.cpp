#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "lib/background/behind_layer.hpp"
#include "lib/base/parallel.hpp"

namespace stx::behind {
namespace {

/// Pixels that a nearer surface is within this many of have its colour in them (found on pictures
/// of phones: 2 to 4).
constexpr int kMixedPixels = 3;
/// How much nearer, pixels of parallax: a surface may be steep.
constexpr float kMixedJump = 3.0f;
/// Deviations of the means that fine and coarse detail are differences from, blocks: what is
/// coarser than the second is in the smooth colours.
constexpr int kFine = 1, kCoarse = 20;
constexpr float kInfinite = std::numeric_limits<float>::infinity();

float parallaxOf(float depth, float scale) {
    return hasPoint(depth) ? scale / depth : kNoParallax;
}

/// The least over all pixels of their parallax plus the way to them (kUncoveredWay), for each
/// pixel: two passes with steps of 1 and of the square root of 2 (Borgefors 1986).
Image<float> leastAround(const Image<float>& depth, float scale, NoDepth noDepth) {
    const int w = depth.width(), h = depth.height();
    // One sees past what is empty; what is not known says nothing.
    const float nothing = noDepth == NoDepth::empty ? 0.0f : kInfinite;
    Image<float> least(w, h);
    parallelFor(0, depth.count(), 1 << 16, [&](std::int64_t i) {
        const float z = depth.data()[i];
        least.data()[i] = hasPoint(z) ? scale / z : nothing;
    });
    const float diagonal = std::sqrt(2.0f);
    for (int y = 0; y < h; ++y) {
        float* row = least.row(y).data();
        if (y > 0) {
            const float* above = least.row(y - 1).data();
            for (int x = 0; x < w; ++x) {
                float v = std::min(row[x], above[x] + 1);
                if (x > 0) v = std::min(v, above[x - 1] + diagonal);
                if (x + 1 < w) v = std::min(v, above[x + 1] + diagonal);
                row[x] = v;
            }
        }
        for (int x = 1; x < w; ++x) row[x] = std::min(row[x], row[x - 1] + 1);
    }
    for (int y = h - 1; y >= 0; --y) {
        float* row = least.row(y).data();
        if (y + 1 < h) {
            const float* below = least.row(y + 1).data();
            for (int x = 0; x < w; ++x) {
                float v = std::min(row[x], below[x] + 1);
                if (x > 0) v = std::min(v, below[x - 1] + diagonal);
                if (x + 1 < w) v = std::min(v, below[x + 1] + diagonal);
                row[x] = v;
            }
        }
        for (int x = w - 2; x >= 0; --x) row[x] = std::min(row[x], row[x + 1] + 1);
    }
    return least;
}

/// Sums up the pixels of the blocks of one row.
void sumUpRow(const ReferenceView& view, const Image<float>& least, float scale, int y,
              Layer& layer) {
    const int step = layer.step, w = view.depth.width(), h = view.depth.height();
    for (int x = 0; x < layer.photo.x; ++x) {
        glm::vec3 sum(0);
        float weight = 0, nearest = kNoParallax, farthest = kInfinite;
        bool uncovered = false;
        for (int v = y * step; v < std::min(h, (y + 1) * step); ++v) {
            for (int u = x * step; u < std::min(w, (x + 1) * step); ++u) {
                const float p = parallaxOf(view.depth.at(u, v), scale);
                if (p < 0) continue;
                const glm::vec4 c = view.texture.at(u, v);
                sum += glm::vec3(c);
                weight += 1;
                nearest = std::max(nearest, p);
                farthest = std::min(farthest, p);
                uncovered = uncovered || p > least.at(u, v) + kUncovered;
            }
        }
        const int column = x + layer.border.x, row = y + layer.border.y;
        layer.front.at(column, row) = nearest;
        layer.far.at(column, row) = weight > 0 ? farthest : kNoParallax;
        if (weight > 0) layer.shown.at(column, row) = sum / weight;
        layer.part.at(column, row) = uncovered ? Part::hidden : Part::shown;
    }
}

/// The greatest value within `radius` of each block of the photograph.
Image<float> greatestWithin(const Layer& layer, int radius) {
    const glm::ivec2 size = layer.photo, at = layer.border;
    Image<float> across(size.x, size.y), out(size.x, size.y);
    parallelFor(0, size.y, [&](std::int64_t y) {
        for (int x = 0; x < size.x; ++x) {
            float most = kNoParallax;
            for (int u = std::max(0, x - radius); u <= std::min(size.x - 1, x + radius); ++u)
                most = std::max(most, layer.front.at(u + at.x, static_cast<int>(y) + at.y));
            across.at(x, static_cast<int>(y)) = most;
        }
    });
    parallelFor(0, size.y, [&](int y) {
        for (int x = 0; x < size.x; ++x) {
            float most = kNoParallax;
            for (int v = std::max(0, y - radius); v <= std::min(size.y - 1, y + radius); ++v)
                most = std::max(most, across.at(x, v));
            out.at(x, y) = most;
        }
    });
    return out;
}

/// Of a row of values those that are smaller than all within `radius`, each as far as it reaches:
/// near things that are narrower than twice that are gone (a grey opening).
std::vector<float> withoutNarrow(std::vector<float> row, int radius) {
    const auto sweep = [&](const auto& better) {
        for (int pass = 0; pass < radius; ++pass) {
            float before = row[0];
            for (std::size_t i = 0; i < row.size(); ++i) {
                const float own = row[i], after = row[std::min(i + 1, row.size() - 1)];
                row[i] = better(own, better(before, after));
                before = own;
            }
        }
    };
    sweep([](float a, float b) { return std::min(a, b); });
    sweep([](float a, float b) { return std::max(a, b); });
    return row;
}

/// Of a row of parallaxes those that are not known are the nearest known one's; of two that are as
/// near, what is farther away.
std::vector<float> withNearestKnown(std::vector<float> row) {
    for (std::size_t from = 0; from < row.size();) {
        if (row[from] >= 0) {
            ++from;
            continue;
        }
        std::size_t to = from;
        while (to < row.size() && row[to] < 0) ++to;
        const float after = to < row.size() ? row[to] : from > 0 ? row[from - 1] : kNoParallax;
        const float before = from > 0 ? row[from - 1] : after;
        for (std::size_t i = from; i < to; ++i) {
            const std::size_t wayBefore = i - from, wayAfter = to - 1 - i;
            row[i] = wayBefore == wayAfter  ? std::min(before, after)
                     : wayBefore < wayAfter ? before
                                            : after;
        }
        from = to;
    }
    return row;
}

/// What is at one side of the photograph goes on outwards for `reach` blocks: near things as far as
/// half of their width, which is all that is known of how long they are.
void continueSide(Layer& layer, glm::ivec2 corner, glm::ivec2 along, glm::ivec2 outwards, int count,
                  int reach, NoDepth noDepth) {
    std::vector<float> rim(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const glm::ivec2 at = corner + i * along;
        rim[i] = layer.front.at(at.x, at.y);
    }
    // Where nothing is, nothing goes on; what is not known must not narrow what is beside it.
    if (noDepth == NoDepth::unknown) rim = withNearestKnown(std::move(rim));
    parallelFor(1, reach + 1, [&](int d) {
        const std::vector<float> row = withoutNarrow(rim, d);
        // The corners belong to the side above or below.
        const int more = along.x != 0 ? layer.border.x : 0;
        for (int i = -more; i < count + layer.width(); ++i) {
            const glm::ivec2 at = corner + i * along + d * outwards;
            if (!layer.part.contains(at.x, at.y)) break;
            if (along.y != 0 && i >= count) break;
            const float p = row[std::clamp(i, 0, count - 1)];
            layer.part.at(at.x, at.y) = p < 0 ? Part::shown : Part::around;
            layer.front.at(at.x, at.y) = layer.far.at(at.x, at.y) = layer.parallax.at(at.x, at.y) =
                p;
        }
    });
}

void continueAround(Layer& layer, NoDepth noDepth) {
    const glm::ivec2 first = layer.border, last = layer.border + layer.photo - 1;
    const glm::ivec2 size = layer.part.size();
    continueSide(layer, first, {1, 0}, {0, -1}, layer.photo.x, first.y, noDepth);
    continueSide(layer, {first.x, last.y}, {1, 0}, {0, 1}, layer.photo.x, size.y - 1 - last.y,
                 noDepth);
    continueSide(layer, first, {0, 1}, {-1, 0}, layer.photo.y, first.x, noDepth);
    continueSide(layer, {last.x, first.y}, {0, 1}, {1, 0}, layer.photo.y, size.x - 1 - last.x,
                 noDepth);
}

/// Means of the photograph's colours around each block, of what is at one depth, weighted by a bell
/// curve of that deviation.
Image<glm::vec3> smoothShown(const Layer& layer, int deviation) {
    const int w = layer.width(), h = layer.height();
    Image<glm::vec3> across(w, h, glm::vec3(0)), out(w, h, glm::vec3(0));
    std::vector<float> weightOf;
    for (int k = 0; k <= 2 * deviation; ++k)
        weightOf.push_back(std::exp(-0.5f * static_cast<float>(k * k) /
                                    static_cast<float>(deviation * deviation)));
    const auto mean = [&](const Image<glm::vec3>& of, int x, int y, glm::ivec2 step) {
        const float own = layer.front.at(x, y);
        glm::vec3 sum(0);
        float weights = 0;
        for (int k = -2 * deviation; k <= 2 * deviation; ++k) {
            const int u = x + k * step.x, v = y + k * step.y;
            if (!layer.inPhoto(u, v) || std::abs(layer.front.at(u, v) - own) > 2 * kOneSurface)
                continue;
            const float weight = weightOf[std::abs(k)];
            weights += weight;
            sum += weight * of.at(u, v);
        }
        return sum / weights;
    };
    const auto pass = [&](const Image<glm::vec3>& from, Image<glm::vec3>& to, glm::ivec2 step) {
        parallelFor(0, layer.photo.y, [&](int row) {
            const int y = row + layer.border.y;
            for (int x = layer.border.x; x < layer.border.x + layer.photo.x; ++x)
                to.at(x, y) = mean(from, x, y, step);
        });
    };
    pass(layer.shown, across, {1, 0});
    pass(across, out, {0, 1});
    return out;
}

}  // namespace

Layer blocksOf(const ReferenceView& view, double scale, int step, glm::ivec2 border,
               glm::ivec2 size) {
    const auto blocks = [step](int pixels) { return (pixels + step - 1) / step; };
    const int w = view.depth.width(), h = view.depth.height();
    Layer layer;
    layer.step = step;
    layer.border = border / step;
    layer.photo = {blocks(w), blocks(h)};
    const int width = blocks(size.x), height = blocks(size.y);
    layer.part = Image<Part>(width, height, Part::shown);
    layer.front = layer.far = layer.parallax = Image<float>(width, height, kNoParallax);
    layer.shown = layer.colour = Image<glm::vec3>(width, height, glm::vec3(0));
    {
        const Image<float> least = leastAround(view.depth, static_cast<float>(scale), view.noDepth);
        parallelFor(0, layer.photo.y,
                    [&](int y) { sumUpRow(view, least, static_cast<float>(scale), y, layer); });
    }
    continueAround(layer, view.noDepth);
    layer.smooth = smoothShown(layer, kFine);
    layer.base = smoothShown(layer, kCoarse);
    return layer;
}

void markMixed(Layer& layer) {
    const int radius = (kMixedPixels + layer.step - 1) / layer.step;
    const Image<float> nearest = greatestWithin(layer, radius);
    for (int y = 0; y < layer.photo.y; ++y) {
        for (int x = 0; x < layer.photo.x; ++x) {
            const int column = x + layer.border.x, row = y + layer.border.y;
            Part& part = layer.part.at(column, row);
            const float own = layer.far.at(column, row);
            if (part == Part::shown && own >= 0 && nearest.at(x, y) > own + kMixedJump) {
                part = Part::mixed;
                layer.parallax.at(column, row) = own;
            }
        }
    }
}

}  // namespace stx::behind
