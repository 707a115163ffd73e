#include <cmath>

#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/panorama/overlap.hpp"

namespace stx::panorama {
namespace {

/// One cell that two pictures see: logarithm of their light's ratio, and by how much they differ in
/// the square and the fourth power of the distance from their middles.
struct LightRatio {
    double log = 0;
    glm::dvec2 powers{0};
    bool upper = false;  ///< in the upper half of what they share
};

enum class Half { both, upper, lower };

/// How far a fit is off that has no ratios to be measured by: farther than any that has.
constexpr double kNoRatios = 1e9;

struct VignettingFit {
    glm::dvec2 law{0};       ///< of the square and of the fourth power
    double off = kNoRatios;  ///< median of what is left of the ratios' differences
};

/// The square of nine tenths of the way to the corners, where the loss of light is measured: at the
/// corners themselves few pictures overlap.
constexpr double kNearCorner2 = 0.9 * 0.9;

/// Cauchy's scale is so many times the median of what is left, and at least this; logarithms.
constexpr double kScaleOfMedian = 2, kLeastScale = 1e-3;
/// Weights of the assumption that corners lose no light: for each ratio, and so little more that
/// the equations can be solved without any ratio.
constexpr double kNoneIsLikely = 1e-4, kSolvable = 1e-9;
/// A law may make light so much brighter somewhere (logarithm), and is looked at in so many places
/// between the middle and the corner.
constexpr double kMostBrighter = 0.02;
constexpr int kPlacesOfLaw = 10;

/// How much less light there is near the corners, logarithm.
double lossOf(glm::dvec2 law) {
    return -(kNearCorner2 * law.x + kNearCorner2 * kNearCorner2 * law.y);
}

std::vector<LightRatio> ratiosOf(const Footprint& a, const Footprint& b, int gridWidth) {
    std::vector<LightRatio> out;
    const int top = std::max(a.box.y, b.box.y);
    const int bottom = std::min(a.box.y + a.box.height, b.box.y + b.box.height);
    shared(a, b, gridWidth, [&](glm::ivec2 pa, glm::ivec2 pb) {
        if (pa.x % 2 != 0 || pa.y % 2 != 0) return;  // a quarter of the cells is enough
        const glm::vec3 ca = a.colour.at(pa.x, pa.y), cb = b.colour.at(pb.x, pb.y);
        LightRatio ratio;
        for (int c = 0; c < 3; ++c) {
            if (std::min(ca[c], cb[c]) < kDarkest || std::max(ca[c], cb[c]) > kLightest) return;
            ratio.log += std::log(ca[c] / cb[c]) / 3;
        }
        const double ra = a.radius2.at(pa.x, pa.y), rb = b.radius2.at(pb.x, pb.y);
        ratio.powers = {ra - rb, ra * ra - rb * rb};
        ratio.upper = 2 * (pa.y + a.box.y) < top + bottom;
        out.push_back(ratio);
    });
    return out;
}

/// Least squares over the ratios of all pairs, each with a ratio of gains of its own; weights as of
/// Cauchy's distribution: what moved, and edges, are far off.
VignettingFit fitVignetting(const std::vector<std::vector<LightRatio>>& pairs, Half half,
                            bool flat) {
    constexpr int kFitRounds = 8;
    const auto counts = [&](const LightRatio& r) {
        return half == Half::both || r.upper == (half == Half::upper);
    };
    std::vector<double> offsets(pairs.size(), 0.0);
    VignettingFit fit;
    const auto measure = [&] {
        std::vector<std::vector<double>> off(pairs.size());
        parallelFor(0, pairs.size(), [&](std::size_t p) {
            std::vector<double> left;
            for (const LightRatio& r : pairs[p])
                if (counts(r)) left.push_back(r.log - glm::dot(fit.law, r.powers));
            offsets[p] = medianOf(left);
            for (double& value : left) value = std::abs(value - offsets[p]);
            off[p] = std::move(left);
        });
        std::vector<double> all;
        for (const auto& one : off) all.insert(all.end(), one.begin(), one.end());
        fit.off = medianOf(std::move(all), kNoRatios);
    };
    measure();
    struct Sums {
        double w = 0, y = 0, xx = 0, xy = 0, yy = 0, bx = 0, by = 0;
        glm::dvec2 x{0};
    };
    for (int round = 0; round < kFitRounds && !flat; ++round) {
        const double scale = std::max(kScaleOfMedian * fit.off, kLeastScale);
        std::vector<Sums> sums(pairs.size());
        parallelFor(0, pairs.size(), [&](std::size_t p) {
            Sums& s = sums[p];
            for (const LightRatio& r : pairs[p]) {
                if (!counts(r)) continue;
                const double off = (r.log - offsets[p] - glm::dot(fit.law, r.powers)) / scale;
                const double w = 1 / (1 + off * off);
                s.w += w;
                s.y += w * r.log;
                s.x += w * r.powers;
                s.xx += w * r.powers.x * r.powers.x;
                s.xy += w * r.powers.x * r.powers.y;
                s.yy += w * r.powers.y * r.powers.y;
                s.bx += w * r.powers.x * r.log;
                s.by += w * r.powers.y * r.log;
            }
        });
        // The ratio of the gains of each pair is eliminated.
        double xx = kSolvable, xy = 0, yy = kSolvable, bx = 0, by = 0;
        for (const Sums& s : sums) {
            if (s.w <= 0) continue;
            xx += s.xx - s.x.x * s.x.x / s.w + kNoneIsLikely * s.w;
            xy += s.xy - s.x.x * s.x.y / s.w;
            yy += s.yy - s.x.y * s.x.y / s.w + kNoneIsLikely * s.w;
            bx += s.bx - s.x.x * s.y / s.w;
            by += s.by - s.x.y * s.y / s.w;
        }
        const double det = xx * yy - xy * xy;
        if (!(det > 0)) break;
        fit.law = {(yy * bx - xy * by) / det, (xx * by - xy * bx) / det};
        measure();
    }
    return fit;
}

}  // namespace

Vignetting findVignetting(const std::vector<Footprint>& prints, int gridWidth) {
    constexpr std::size_t kFewest = 400;  // cells that two pictures share
    // Losses near the corners (logarithms) that are believed, and the share of what differs without
    // the law that may be left with it.
    constexpr double kLeastLoss = 0.03, kMostLoss = 1.5, kBetter = 0.9;
    std::vector<std::pair<std::size_t, std::size_t>> both;
    for (std::size_t a = 0; a < prints.size(); ++a)
        for (std::size_t b = a + 1; b < prints.size(); ++b)
            if (boxesMeet(prints[a], prints[b], gridWidth)) both.emplace_back(a, b);
    std::vector<std::vector<LightRatio>> pairs(both.size());
    parallelFor(0, both.size(), [&](std::size_t p) {
        pairs[p] = ratiosOf(prints[both[p].first], prints[both[p].second], gridWidth);
    });
    std::size_t cells = 0;
    for (const auto& pair : pairs) cells += pair.size();
    if (cells < kFewest) return {};
    const VignettingFit without = fitVignetting(pairs, Half::both, true);
    const VignettingFit fit = fitVignetting(pairs, Half::both, false);
    // Darker outwards, in all pictures alike, and so that it explains much of what differs.
    const double loss = lossOf(fit.law);
    if (loss < kLeastLoss || loss > kMostLoss || fit.off > kBetter * without.off) return {};
    for (int step = 1; step <= kPlacesOfLaw; ++step) {
        const double r2 = static_cast<double>(step) / kPlacesOfLaw;
        if (fit.law.x * r2 + fit.law.y * r2 * r2 > kMostBrighter) return {};
    }
    for (const Half half : {Half::upper, Half::lower}) {
        const double own = lossOf(fitVignetting(pairs, half, false).law);
        if (own < loss / 2 || own > 2 * loss) return {};
    }
    return {fit.law.x, fit.law.y};
}

void clearVignetting(std::vector<Footprint>& prints, const Vignetting& vignetting) {
    if (vignetting.none()) return;
    parallelFor(0, prints.size(), [&](std::size_t i) {
        Footprint& f = prints[i];
        f.clearing = Image<float>(f.box.width, f.box.height, 1.0f);
        for (std::size_t p = 0; p < f.clearing.count(); ++p)
            f.clearing.pixels()[p] = vignetting.clearing(f.radius2.pixels()[p]);
    });
}

}  // namespace stx::panorama
