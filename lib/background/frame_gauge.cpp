#include "lib/background/frame_gauge.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "lib/base/median.hpp"
#include "lib/model/light_ratio.hpp"

namespace stx::temporal {
namespace {

/// Points of the grid: enough for medians.
constexpr double kGridPoints = 20000;
/// Differences of depth are counted in steps of this factor from kLeastShare on.
constexpr float kLeastShare = 1e-5f;
constexpr float kStepsPerOctave = 4;
/// Fewer samples than these of one distance say nothing of it; those of all do.
constexpr std::uint32_t kFewSamples = 200;
/// Three quarters of the differences of two equal Gaussians are below this many standard
/// deviations. (A median may be 0 where a sensor's coarse steps flicker.)
constexpr float kUpperQuartile = 1.627f;
constexpr float kDeviations = 3;
/// Noise above this share of the distance is movement.
constexpr float kMostShare = 0.05f;

/// A mean remembers this many frames.
constexpr float kMemory = 200;

}  // namespace

std::size_t DepthNoise::binOf(float dist) {
    // Half octaves of distance, from its bits: the exponent, and whether the rest is √2 or more.
    const auto bits = std::bit_cast<std::uint32_t>(dist);
    const int octave = static_cast<int>(bits >> 23) - 127;
    const int half = (bits & 0x7fffffu) >= 0x3504f3u ? 1 : 0;
    return static_cast<std::size_t>(std::clamp(2 * octave + half + kBins / 2, 0, kBins - 1));
}

void DepthNoise::add(float before, float now) {
    const float share = std::abs(now - before) / before;
    const float step = 1 + kStepsPerOctave * std::log2(std::max(share, kLeastShare) / kLeastShare);
    const int slot = share < kLeastShare ? 0 : std::min(static_cast<int>(step), kSteps - 1);
    ++counts_[binOf(before)][slot];
}

void DepthNoise::update() {
    const auto upperQuartile = [](const std::array<std::uint32_t, kSteps>& counts,
                                  std::uint64_t total) {
        std::uint64_t below = 0;
        int slot = 0;
        while (slot < kSteps && 4 * (below + counts[slot]) < 3 * total) below += counts[slot++];
        if (slot == 0) return 0.0f;
        return kLeastShare * std::exp2((static_cast<float>(slot) - 0.5f) / kStepsPerOctave);
    };
    std::array<std::uint32_t, kSteps> all{};
    std::uint64_t total = 0;
    for (const auto& counts : counts_) {
        for (std::size_t i = 0; i < kSteps; ++i) {
            all[i] += counts[i];
            total += counts[i];
        }
    }
    if (total == 0) return;
    const float common = upperQuartile(all, total);
    for (std::size_t bin = 0; bin < kBins; ++bin) {
        std::uint64_t here = 0;
        for (const std::uint32_t n : counts_[bin]) here += n;
        const float spread = here < kFewSamples ? common : upperQuartile(counts_[bin], here);
        share_[bin] = std::min(kDeviations / kUpperQuartile * spread, kMostShare);
    }
}

Gauge::Gauge(const Camera& camera) {
    const double pixels = static_cast<double>(camera.width) * camera.height;
    const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / kGridPoints))));
    for (int y = step / 2; y < camera.height; y += step) {
        for (int x = step / 2; x < camera.width; x += step) {
            GaugePixel p;
            p.pixel = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(camera.width) +
                      static_cast<std::uint32_t>(x);
            points_.push_back(p);
        }
    }
}

FrameGauge Gauge::measure(const ReferenceView& frame) {
    const auto step = static_cast<float>(frame.depthBits == 32 ? 0.0 : frame.depthCode().step());
    std::vector<glm::vec3> now(points_.size(), glm::vec3(-1.0f));
    for (std::size_t i = 0; i < points_.size(); ++i) {
        GaugePixel& p = points_[i];
        const float dist = frame.depth.data()[p.pixel];
        if (hasPoint(dist) && dist > 0 && p.before > 0) noise_.add(p.before, dist);
    }
    noise_.update();
    for (std::size_t i = 0; i < points_.size(); ++i) {
        const GaugePixel& p = points_[i];
        const float dist = frame.depth.data()[p.pixel];
        if (!hasPoint(dist) || !(dist > 0)) continue;
        const bool same =
            p.count > 0 && std::abs(dist - p.depth) <= p.depth * noise_.tolerance(p.depth, step);
        if (same || p.count == 0) now[i] = stepsOf(frame.texture, p.pixel);
    }
    FrameGauge gauge;
    std::vector<LitPair> pairs;
    for (std::size_t i = 0; i < points_.size(); ++i)
        if (points_[i].count > 0 && now[i].x >= 0)
            pairs.push_back({points_[i].colour / 255.0f, now[i] / 255.0f});
    gauge.gain = lightRatio(pairs);
    std::vector<float> differences;
    for (std::size_t i = 0; i < points_.size(); ++i) {
        GaugePixel& p = points_[i];
        const float dist = frame.depth.data()[p.pixel];
        const bool point = hasPoint(dist) && dist > 0;
        const glm::vec3 colour = stepsOf(frame.texture, p.pixel) / gauge.gain;
        if (frames_ > 0)
            differences.push_back(std::abs(brightness(colour) - brightness(p.beforeColour)));
        p.beforeColour = colour;
        p.before = point ? dist : 0.0f;
        if (now[i].x >= 0) {
            p.count = std::min(p.count + 1, kMemory);
            p.depth += (dist - p.depth) / p.count;
            p.colour += (colour - p.colour) / p.count;
        } else if (point && dist > p.depth * (1 + 2 * noise_.tolerance(p.depth, step))) {
            // Something before the background went away.
            p.depth = dist;
            p.colour = colour;
            p.count = 1;
        }
    }
    gauge.noise = medianOf(std::move(differences));
    gains_ += glm::dvec3(gauge.gain);
    noises_ += gauge.noise;
    ++frames_;
    return gauge;
}

glm::vec3 Gauge::meanGain() const {
    return frames_ > 0 ? glm::vec3(gains_ / static_cast<double>(frames_)) : glm::vec3(1.0f);
}

}  // namespace stx::temporal
