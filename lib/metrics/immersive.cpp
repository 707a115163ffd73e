#include "lib/metrics/immersive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "lib/base/parallel.hpp"
#include "lib/metrics/seen_pixel.hpp"

namespace stx {
namespace {

constexpr int kReach = 2;                          ///< B of IV-PSNR: 5x5 pixels
constexpr double kUnnoticed = 0.01;                ///< MUD, of white
constexpr std::array<double, 3> kCounts{4, 1, 1};  ///< of Y, Cb, Cr

/// Y, Cb and Cr of a picture, white as 1; of pixels that do not count infinite, like none.
using Planes = std::array<Image<float>, 3>;

template <class P>
Planes planesOf(const Image<P>& picture, const CompareSettings& settings, double peak) {
    Planes planes;
    planes.fill(Image<float>(picture.width(), picture.height()));
    parallelFor(0, picture.height(), [&](int y) {
        for (int x = 0; x < picture.width(); ++x) {
            if (!settings.counts(x, y)) {
                for (auto& plane : planes) plane.at(x, y) = std::numeric_limits<float>::infinity();
                continue;
            }
            const glm::dvec3 c =
                glm::dvec3(metrics::seenPixel(picture.at(x, y), settings.background)) / peak;
            const double luma = 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
            planes[0].at(x, y) = static_cast<float>(luma);
            planes[1].at(x, y) = static_cast<float>((c.b - luma) / 1.8556);
            planes[2].at(x, y) = static_cast<float>((c.r - luma) / 1.5748);
        }
    });
    return planes;
}

/// The sum over the pixels that count of the squared difference to the likest neighbour.
double likestSum(const Image<float>& from, const Image<float>& to, float shift,
                 const CompareSettings& settings) {
    const int width = from.width(), height = from.height();
    std::vector<double> rows(static_cast<std::size_t>(height));
    parallelFor(0, height, [&](int y) {
        std::vector<float> best(static_cast<std::size_t>(width),
                                std::numeric_limits<float>::infinity());
        const float* a = &from.at(0, y);
        for (int v = std::max(0, y - kReach); v <= std::min(height - 1, y + kReach); ++v) {
            const float* b = &to.at(0, v);
            for (int dx = -kReach; dx <= kReach; ++dx) {
                const int end = std::min(width, width - dx);
                for (int x = std::max(0, -dx); x < end; ++x) {
                    const float d = a[x] + shift - b[x + dx];
                    best[x] = std::min(best[x], d * d);
                }
            }
        }
        double sum = 0;
        for (int x = 0; x < width; ++x)
            if (settings.counts(x, y)) sum += static_cast<double>(best[x]);
        rows[y] = sum;
    });
    double sum = 0;
    for (const double row : rows) sum += row;
    return sum;
}

}  // namespace

template <class P>
void ImmersiveComparison::addPair(const Image<P>& a, const Image<P>& b,
                                  const CompareSettings& settings, double peak) {
    const Planes first = planesOf(a, settings, peak), second = planesOf(b, settings, peak);
    const int width = a.width(), height = a.height();
    std::int64_t pixels = 0;
    std::array<double, 3> difference{};
    for (int y = 0; y < height; ++y) {
        // Of the row's centre, with the poles at the picture's upper and lower edge.
        const double weight = std::cos((y + 0.5 - height / 2.0) * std::numbers::pi / height);
        for (int x = 0; x < width; ++x) {
            if (!settings.counts(x, y)) continue;
            ++pixels;
            for (std::size_t c = 0; c < 3; ++c) {
                const double d = static_cast<double>(second[c].at(x, y)) -
                                 static_cast<double>(first[c].at(x, y));
                difference[c] += d;
                if (d != 0) identical_ = false;
                if (c == 0) weighted_ += weight * d * d;
            }
            weights_ += weight;
        }
    }
    panoramas_ = panoramas_ && width == 2 * height;
    pixels_ += pixels;
    for (std::size_t c = 0; c < 3; ++c) {
        const auto shift = static_cast<float>(
            std::clamp(difference[c] / static_cast<double>(std::max<std::int64_t>(pixels, 1)),
                       -kUnnoticed, kUnnoticed));
        squared_[0][c] += likestSum(first[c], second[c], shift, settings);
        squared_[1][c] += likestSum(second[c], first[c], -shift, settings);
    }
}

void ImmersiveComparison::add(const Image<glm::u8vec4>& a, const Image<glm::u8vec4>& b,
                              const CompareSettings& settings) {
    addPair(a, b, settings, 255.0);
}
void ImmersiveComparison::add(const Image<glm::vec4>& a, const Image<glm::vec4>& b,
                              const CompareSettings& settings) {
    addPair(a, b, settings, settings.peak);
}

void ImmersiveComparison::add(const ImmersiveComparison& other) {
    for (std::size_t d = 0; d < 2; ++d)
        for (std::size_t c = 0; c < 3; ++c) squared_[d][c] += other.squared_[d][c];
    weighted_ += other.weighted_;
    weights_ += other.weights_;
    pixels_ += other.pixels_;
    panoramas_ = panoramas_ && other.panoramas_;
    identical_ = identical_ && other.identical_;
}

std::optional<double> ImmersiveComparison::ivPsnr() const {
    if (identical_) return {};
    double lower = std::numeric_limits<double>::infinity();
    for (const auto& squared : squared_) {
        double sum = 0, counts = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double error = std::max(squared[c], 1.0 / (255.0 * 255.0));
            sum += kCounts[c] * 10.0 * std::log10(static_cast<double>(pixels_) / error);
            counts += kCounts[c];
        }
        lower = std::min(lower, sum / counts);
    }
    return lower;
}

std::optional<double> ImmersiveComparison::wsPsnrY() const {
    if (identical_ || !panoramas_ || !(weighted_ > 0)) return {};
    return 10.0 * std::log10(weights_ / weighted_);
}

}  // namespace stx
