#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include <glm/glm.hpp>
#include <glm/gtc/packing.hpp>

/// What one pixel remembers: a few surfaces that it showed, each with samples of its colour.
namespace stx::temporal {

/// Surfaces that a pixel remembers, and samples of each.
inline constexpr int kLayers = 3, kSamples = 11;

/// How much a sample is worth, best first; the upper two bits of its key.
enum class Worth : std::uint8_t { quiet, moving, mixed, movingMixed };

/// The key of a sample: samples of low keys are kept. Below its worth it is a random number whose
/// logarithm is uniform, so that the samples kept are spread evenly over the whole time, however
/// long it is (bottom-k sampling).
[[nodiscard]] inline std::uint8_t keyOf(Worth worth, std::uint32_t random) {
    const int octave = std::countl_zero(random);
    // Half octaves: above or below 2^-½ of its octave.
    const std::uint32_t mantissa = octave < 32 ? random << octave : 0;
    const int rarity = std::min(2 * octave + (mantissa < 0xb504f333u ? 1 : 0), 63);
    return static_cast<std::uint8_t>(static_cast<int>(worth) << 6 | (63 - rarity));
}

/// A number for each pixel and frame that looks random (the finaliser of MurmurHash3).
[[nodiscard]] inline std::uint32_t randomOf(std::uint64_t pixel, std::uint32_t frame) {
    std::uint64_t h = pixel * 0x9e3779b97f4a7c15ull + frame;
    h = (h ^ (h >> 33)) * 0xff51afd7ed558ccdull;
    h = (h ^ (h >> 33)) * 0xc4ceb9fe1a85ec53ull;
    return static_cast<std::uint32_t>(h >> 32);
}

/// A colour of 8 bits.
struct ByteSample {
    std::uint8_t r, g, b, key;

    void set(glm::vec3 colour) {
        const glm::vec3 c = glm::clamp(colour + 0.5f, 0.0f, 255.0f);
        r = static_cast<std::uint8_t>(c.r);
        g = static_cast<std::uint8_t>(c.g);
        b = static_cast<std::uint8_t>(c.b);
    }
    [[nodiscard]] glm::vec3 colour() const { return {r, g, b}; }
};
/// Linear light as square roots (see stepsOf()), in half floats.
struct HalfSample {
    std::uint16_t r, g, b;
    std::uint8_t key;

    void set(glm::vec3 colour) {
        r = glm::packHalf1x16(colour.r);
        g = glm::packHalf1x16(colour.g);
        b = glm::packHalf1x16(colour.b);
    }
    [[nodiscard]] glm::vec3 colour() const {
        return {glm::unpackHalf1x16(r), glm::unpackHalf1x16(g), glm::unpackHalf1x16(b)};
    }
};

/// One surface.
template <class Sample>
struct Layer {
    float q = 0;               ///< mean inverse distance
    float last = 0;            ///< seconds from the first frame to the last that showed it
    std::uint32_t strong = 0;  ///< frames that showed it away from depth edges
    std::uint32_t weak = 0;    ///< frames that showed it beside one
    std::array<Sample, kSamples> samples;

    [[nodiscard]] std::uint32_t count() const { return strong + weak; }
    [[nodiscard]] int sampleCount() const {
        return static_cast<int>(std::min<std::uint32_t>(count(), kSamples));
    }
};

/// One measurement of a pixel.
struct Measurement {
    float q = 0;
    float tolerance = 0;  ///< share of q
    bool weak = false;    ///< beside a depth edge, where depth and colour may be mixtures
    std::uint8_t key = 0;
    bool heads = false;  ///< decides between samples of equal keys
    float time = 0;      ///< seconds from the first frame
    glm::vec3 colour{0.0f};
};

template <class Sample>
struct PixelLayers {
    std::array<Layer<Sample>, kLayers> layers;
    std::uint32_t empty = 0;  ///< frames that showed nothing here

    void add(const Measurement& m);

  private:
    /// Room for a surface that no layer has yet: an empty layer, or the one that is worth least,
    /// which is forgotten. Null when none may be forgotten.
    [[nodiscard]] Layer<Sample>* roomFor(const Measurement& m);
    static void keep(Layer<Sample>& layer, int known, const Sample& sample, bool heads);
    /// Joins all layers whose depth is within the tolerance of this layer's into it.
    void merge(Layer<Sample>& layer, float tolerance);
};

/// Puts a sample among the `known` samples of a layer. Of a full layer it replaces the one with the
/// highest key, unless its own key is higher.
template <class Sample>
void PixelLayers<Sample>::keep(Layer<Sample>& layer, int known, const Sample& sample, bool heads) {
    if (known < kSamples) {
        layer.samples[known] = sample;
        return;
    }
    auto worst = layer.samples.begin();
    for (auto s = worst + 1; s != layer.samples.end(); ++s)
        if (s->key > worst->key) worst = s;
    if (sample.key < worst->key || (sample.key == worst->key && heads)) *worst = sample;
}

template <class Sample>
Layer<Sample>* PixelLayers<Sample>::roomFor(const Measurement& m) {
    // The farthest layer that is not a single sample may be the background: it stays.
    const Layer<Sample>* farthest = nullptr;
    for (auto& layer : layers) {
        if (layer.count() == 0) return &layer;
        if (layer.count() > 1 && (!farthest || layer.q < farthest->q)) farthest = &layer;
    }
    const auto weight = [](const Layer<Sample>& l) { return 4 * l.strong + l.weak; };
    Layer<Sample>* least = nullptr;
    for (auto& layer : layers) {
        // What was seen in the last tenth of the time may come back.
        if (&layer == farthest || m.time - layer.last < 0.1f * m.time) continue;
        if (!least || weight(layer) < weight(*least)) least = &layer;
    }
    if (!least || (m.weak && m.q > least->q && least->strong > 1)) return nullptr;
    least->strong = least->weak = 0;
    return least;
}

template <class Sample>
void PixelLayers<Sample>::merge(Layer<Sample>& layer, float tolerance) {
    for (auto& other : layers) {
        if (&other == &layer || other.count() == 0) continue;
        if (std::abs(other.q - layer.q) > tolerance * std::max(other.q, layer.q)) continue;
        const int theirs = other.sampleCount();
        int ours = layer.sampleCount();
        for (int i = 0; i < theirs; ++i) {
            keep(layer, ours, other.samples[i], false);
            ours = std::min(ours + 1, kSamples);
        }
        // Measurements beside edges count only when both layers have no others.
        const auto weight = [&](const Layer<Sample>& l) {
            return static_cast<float>(layer.strong + other.strong > 0 ? l.strong : l.weak);
        };
        const float all = weight(layer) + weight(other);
        layer.q = (layer.q * weight(layer) + other.q * weight(other)) / all;
        layer.strong += other.strong;
        layer.weak += other.weak;
        layer.last = std::max(layer.last, other.last);
        other.strong = other.weak = 0;
    }
}

template <class Sample>
void PixelLayers<Sample>::add(const Measurement& m) {
    Layer<Sample>* best = nullptr;
    float nearest = 0;
    for (auto& layer : layers) {
        if (layer.count() == 0) continue;
        const float off = std::abs(layer.q - m.q);
        if (off > m.tolerance * std::max(layer.q, m.q) || (best && off >= nearest)) continue;
        best = &layer;
        nearest = off;
    }
    if (!best) best = roomFor(m);
    if (!best) return;
    Sample sample;
    sample.set(m.colour);
    sample.key = m.key;
    keep(*best, best->sampleCount(), sample, m.heads);
    std::uint32_t& count = m.weak ? best->weak : best->strong;
    ++count;
    best->last = m.time;
    // Depth beside edges may be a mixture: the first measurement away from them replaces it.
    if (m.weak && best->strong > 0) return;
    best->q = count == 1 ? m.q : best->q + (m.q - best->q) / static_cast<float>(count);
    merge(*best, m.tolerance);
}

}  // namespace stx::temporal
