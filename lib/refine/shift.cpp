#include "lib/refine/shift.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <glm/glm.hpp>

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
/// Rows lie beside each other by more than so many standard errors, and by 0.02 to 0.6 pixels:
/// those of 2003 and 2005 by 0.1 (Dolls and Cones gain 0.2 dB); what is farther off is not
/// rectified.
constexpr double kSureRows = 5, kLeastRows = 0.02, kMostRows = 0.6;
constexpr int kRowRounds = 3;
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
    parallelFor(0, h, 16, [&](int y) {
        for (int x = 0; x < w; ++x) {
            float sum = 0, count = 0;
            for (int v = std::max(0, y - kMeanReach); v <= std::min(h - 1, y + kMeanReach); ++v)
                for (int u = std::max(0, x - kMeanReach); u <= std::min(w - 1, x + kMeanReach);
                     ++u, ++count)
                    sum += grey.at(u, v);
            detail.at(x, y) = grey.at(x, y) - sum / count;
        }
    });
    return detail;
}

/// Between four values, `t` (0..1) from the second to the third (Catmull and Rom).
float between(const float* p, float t) {
    return p[1] + 0.5f * t *
                      (p[2] - p[0] +
                       t * (2 * p[0] - 5 * p[1] + 4 * p[2] - p[3] +
                            t * (3 * (p[1] - p[2]) + p[3] - p[0])));
}

/// Between the pixels of a row, 1 <= x < width - 2.
float inRow(const float* row, double x) {
    const int left = static_cast<int>(x);
    return between(row + left - 1, static_cast<float>(x - left));
}

/// Between the pixels of a picture, `down` from a row, -1 to 1.
float inPicture(const Image<float>& picture, double x, int y, double down) {
    if (down == 0) return inRow(picture.row(y).data(), x);
    const int above = y + static_cast<int>(std::floor(down));
    std::array<float, 4> column{};
    for (int k = 0; k < 4; ++k) {
        const int v = std::clamp(above - 1 + k, 0, picture.height() - 1);
        column[k] = inRow(picture.row(v).data(), x);
    }
    return between(column.data(), static_cast<float>(down - std::floor(down)));
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

/// What is added to the disparities of the points, -most to most, such that the other pictures
/// differ least from `own`, each so much lower; 0 where that is not clear.
double shiftAlongRows(const Image<float>& disparities, const Image<float>& own,
                      std::span<const Image<float>> others, std::span<const SidePicture> beside,
                      std::span<const double> down, std::span<const TexturedPixel> points,
                      double most) {
    std::array<double, 2 * kTries + 1> differences{};
    parallelFor(0, differences.size(), [&](std::int64_t n) {
        const double shift = most * static_cast<double>(n - kTries) / kTries;
        double sum = 0;
        for (const TexturedPixel& p : points) {
            const double d = disparities.at(p.x, p.y) + shift;
            for (std::size_t k = 0; k < others.size(); ++k) {
                const float there = inPicture(others[k], p.x - beside[k].steps * d, p.y, down[k]);
                sum += std::min(std::abs(there - own.at(p.x, p.y)), kMostDifference);
            }
        }
        differences[n] = sum;
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

/// How much lower `other` shows the points than `own` does; 0 where that is not clear. Both ways
/// are solved for together, with the mean slopes of both pictures, which a shift of either leaves
/// unbiased (Lucas & Kanade 1981).
double rowsBeside(const Image<float>& own, const Image<float>& other, double steps, double shift,
                  const Image<float>& disparities, std::span<const TexturedPixel> points) {
    glm::dvec2 beside(0);  // along, down
    double error = 0;
    for (int round = 0; round < kRowRounds; ++round) {
        glm::dmat2 normal(0);
        glm::dvec2 right(0);
        double left = 0, count = 0;
        for (const TexturedPixel& p : points) {
            const auto there = [&](double along, double down) {
                const double x = p.x - steps * (disparities.at(p.x, p.y) + shift) + beside.x;
                return inPicture(other, std::clamp(x + along, 1.0, own.width() - 2.01), p.y,
                                 beside.y + down);
            };
            const double apart = own.at(p.x, p.y) - there(0, 0);
            if (std::abs(apart) > kMostDifference) continue;
            const glm::dvec2 slope = 0.25 * glm::dvec2(own.at(p.x + 1, p.y) - own.at(p.x - 1, p.y) +
                                                           there(1, 0) - there(-1, 0),
                                                       own.at(p.x, p.y + 1) - own.at(p.x, p.y - 1) +
                                                           there(0, 1) - there(0, -1));
            normal += glm::outerProduct(slope, slope);
            right += apart * slope;
            left += apart * apart;
            ++count;
        }
        if (!(glm::determinant(normal) > 0)) return 0;
        const glm::dmat2 inverse = glm::inverse(normal);
        beside += inverse * right;
        error = std::sqrt(left / count * inverse[1][1]);
        if (!(std::abs(beside.x) <= kMostRows && std::abs(beside.y) <= kMostRows)) return 0;
    }
    return std::abs(beside.y) > std::max(kLeastRows, kSureRows * error) ? beside.y : 0;
}

}  // namespace

PictureShift pictureShift(const Image<float>& disparities, const Texture& texture,
                          std::span<const SidePicture> beside, double most) {
    PictureShift out;
    out.down.assign(beside.size(), 0.0);
    if (beside.empty() || texture.width() != disparities.width() ||
        texture.height() != disparities.height())
        return out;
    const Image<float> own = detailOf(texture);
    const auto points = texturedPoints(disparities, own, beside, most);
    if (points.size() < kFewTextured) return out;
    std::vector<Image<float>> others;
    for (const SidePicture& p : beside) others.push_back(detailOf(p.texture));
    out.disparity = shiftAlongRows(disparities, own, others, beside, out.down, points, most);
    parallelFor(0, others.size(), [&](std::size_t k) {
        out.down[k] =
            rowsBeside(own, others[k], beside[k].steps, out.disparity, disparities, points);
    });
    // Rows that lie right show the rest more clearly.
    if (std::ranges::any_of(out.down, [](double d) { return d != 0; }))
        out.disparity = shiftAlongRows(disparities, own, others, beside, out.down, points, most);
    return out;
}

}  // namespace stx
