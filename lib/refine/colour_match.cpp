#include "lib/refine/colour_match.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace stx {
namespace {

/// Colours outside of this range (0..1) do not count: they are clipped, or nothing but noise.
constexpr double kDarkest = 0.03, kBrightest = 0.97;
/// The fewest points from which a light is measured. Each place counts twice, once for either view:
/// with 50, bars of 126 pixels that one view of 26x19 showed changed by 1.8 %. With 200, light of
/// their own costs the statue's views 2.2 dB.
constexpr std::size_t kFewColours = 100;
/// Points further from the line than so many standard deviations do not count (Tukey's biweight:
/// 95 % of the efficiency of least squares under normal noise). At first more do, since surfaces
/// of one colour would hide what happens to the others.
constexpr double kBiweight = 4.685;
constexpr std::array<double, 8> kLeastBand = {0.2, 0.14, 0.1, 0.07, 0.04, 0, 0, 0};
/// A median of absolute values is this share of a standard deviation.
constexpr double kMedianOfNormal = 0.6745;
/// The error that rounding to 8 bits leaves (0..1).
constexpr double kHalfStep = 0.5 / 255;
constexpr double kMostGain = 2.0, kMostOffset = 0.25;
/// The error of a mean of colours however many points there are, since light varies over a surface.
constexpr double kMiddleDoubt = 0.001;
/// The variance of a ratio of spreads of colours that have nothing to do with each other.
constexpr double kLooseDoubt = 0.25;
/// The usual size of an offset; where colours hardly spread, a difference is taken for a gain.
constexpr double kUsualOffset = 0.01;
/// A difference is one when it is as many times what pairs contradict each other by, and at least
/// this large. Views of one light that are a few pixels wide come to 5.8 steps of 8 bits and to
/// three times; views with a light of their own to 17 and more, and to ten times.
constexpr double kClear = 4.0, kVisible = 6.0 / 255;
/// The least where no pair closes a ring of others, so that nothing can contradict.
constexpr double kVisibleAlone = 10.0 / 255;
/// From this many times that on it is undone in full, less below: frames of a film, each matched by
/// itself, must not jump where a difference is now taken for one and now not.
constexpr double kSure = 1.5;
/// How clear a difference is, times the share of what pairs differ by that the maps undo: less than
/// the first is sampling, as where views show a plate edge on. Exact sets come to 0.32 at most, a
/// kitchen of 7-Scenes to 0.52, one darkened view of 6 to 40 to 0.82 and more.
constexpr double kWorth = 0.35, kSureWorth = 0.46;
/// The weight of the assumption that views do not differ; lines weigh thousands.
constexpr double kNothingDiffers = 1e-2;
constexpr int kSweeps = 2000;
constexpr double kSettled = 1e-8;

/// The middle one, or the mean of two: two views meet halfway.
double middleOf(std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2 != 0) return *middle;
    return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

bool tellsLight(double a, double b) {
    return a > kDarkest && b > kDarkest && a < kBrightest && b < kBrightest;
}

/// b = gain * a + offset, of one channel of a pair of views.
struct Line {
    std::size_t a = 0, b = 0;
    double gain = 1, offset = 0;
    double meanA = 0, meanB = 0, spread = 0;
    double gainWeight = 0, middleWeight = 0;  ///< one over a variance; 0 = tells nothing

    [[nodiscard]] double at(double value) const { return gain * value + offset; }
};

Line fitLine(const SharedColours& pair, int channel) {
    Line line;
    line.a = pair.a;
    line.b = pair.b;
    std::vector<std::pair<double, double>> points;
    std::vector<double> values;
    for (const LitPair& p : pair.points) {
        const double a = p.a[channel], b = p.b[channel];
        if (!tellsLight(a, b)) continue;
        points.emplace_back(a, b);
        values.push_back(b / a);
    }
    if (points.size() < kFewColours) return line;
    line.gain = middleOf(values);
    for (const double leastBand : kLeastBand) {
        const double across = std::sqrt(0.5 * (1 + line.gain * line.gain));
        for (std::size_t i = 0; i < points.size(); ++i)
            values[i] = std::abs(line.at(points[i].first) - points[i].second) / across;
        const double noise = std::max(middleOf(values) / kMedianOfNormal, kHalfStep);
        const double band = across * std::max(kBiweight * noise, leastBand);
        double n = 0, sumA = 0, sumB = 0, aa = 0, bb = 0, ab = 0;
        for (const auto& [a, b] : points) {
            const double e = (line.at(a) - b) / band;
            const double inside = std::max(1 - e * e, 0.0), w = inside * inside;
            n += w;
            sumA += w * a;
            sumB += w * b;
            aa += w * a * a;
            bb += w * b * b;
            ab += w * a * b;
        }
        if (!(n > 1)) return line;
        line.meanA = sumA / n;
        line.meanB = sumB / n;
        const double varA = std::max(aa / n - line.meanA * line.meanA, 1e-12);
        const double varB = std::max(bb / n - line.meanB * line.meanB, 1e-12);
        line.spread = std::sqrt(std::min(varA, varB));
        const double doubt = noise * noise / n + kMiddleDoubt * kMiddleDoubt;
        // The ratio of the spreads, and that of the means, each as far as it can be trusted.
        // Spreads of colours that are loosely related tell of sharpness, not of light.
        const double related = std::max(ab / n - line.meanA * line.meanB, 0.0);
        const double loose = std::max(1 - related * related / (varA * varB), 0.0);
        const double spreadWeight = 1 / (doubt / (line.spread * line.spread) + kLooseDoubt * loose);
        const double middleGain = kUsualOffset / std::min(line.meanA, line.meanB);
        const double meanWeight = 1 / (middleGain * middleGain);
        line.gainWeight = spreadWeight + meanWeight;
        const double log = (0.5 * std::log(varB / varA) * spreadWeight +
                            std::log(line.meanB / line.meanA) * meanWeight) /
                           line.gainWeight;
        line.gain = std::clamp(std::exp(log), 1 / kMostGain, kMostGain);
        line.offset = line.meanB - line.gain * line.meanA;
        line.middleWeight = 1 / doubt;
    }
    return line;
}

/// x[a] - x[b] = wanted[i] for each line i, by least squares with these weights (Gauss-Seidel).
std::vector<double> balance(std::size_t views, const std::vector<Line>& lines,
                            const std::vector<double>& wanted, const std::vector<double>& weights) {
    std::vector<std::vector<std::size_t>> of(views);
    for (std::size_t i = 0; i < lines.size(); ++i) {
        of[lines[i].a].push_back(i);
        of[lines[i].b].push_back(i);
    }
    std::vector<double> x(views, 0.0);
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        double moved = 0;
        for (std::size_t v = 0; v < views; ++v) {
            double sum = 0, weight = kNothingDiffers;
            for (const std::size_t i : of[v]) {
                const bool first = lines[i].a == v;
                sum += weights[i] * (first ? x[lines[i].b] + wanted[i] : x[lines[i].a] - wanted[i]);
                weight += weights[i];
            }
            const double value = sum / weight;
            moved = std::max(moved, std::abs(value - x[v]));
            x[v] = value;
        }
        if (moved < kSettled) break;
    }
    return x;
}

/// Number of the group of views that lines join, for each view.
std::vector<std::size_t> groupsOf(std::size_t views, const std::vector<Line>& lines) {
    std::vector<std::size_t> group(views);
    std::iota(group.begin(), group.end(), std::size_t{0});
    for (bool changed = true; changed;) {
        changed = false;
        for (const Line& line : lines) {
            if (!(line.middleWeight > 0) || group[line.a] == group[line.b]) continue;
            group[line.a] = group[line.b] = std::min(group[line.a], group[line.b]);
            changed = true;
        }
    }
    return group;
}

struct Channel {
    std::vector<double> gain, offset;
    double clear = 0;  ///< how clearly some view differs: more than 1 is a difference
};

/// The median of the values of each view's group.
std::vector<double> mediansOfGroups(const std::vector<double>& x,
                                    const std::vector<std::size_t>& group) {
    std::vector<double> medians(x.size(), 0.0);
    for (std::size_t g = 0; g < x.size(); ++g) {
        std::vector<double> values;
        for (std::size_t v = 0; v < x.size(); ++v)
            if (group[v] == g) values.push_back(x[v]);
        if (values.empty()) continue;
        const double median = middleOf(values);
        for (std::size_t v = 0; v < x.size(); ++v)
            if (group[v] == g) medians[v] = median;
    }
    return medians;
}

Channel solve(std::size_t views, const std::vector<Line>& lines) {
    const auto group = groupsOf(views, lines);
    std::vector<double> wanted, weights;
    for (const Line& line : lines) {
        wanted.push_back(std::log(line.gain));
        weights.push_back(line.gainWeight);
    }
    Channel out;
    const auto logs = balance(views, lines, wanted, weights);
    const auto logMedians = mediansOfGroups(logs, group);
    for (std::size_t v = 0; v < views; ++v) out.gain.push_back(std::exp(logs[v] - logMedians[v]));
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const Line& line = lines[i];
        wanted[i] = out.gain[line.b] * line.meanB - out.gain[line.a] * line.meanA;
        weights[i] = line.middleWeight;
    }
    out.offset = balance(views, lines, wanted, weights);
    const auto medians = mediansOfGroups(out.offset, group);
    for (std::size_t v = 0; v < views; ++v) out.offset[v] -= medians[v];

    // At two typical colours of each pair: what a map changes, and what is left between the views.
    double most = 0, contradiction = 0;
    std::ptrdiff_t used = 0;
    std::vector<bool> joined(views, false);
    for (const Line& line : lines) {
        if (!(line.middleWeight > 0)) continue;
        ++used;
        joined[line.a] = joined[line.b] = true;
        for (const double side : {-1.0, 1.0}) {
            const double a = line.meanA + side * line.spread, b = line.at(a);
            const double mappedA = out.gain[line.a] * a + out.offset[line.a];
            const double mappedB = out.gain[line.b] * b + out.offset[line.b];
            most = std::max({most, std::abs(mappedA - a), std::abs(mappedB - b)});
            contradiction += 0.5 * (mappedA - mappedB) * (mappedA - mappedB);
        }
    }
    // As many pairs join the views of a group as it has others than the first; the rest can
    // contradict.
    std::ptrdiff_t closing = used;
    for (std::size_t v = 0; v < views; ++v) closing -= joined[v] && group[v] != v ? 1 : 0;
    if (closing > 0) contradiction = std::sqrt(contradiction / static_cast<double>(closing));
    out.clear = most / (closing > 0 ? std::max(kVisible, kClear * contradiction) : kVisibleAlone);
    return out;
}

/// What is left of the differences between views under these maps, as a share of them: medians over
/// the points of each pair.
double differenceLeft(std::span<const SharedColours> pairs, std::span<const Channel> channels) {
    double before = 0, after = 0;
    for (const SharedColours& pair : pairs) {
        for (std::size_t c = 0; c < channels.size(); ++c) {
            const auto mapped = [&](std::size_t view, double value) {
                return channels[c].gain[view] * value + channels[c].offset[view];
            };
            std::vector<double> was, now;
            for (const LitPair& p : pair.points) {
                const double a = p.a[static_cast<int>(c)], b = p.b[static_cast<int>(c)];
                if (!tellsLight(a, b)) continue;
                const double difference = mapped(pair.a, a) - mapped(pair.b, b);
                was.push_back(std::abs(a - b));
                now.push_back(std::abs(difference));
            }
            if (was.size() < kFewColours) continue;
            const double a = middleOf(was), b = middleOf(now);
            const double n = static_cast<double>(was.size());
            before += n * a * a;
            after += n * b * b;
        }
    }
    return before > 0 ? std::sqrt(after / before) : 1;
}

}  // namespace

std::vector<ColourMap> matchColours(std::size_t views, std::span<const SharedColours> pairs) {
    std::vector<ColourMap> maps(views);
    std::vector<Channel> channels;
    double clear = 0;
    for (int channel = 0; channel < 3; ++channel) {
        std::vector<Line> lines;
        for (const SharedColours& pair : pairs) lines.push_back(fitLine(pair, channel));
        channels.push_back(solve(views, lines));
        clear = std::max(clear, channels.back().clear);
    }
    if (!(clear > 1)) return maps;
    const double worth = clear * (1 - differenceLeft(pairs, channels));
    const double share =
        std::min({(clear - 1) / (kSure - 1), (worth - kWorth) / (kSureWorth - kWorth), 1.0});
    if (!(share > 0)) return maps;
    for (std::size_t v = 0; v < views; ++v) {
        ColourMap map;
        bool moves = false, fits = true;
        for (int c = 0; c < 3; ++c) {
            const double gain = channels[c].gain[v];
            const double offset = channels[c].offset[v];
            map.gain[c] = static_cast<float>(1 + share * (gain - 1));
            map.offset[c] = static_cast<float>(share * offset);
            moves =
                moves || std::abs(offset) > kHalfStep || std::abs(gain + offset - 1) > kHalfStep;
            fits =
                fits && gain < kMostGain && gain > 1 / kMostGain && std::abs(offset) < kMostOffset;
        }
        if (moves && fits) maps[v] = map;
    }
    return maps;
}

}  // namespace stx
