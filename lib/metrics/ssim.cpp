#include "lib/metrics/ssim.hpp"

#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

constexpr int kRadius = 5;
constexpr double kSigma = 1.5;
constexpr int kWindowRowsPerTask = 32;

using Window = std::array<double, 2 * kRadius + 1>;

Window gaussianWindow() {
    Window w{};
    double sum = 0;
    for (int i = -kRadius; i <= kRadius; ++i) {
        w[i + kRadius] = std::exp(-0.5 * i * i / (kSigma * kSigma));
        sum += w[i + kRadius];
    }
    for (auto& v : w) v /= sum;
    return w;
}

// Weighted sums over a window: a, b, a*a, b*b, a*b, and the weights.
using Moments = std::array<double, 6>;

}  // namespace

Image<float> ssimMap(const Image<float>& a, const Image<float>& b, double peak,
                     const Image<std::uint8_t>* mask, const Job* job) {
    const Window window = gaussianWindow();
    const double c1 = (0.01 * peak) * (0.01 * peak);
    const double c2 = (0.03 * peak) * (0.03 * peak);
    const int width = a.width(), height = a.height();
    Image<float> out(width, height);
    parallelForBlocks(0, height, kWindowRowsPerTask, [&](std::int64_t from, std::int64_t to) {
        std::vector<Moments> column(width);
        for (int y = static_cast<int>(from); y < to; ++y) {
            if (job && !job->checkCancelled()) return;
            const int y0 = std::max(0, y - kRadius), y1 = std::min(height - 1, y + kRadius);
            std::fill(column.begin(), column.end(), Moments{});
            for (int v = y0; v <= y1; ++v) {
                const double w = window[v - y + kRadius];
                const auto rowA = a.row(v), rowB = b.row(v);
                for (int x = 0; x < width; ++x) {
                    if (mask && mask->at(x, v) < 128) continue;
                    const double pa = rowA[x], pb = rowB[x];
                    auto& m = column[x];
                    m[0] += w * pa;
                    m[1] += w * pb;
                    m[2] += w * pa * pa;
                    m[3] += w * pb * pb;
                    m[4] += w * pa * pb;
                    m[5] += w;
                }
            }
            for (int x = 0; x < width; ++x) {
                const int x0 = std::max(0, x - kRadius), x1 = std::min(width - 1, x + kRadius);
                if (mask && mask->at(x, y) < 128) {
                    out.at(x, y) = 1.0f;
                    continue;
                }
                Moments m{};
                for (int u = x0; u <= x1; ++u) {
                    const double w = window[u - x + kRadius];
                    for (std::size_t k = 0; k < m.size(); ++k) m[k] += w * column[u][k];
                }
                for (std::size_t k = 0; k + 1 < m.size(); ++k) m[k] /= m.back();
                const double varA = m[2] - m[0] * m[0], varB = m[3] - m[1] * m[1];
                const double cov = m[4] - m[0] * m[1];
                out.at(x, y) =
                    static_cast<float>(((2 * m[0] * m[1] + c1) * (2 * cov + c2)) /
                                       ((m[0] * m[0] + m[1] * m[1] + c1) * (varA + varB + c2)));
            }
        }
    });
    return out;
}

double meanSsim(const Image<float>& a, const Image<float>& b, double peak,
                const Image<std::uint8_t>* mask, const Job* job) {
    const Image<float> map = ssimMap(a, b, peak, mask, job);
    const auto mean = [&](int border) -> std::pair<double, std::int64_t> {
        double sum = 0;
        std::int64_t n = 0;
        for (int y = border; y < map.height() - border; ++y) {
            double row = 0;
            for (int x = border; x < map.width() - border; ++x) {
                if (mask && mask->at(x, y) < 128) continue;
                row += map.at(x, y);
                ++n;
            }
            sum += row;
        }
        return {sum, n};
    };
    auto [sum, n] = mean(kRadius);
    if (n == 0) std::tie(sum, n) = mean(0);
    return n ? sum / static_cast<double>(n) : 1.0;
}

}  // namespace stx
