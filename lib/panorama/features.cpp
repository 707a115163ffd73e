#include "lib/panorama/features.hpp"

#include <algorithm>
#include <cmath>

namespace stx::panorama {
namespace {

constexpr int kLevels = 4;
constexpr int kMargin = 10;       ///< pixels of a level without corners
constexpr int kCells = 8;         ///< parts along each side that share the corners
constexpr float kSpacing = 1.2f;  ///< pixels between the 16 x 16 samples of a descriptor

Image<float> floatOf(const Image<std::uint8_t>& grey) {
    Image<float> out(grey.width(), grey.height());
    for (std::size_t i = 0; i < out.count(); ++i) out.pixels()[i] = grey.pixels()[i];
    return out;
}

/// 1 4 6 4 1 in both directions, into an image of the same size.
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
        xx.pixels()[i] = (a * c - b * b) / (a + c + 1e-3f);
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
            if (s < 2.0f) continue;  // codes: noise of a good picture
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
            cells[static_cast<std::size_t>(y * kCells / h * kCells + x * kCells / w)].push_back(f);
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

glm::vec2 gradientAt(const Gradients& g, glm::vec2 pixel) {
    const float px = std::clamp(pixel.x - 0.5f, 0.0f, g.x.width() - 1.001f);
    const float py = std::clamp(pixel.y - 0.5f, 0.0f, g.x.height() - 1.001f);
    const int x = static_cast<int>(px), y = static_cast<int>(py);
    const float tx = px - static_cast<float>(x), ty = py - static_cast<float>(y);
    const auto mix = [&](const Image<float>& i) {
        const float *a = &i.at(x, y), *b = &i.at(x, y + 1);
        const float top = a[0] + (a[1] - a[0]) * tx, bottom = b[0] + (b[1] - b[0]) * tx;
        return top + (bottom - top) * ty;
    };
    return {mix(g.x), mix(g.y)};
}

/// The angle of a vector as a share of a turn, 0..1, to 1e-5: arc tangents by a polynomial.
float turnOf(glm::vec2 v) {
    const float x = std::abs(v.x), y = std::abs(v.y);
    const float a = std::min(x, y) / std::max(std::max(x, y), 1e-20f), s = a * a;
    float angle = ((-0.0464964749f * s + 0.15931422f) * s - 0.327622764f) * s * a + a;
    angle *= 0.5f / static_cast<float>(M_PI);
    if (y > x) angle = 0.25f - angle;
    if (v.x < 0) angle = 0.5f - angle;
    return v.y < 0 ? 1 - angle : angle;
}

/// exp(-x) of x = 0, step, 2 step...
template <std::size_t Count>
std::array<float, Count> bell(float step) {
    std::array<float, Count> out;
    for (std::size_t i = 0; i < Count; ++i) out[i] = std::exp(-static_cast<float>(i) * step);
    return out;
}

/// The directions that gradients around a corner have most: the first, and others nearly as strong.
std::vector<float> directionsOf(const Gradients& g, glm::vec2 pixel) {
    constexpr int kBins = 36;
    static const auto weights = bell<65>(1.0f / 32);  // by the square of the distance
    std::array<float, kBins> bins{}, smooth{};
    for (int dy = -8; dy <= 8; ++dy) {
        for (int dx = -8; dx <= 8; ++dx) {
            const int r2 = dx * dx + dy * dy;
            if (r2 > 64) continue;
            const glm::vec2 v = gradientAt(g, pixel + glm::vec2(dx, dy));
            const float turn = turnOf(v) * kBins;
            const float weight = glm::length(v) * weights[static_cast<std::size_t>(r2)];
            const auto bin = static_cast<int>(turn);
            const float t = turn - static_cast<float>(bin);
            bins[static_cast<std::size_t>(bin % kBins)] += weight * (1 - t);
            bins[static_cast<std::size_t>((bin + 1) % kBins)] += weight * t;
        }
    }
    const auto at = [&](const auto& b, int i) {
        return b[static_cast<std::size_t>((i + kBins) % kBins)];
    };
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < kBins; ++i)
            smooth[static_cast<std::size_t>(i)] =
                0.25f * at(bins, i - 1) + 0.5f * at(bins, i) + 0.25f * at(bins, i + 1);
        bins = smooth;
    }
    const float highest = *std::max_element(bins.begin(), bins.end());
    std::vector<float> directions;
    for (int i = 0; i < kBins; ++i) {
        const float before = at(bins, i - 1), here = at(bins, i), after = at(bins, i + 1);
        if (here <= 0 || here < 0.8f * highest || here <= before || here < after) continue;
        const float peak = static_cast<float>(i) + peakOf(before, here, after);
        directions.push_back(peak * 2 * static_cast<float>(M_PI) / kBins);
        if (directions.size() == 2) break;
    }
    return directions;
}

Descriptor describe(const Gradients& g, glm::vec2 pixel, float direction) {
    const glm::vec2 right(std::cos(direction), std::sin(direction)), down(-right.y, right.x);
    // By half the square of the distance in halves of the spacing: at 8 spacings exp(-1/2).
    static const auto weights = bell<226>(1.0f / 256);
    std::array<float, 128> bins{};
    for (int j = 0; j < 16; ++j) {
        for (int i = 0; i < 16; ++i) {
            const glm::vec2 offset((static_cast<float>(i) - 7.5f) * kSpacing,
                                   (static_cast<float>(j) - 7.5f) * kSpacing);
            const glm::vec2 v = gradientAt(g, pixel + offset.x * right + offset.y * down);
            const glm::vec2 turned(glm::dot(v, right), glm::dot(v, down));
            const int dx = 2 * i - 15, dy = 2 * j - 15;
            const float weight =
                glm::length(v) * weights[static_cast<std::size_t>((dx * dx + dy * dy) / 2)];
            if (weight <= 0) continue;
            const float d = turnOf(turned) * 8;
            // Shared among the two nearest cells in x and y and the two nearest directions.
            const float cx = (static_cast<float>(i) + 0.5f) / 4 - 0.5f;
            const float cy = (static_cast<float>(j) + 0.5f) / 4 - 0.5f;
            const int x0 = static_cast<int>(std::floor(cx)), y0 = static_cast<int>(std::floor(cy));
            const int d0 = static_cast<int>(d);
            const float tx = cx - static_cast<float>(x0), ty = cy - static_cast<float>(y0),
                        td = d - static_cast<float>(d0);
            for (int k = 0; k < 8; ++k) {
                const int x = x0 + (k & 1), y = y0 + (k >> 1 & 1), dir = (d0 + (k >> 2)) % 8;
                if (x < 0 || y < 0 || x > 3 || y > 3) continue;
                bins[static_cast<std::size_t>((y * 4 + x) * 8 + dir)] +=
                    weight * ((k & 1) ? tx : 1 - tx) * ((k >> 1 & 1) ? ty : 1 - ty) *
                    ((k >> 2) ? td : 1 - td);
            }
        }
    }
    float sum = 1e-6f;
    for (const float b : bins) sum += b;
    Descriptor out{};
    for (std::size_t i = 0; i < bins.size(); ++i)
        out[i] = static_cast<std::uint8_t>(std::min(255.0f, 700 * std::sqrt(bins[i] / sum)));
    return out;
}

}  // namespace

Features findFeatures(const WorkCopy& copy, int most) {
    // Finer levels have more to say, and are more exact.
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
            cornersOf(cornerStrength(gradients),
                      static_cast<std::size_t>(most * kShares[static_cast<std::size_t>(level)]));
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
