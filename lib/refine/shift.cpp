#include "lib/refine/shift.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"

namespace stx {
namespace {

// Chosen by trial on Middlebury 2006, Aloe (tests/bench/pictures.md).
/// Brightness (0..1) is compared less its mean within so many pixels: cameras expose for
/// themselves.
constexpr int kMeanReach = 3;
/// Only pixels whose left and right neighbours differ by this much tell, every so many.
constexpr float kTexture = 0.03f;
constexpr int kEvery = 2;
/// Disparities of neighbours inside a surface differ by less; pixels.
constexpr float kInsideSurface = 0.75f;
/// Differences of brightness count as this large at most: larger ones come from places that are
/// hidden there.
constexpr float kMostDifference = 0.08f;
/// The number of shifts that are tried on each side of 0.
constexpr int kTries = 12;
/// The best must leave less than this share of the differences; fewer points tell nothing.
constexpr double kBetter = 0.98;
constexpr std::size_t kFewTextured = 1000;

/// Brightness less its local mean.
Image<float> detailOf(const Texture& texture) {
    const int w = texture.width(), h = texture.height();
    Image<float> grey(w, h), detail(w, h);
    for (std::size_t i = 0; i < grey.count(); ++i) {
        const glm::vec4 c = texture.at(i);
        grey.data()[i] = (c.x + c.y + c.z) / 3;
    }
    parallelForBlocks(0, h, 16, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < w; ++x) {
                float sum = 0, count = 0;
                for (int v = std::max(0, y - kMeanReach); v <= std::min(h - 1, y + kMeanReach); ++v)
                    for (int u = std::max(0, x - kMeanReach); u <= std::min(w - 1, x + kMeanReach);
                         ++u, ++count)
                        sum += grey.at(u, v);
                detail.at(x, y) = grey.at(x, y) - sum / count;
            }
        }
    });
    return detail;
}

/// Interpolates a row at x by Catmull and Rom, x >= 1 and < width - 2.
float between(const float* row, double x) {
    const int left = static_cast<int>(x);
    const float *p = row + left - 1, t = static_cast<float>(x - left);
    return p[1] + 0.5f * t *
                      (p[2] - p[0] +
                       t * (2 * p[0] - 5 * p[1] + 4 * p[2] - p[3] +
                            t * (3 * (p[1] - p[2]) + p[3] - p[0])));
}

struct TexturedPixel {
    int x, y;
};

/// Where textures inside surfaces are, so far from the sides that all pictures show them.
std::vector<TexturedPixel> texturedPoints(const Image<float>& disparities,
                                          const Image<float>& detail,
                                          std::span<const SidePicture> beside, double most) {
    std::vector<TexturedPixel> points;
    const auto inside = [&](int x, int y, float d) {
        const auto same = [&](int u, int v) {
            const float there = disparities.at(u, v);
            return hasPoint(there) && std::abs(there - d) < kInsideSurface;
        };
        return same(x - 1, y) && same(x + 1, y) && same(x, y - 1) && same(x, y + 1);
    };
    for (int y = 1; y + 1 < disparities.height(); y += kEvery) {
        for (int x = 1; x + 1 < disparities.width(); x += kEvery) {
            const float d = disparities.at(x, y);
            if (!hasPoint(d) || !inside(x, y, d) ||
                std::abs(detail.at(x + 1, y) - detail.at(x - 1, y)) < kTexture)
                continue;
            const bool shown = std::ranges::all_of(beside, [&](const SidePicture& p) {
                const double at = x - p.steps * d, room = std::abs(p.steps) * most;
                return at - room >= 1 && at + room < disparities.width() - 3;
            });
            if (shown) points.push_back({x, y});
        }
    }
    return points;
}

}  // namespace

double disparityShift(const Image<float>& disparities, const Texture& texture,
                      std::span<const SidePicture> beside, double most) {
    if (beside.empty()) return 0;
    const Image<float> own = detailOf(texture);
    const auto points = texturedPoints(disparities, own, beside, most);
    if (points.size() < kFewTextured) return 0;
    std::vector<Image<float>> others;
    for (const SidePicture& p : beside) others.push_back(detailOf(p.texture));
    std::array<double, 2 * kTries + 1> differences{};
    parallelFor(0, static_cast<std::int64_t>(differences.size()), [&](std::int64_t n) {
        const double shift = most * static_cast<double>(n - kTries) / kTries;
        double sum = 0;
        for (const TexturedPixel& p : points) {
            const double d = disparities.at(p.x, p.y) + shift;
            for (std::size_t k = 0; k < others.size(); ++k) {
                const float there = between(others[k].row(p.y).data(), p.x - beside[k].steps * d);
                sum += std::min(std::abs(there - own.at(p.x, p.y)), kMostDifference);
            }
        }
        differences[static_cast<std::size_t>(n)] = sum;
    });
    const auto best =
        static_cast<std::size_t>(std::ranges::min_element(differences) - differences.begin());
    if (best == 0 || best + 1 == differences.size() ||
        differences[best] > kBetter * differences[kTries])
        return 0;
    const double before = differences[best - 1], after = differences[best + 1];
    const double beyond = 0.5 * (before - after) / (before + after - 2 * differences[best]);
    return most * (static_cast<double>(best) - kTries + beyond) / kTries;
}

}  // namespace stx
