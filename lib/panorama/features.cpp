#include "lib/panorama/features.hpp"

#include <algorithm>
#include <cmath>

namespace stx::panorama {
namespace {

/// Corners are looked for in the work copy and in reductions of it by the square root of 2 and its
/// powers.
constexpr int kLevels = 4;
constexpr int kMargin = 10;  ///< pixels of a level without corners
constexpr int kCells = 8;    ///< parts along each side that share the corners
/// Corners weaker than this are noise of a good picture: square codes of luma for a pixel (the
/// harmonic mean of the structure tensor's eigenvalues).
constexpr float kWeakest = 2;
/// Added to the trace that the strength of a corner is divided by: squared codes of luma for a
/// pixel.
constexpr float kFlatTrace = 1e-3f;
/// Directions around a corner that are at least this share of the most frequent one's weight
/// describe it, too; so many in all.
constexpr float kAsFrequent = 0.8f;
constexpr std::size_t kMostDirections = 2;

// A descriptor: kDescriptorCells x kDescriptorCells cells, each of kCellSamples x kCellSamples
// samples and with a share for each of kDirections directions.
constexpr int kDescriptorCells = 4, kCellSamples = 4, kSamples = kDescriptorCells * kCellSamples;
constexpr int kDirections = 8;
/// Cells along each side with a margin of one, where what samples share beyond the edge goes.
constexpr int kCellsAndMargin = kDescriptorCells + 2;
/// Directions of a cell while shares are summed up: those that go beyond the last belong to the
/// first two.
constexpr int kSlots = kDirections + 2;
constexpr float kSpacing = 1.2f;  ///< pixels between samples
constexpr float kMiddleSample = 0.5f * (kSamples - 1);
/// Square roots of shares become bytes by this factor; shares of 13 % and more are 255.
constexpr float kCodeOfRoot = 700;
/// Interpolation reads the pixel behind: positions end this far before the last one.
constexpr float kBeforeLast = 1.001f;

Image<float> floatOf(const Image<std::uint8_t>& grey) {
    Image<float> out(grey.width(), grey.height());
    for (std::size_t i = 0; i < out.count(); ++i) out.pixels()[i] = grey.pixels()[i];
    return out;
}

/// Smoothed by 1 4 6 4 1 (sixteenths) in both directions, into an image of the same size.
void blur(const Image<float>& image, Image<float>& out) {
    const int w = image.width(), h = image.height();
    const auto line = [&](int y) { return image.row(std::clamp(y, 0, h - 1)).data(); };
    std::vector<float> between(static_cast<std::size_t>(w) + 4);
    float* from = between.data() + 2;
    for (int y = 0; y < h; ++y) {
        const float *a = line(y - 2), *b = line(y - 1), *c = line(y), *d = line(y + 1),
                    *e = line(y + 2);
        for (int x = 0; x < w; ++x)
            from[x] = 0.0625f * (a[x] + e[x]) + 0.25f * (b[x] + d[x]) + 0.375f * c[x];
        from[-1] = from[-2] = from[0];
        from[w] = from[w + 1] = from[w - 1];
        float* to = out.row(y).data();
        for (int x = 0; x < w; ++x)
            to[x] = 0.0625f * (from[x - 2] + from[x + 2]) + 0.25f * (from[x - 1] + from[x + 1]) +
                    0.375f * from[x];
    }
}

Image<float> blurred(const Image<float>& image) {
    Image<float> out(image.width(), image.height());
    blur(image, out);
    return out;
}

/// The picture with sides divided by the square root of 2.
Image<float> betweenLevels(const Image<float>& image) {
    const int w = std::max(1, static_cast<int>(std::lround(image.width() * M_SQRT1_2)));
    const int h = std::max(1, static_cast<int>(std::lround(image.height() * M_SQRT1_2)));
    Image<float> out(w, h);
    const double sx = static_cast<double>(image.width()) / w;
    const double sy = static_cast<double>(image.height()) / h;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
            out.at(x, y) = sampleLinear(image, (x + 0.5) * sx, (y + 0.5) * sy);
    return out;
}

struct Gradients {
    Image<float> x, y;
};

Gradients gradientsOf(const Image<float>& image) {
    const int w = image.width(), h = image.height();
    Gradients g{Image<float>(w, h), Image<float>(w, h)};
    for (int y = 1; y + 1 < h; ++y) {
        const float *up = image.row(y - 1).data(), *here = image.row(y).data(),
                    *down = image.row(y + 1).data();
        float *gx = g.x.row(y).data(), *gy = g.y.row(y).data();
        for (int x = 1; x + 1 < w; ++x) {
            gx[x] = 0.5f * (here[x + 1] - here[x - 1]);
            gy[x] = 0.5f * (down[x] - up[x]);
        }
    }
    return g;
}

/// Determinant over trace of the blurred structure tensor: the harmonic mean of its eigenvalues.
Image<float> cornerStrength(const Gradients& g) {
    const int w = g.x.width(), h = g.x.height();
    Image<float> xx(w, h), xy(w, h), yy(w, h);
    for (std::size_t i = 0; i < xx.count(); ++i) {
        const float gx = g.x.pixels()[i], gy = g.y.pixels()[i];
        xx.pixels()[i] = gx * gx;
        xy.pixels()[i] = gx * gy;
        yy.pixels()[i] = gy * gy;
    }
    Image<float> once(w, h);
    for (Image<float>* image : {&xx, &xy, &yy}) {
        blur(*image, once);
        blur(once, *image);
    }
    for (std::size_t i = 0; i < xx.count(); ++i) {
        const float a = xx.pixels()[i], b = xy.pixels()[i], c = yy.pixels()[i];
        xx.pixels()[i] = (a * c - b * b) / (a + c + kFlatTrace);
    }
    return xx;
}

/// The top of the parabola through three values, as a share of a step.
float peakOf(float before, float at, float after) {
    const float curve = before - 2 * at + after;
    return curve < 0 ? std::clamp(0.5f * (before - after) / curve, -0.5f, 0.5f) : 0.0f;
}

std::vector<Feature> cornersOf(const Image<float>& strength, std::size_t most) {
    const int w = strength.width(), h = strength.height();
    std::vector<std::vector<Feature>> cells(kCells * kCells);
    for (int y = kMargin; y < h - kMargin; ++y) {
        for (int x = kMargin; x < w - kMargin; ++x) {
            const float s = strength.at(x, y);
            if (s < kWeakest) continue;
            bool highest = true;
            for (int dy = -2; dy <= 2 && highest; ++dy)
                for (int dx = -2; dx <= 2 && highest; ++dx)
                    if (dx != 0 || dy != 0) {
                        const float other = strength.at(x + dx, y + dy);
                        // Of two that are equal, the first is taken.
                        highest = s > other || (s == other && (dy > 0 || (dy == 0 && dx > 0)));
                    }
            if (!highest) continue;
            Feature f;
            f.pixel = {x + 0.5f + peakOf(strength.at(x - 1, y), s, strength.at(x + 1, y)),
                       y + 0.5f + peakOf(strength.at(x, y - 1), s, strength.at(x, y + 1))};
            f.strength = s;
            cells[y * kCells / h * kCells + x * kCells / w].push_back(f);
        }
    }
    const auto stronger = [](const Feature& a, const Feature& b) {
        if (a.strength != b.strength) return a.strength > b.strength;
        return a.pixel.y != b.pixel.y ? a.pixel.y < b.pixel.y : a.pixel.x < b.pixel.x;
    };
    // Each part gets its share; what empty parts leave goes to the strongest of all.
    std::vector<Feature> out, rest;
    const std::size_t each = most / cells.size();
    for (auto& cell : cells) {
        std::sort(cell.begin(), cell.end(), stronger);
        for (std::size_t i = 0; i < cell.size(); ++i) (i < each ? out : rest).push_back(cell[i]);
    }
    std::sort(rest.begin(), rest.end(), stronger);
    rest.resize(std::min(rest.size(), most - std::min(most, out.size())));
    out.insert(out.end(), rest.begin(), rest.end());
    return out;
}

/// Gradients at many places around a corner, and then their directions and lengths.
template <std::size_t Count>
struct Around {
    std::array<float, Count> x, y;
    std::array<float, Count> turn, length;

    /// Directions are shares of a turn, 0..1, to 1e-5: arc tangents of 0..1 by an odd polynomial of
    /// least maximum error, which vectors do at once, and the other octants from it.
    void measure() {
        for (std::size_t i = 0; i < Count; ++i) {
            const float ax = std::abs(x[i]), ay = std::abs(y[i]);
            const float less = ax < ay ? ax : ay, more = ax < ay ? ay : ax;
            const float a = less / (more > 1e-20f ? more : 1e-20f), s = a * a;
            float angle = ((-0.0464964749f * s + 0.15931422f) * s - 0.327622764f) * s * a + a;
            angle *= 0.5f / static_cast<float>(M_PI);
            angle = ay > ax ? 0.25f - angle : angle;
            angle = x[i] < 0 ? 0.5f - angle : angle;
            turn[i] = y[i] < 0 ? 1 - angle : angle;
            length[i] = std::sqrt(x[i] * x[i] + y[i] * y[i]);
        }
    }
};

/// exp(-x) of x = 0, step, 2 step, ...
template <std::size_t Count>
std::array<float, Count> bell(float step) {
    std::array<float, Count> out;
    for (std::size_t i = 0; i < Count; ++i) out[i] = std::exp(-static_cast<float>(i) * step);
    return out;
}

/// The directions that gradients around a corner have most: the first, and others nearly as strong.
std::vector<float> directionsOf(const Gradients& g, glm::vec2 pixel) {
    // Bins of 10 degrees; pixels to each side.
    constexpr int kBins = 36, kReach = 8, kWidth = 2 * kReach + 1;
    static_assert(kReach + 2 <= kMargin);
    // By the square of the distance: a normal distribution with a deviation of half the reach.
    static const auto weights = bell<kReach * kReach + 1>(2.0f / (kReach * kReach));
    std::array<float, kBins> bins{}, smooth{};
    // All samples are whole pixels apart, so they share their fractions between pixels.
    const int x0 = static_cast<int>(pixel.x - 0.5f), y0 = static_cast<int>(pixel.y - 0.5f);
    const float tx = pixel.x - 0.5f - static_cast<float>(x0),
                ty = pixel.y - 0.5f - static_cast<float>(y0);
    Around<kWidth * kWidth> around;
    for (int dy = -kReach; dy <= kReach; ++dy) {
        const auto line = [&](const Image<float>& from, std::array<float, kWidth * kWidth>& to) {
            const float *a = &from.at(x0 - kReach, y0 + dy), *b = a + from.width();
            float* out = to.data() + (dy + kReach) * kWidth;
            for (int i = 0; i < kWidth; ++i) {
                const float top = a[i] + (a[i + 1] - a[i]) * tx;
                const float bottom = b[i] + (b[i + 1] - b[i]) * tx;
                out[i] = top + (bottom - top) * ty;
            }
        };
        line(g.x, around.x);
        line(g.y, around.y);
    }
    around.measure();
    for (int dy = -kReach; dy <= kReach; ++dy) {
        for (int dx = -kReach; dx <= kReach; ++dx) {
            const int r2 = dx * dx + dy * dy;
            if (r2 > kReach * kReach) continue;
            const auto i = static_cast<std::size_t>((dy + kReach) * kWidth + dx + kReach);
            const float turn = around.turn[i] * kBins;
            const float weight = around.length[i] * weights[r2];
            const auto bin = static_cast<int>(turn);
            const float t = turn - static_cast<float>(bin);
            bins[bin % kBins] += weight * (1 - t);
            bins[(bin + 1) % kBins] += weight * t;
        }
    }
    const auto at = [&](const auto& b, int i) { return b[(i + kBins) % kBins]; };
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < kBins; ++i)
            smooth[i] = 0.25f * at(bins, i - 1) + 0.5f * at(bins, i) + 0.25f * at(bins, i + 1);
        bins = smooth;
    }
    const float highest = *std::max_element(bins.begin(), bins.end());
    std::vector<float> directions;
    for (int i = 0; i < kBins; ++i) {
        const float before = at(bins, i - 1), here = at(bins, i), after = at(bins, i + 1);
        if (here <= 0 || here < kAsFrequent * highest || here <= before || here < after) continue;
        const float peak = static_cast<float>(i) + peakOf(before, here, after);
        directions.push_back(peak * 2 * static_cast<float>(M_PI) / kBins);
        if (directions.size() == kMostDirections) break;
    }
    return directions;
}

/// How a sample is shared among the cells of a descriptor.
struct Sharing {
    int cell = 0;                    ///< the upper left of four
    std::array<float, 4> weights{};  ///< of the four
    float bell = 0;                  ///< less towards the edge
};

std::array<Sharing, kSamples * kSamples> sharings() {
    std::array<Sharing, kSamples * kSamples> out;
    for (int j = 0; j < kSamples; ++j)
        for (int i = 0; i < kSamples; ++i) {
            Sharing& s = out[j * kSamples + i];
            const float cx = (static_cast<float>(i) + 0.5f) / kCellSamples - 0.5f;
            const float cy = (static_cast<float>(j) + 0.5f) / kCellSamples - 0.5f;
            const int x = static_cast<int>(std::floor(cx)), y = static_cast<int>(std::floor(cy));
            const float tx = cx - static_cast<float>(x), ty = cy - static_cast<float>(y);
            s.cell = (y + 1) * kCellsAndMargin + x + 1;
            s.weights = {(1 - tx) * (1 - ty), tx * (1 - ty), (1 - tx) * ty, tx * ty};
            // A normal distribution whose deviation is half of a side. In halves of a spacing, so
            // that distances are whole.
            const int dx = 2 * i - (kSamples - 1), dy = 2 * j - (kSamples - 1);
            s.bell = std::exp(-static_cast<float>(dx * dx + dy * dy) / (2 * kSamples * kSamples));
        }
    return out;
}

Descriptor describe(const Gradients& g, glm::vec2 pixel, float direction) {
    static const auto shared = sharings();
    const glm::vec2 right(std::cos(direction), std::sin(direction)), down(-right.y, right.x);
    Around<kSamples * kSamples> around;
    const float lastX = static_cast<float>(g.x.width()) - kBeforeLast;
    const float lastY = static_cast<float>(g.x.height()) - kBeforeLast;
    const auto stride = static_cast<std::size_t>(g.x.width());
    for (int j = 0; j < kSamples; ++j) {
        const glm::vec2 row =
            pixel - 0.5f + (static_cast<float>(j) - kMiddleSample) * kSpacing * down;
        for (int i = 0; i < kSamples; ++i) {
            const glm::vec2 p = row + (static_cast<float>(i) - kMiddleSample) * kSpacing * right;
            const float px = std::clamp(p.x, 0.0f, lastX), py = std::clamp(p.y, 0.0f, lastY);
            const int x = static_cast<int>(px), y = static_cast<int>(py);
            const float tx = px - static_cast<float>(x), ty = py - static_cast<float>(y);
            const std::size_t at =
                static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x);
            const auto between = [&](const float* a) {
                const float* b = a + stride;
                const float top = a[0] + (a[1] - a[0]) * tx, bottom = b[0] + (b[1] - b[0]) * tx;
                return top + (bottom - top) * ty;
            };
            const float gx = between(g.x.data() + at), gy = between(g.y.data() + at);
            const auto k = static_cast<std::size_t>(j * kSamples + i);
            around.x[k] = gx * right.x + gy * right.y;
            around.y[k] = gx * down.x + gy * down.y;
        }
    }
    around.measure();
    // Shared among the two nearest cells in x and y and the two nearest directions.
    std::array<float, std::size_t{kCellsAndMargin} * kCellsAndMargin * kSlots> slots{};
    for (std::size_t k = 0; k < shared.size(); ++k) {
        const Sharing& s = shared[k];
        const float weight = around.length[k] * s.bell, d = around.turn[k] * kDirections;
        const int d0 = static_cast<int>(d);
        const float td = d - static_cast<float>(d0), first = weight * (1 - td),
                    second = weight * td;
        float* to = slots.data() + static_cast<std::size_t>(s.cell) * kSlots + d0;
        const auto add = [&](std::size_t cell, float share) {
            to[cell * kSlots] += first * share;
            to[cell * kSlots + 1] += second * share;
        };
        add(0, s.weights[0]);
        add(1, s.weights[1]);
        add(kCellsAndMargin, s.weights[2]);
        add(kCellsAndMargin + 1, s.weights[3]);
    }
    std::array<float, kDescriptorSize> bins;
    static_assert(kDescriptorSize == kDescriptorCells * kDescriptorCells * kDirections);
    float* to = bins.data();
    for (std::size_t y = 1; y <= kDescriptorCells; ++y)
        for (std::size_t x = 1; x <= kDescriptorCells; ++x, to += kDirections) {
            const float* from = slots.data() + (y * kCellsAndMargin + x) * kSlots;
            std::copy_n(from, kDirections, to);
            to[0] += from[kDirections];
            to[1] += from[kDirections + 1];
        }
    float sum = 1e-6f;  // never 0
    for (const float b : bins) sum += b;
    Descriptor out{};
    for (std::size_t i = 0; i < bins.size(); ++i)
        out[i] =
            static_cast<std::uint8_t>(std::min(255.0f, kCodeOfRoot * std::sqrt(bins[i] / sum)));
    return out;
}

}  // namespace

Features findFeatures(const WorkCopy& copy, int most) {
    // Of all corners: finer levels have more of them, and more exact ones.
    constexpr std::array<double, kLevels> kShares = {0.45, 0.27, 0.18, 0.10};
    Features out;
    Image<float> even = floatOf(copy.grey);
    for (int level = 0; level < kLevels; ++level) {
        const Image<float> image =
            level % 2 == 0 ? blurred(even) : blurred(betweenLevels(blurred(even)));
        if (level % 2 == 1) even = halved(even);
        if (std::min(image.width(), image.height()) < 3 * kMargin) break;
        const Gradients gradients = gradientsOf(image);
        const auto corners =
            cornersOf(cornerStrength(gradients), static_cast<std::size_t>(most * kShares[level]));
        const glm::vec2 scale = glm::vec2(copy.grey.size()) / glm::vec2(image.size());
        for (const Feature& corner : corners) {
            for (const float direction : directionsOf(gradients, corner.pixel)) {
                out.descriptors.push_back(describe(gradients, corner.pixel, direction));
                out.points.push_back({corner.pixel * scale, level, corner.strength});
            }
        }
    }
    return out;
}

}  // namespace stx::panorama
