#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "lib/model/reference_view.hpp"

namespace stx::temporal {

/// How much the depth of a still surface strays from frame to frame, by distance: measured.
class DepthNoise {
  public:
    /// Counts what one point did between two frames.
    void add(float before, float now);
    /// Takes in what was counted.
    void update();
    /// Depths within this share of each other are the same surface: three standard deviations, half
    /// a step of the code (scene units between codes), and what stx takes for one surface at least.
    [[nodiscard]] float tolerance(float dist, float step) const {
        return std::max(std::max(kLeast, share_[binOf(dist)]), 0.5f * step / dist);
    }

  private:
    static constexpr float kLeast = 0.006f;
    static constexpr int kBins = 64, kSteps = 64;  ///< of distance, and of differences
    [[nodiscard]] static std::size_t binOf(float dist);

    std::array<std::array<std::uint32_t, kSteps>, kBins> counts_{};
    std::array<float, kBins> share_{};  ///< three standard deviations
};

/// What one frame is like beside those before it.
struct FrameGauge {
    glm::vec3 gain{1.0f};  ///< its light over that of the first frames
    float noise = 0;       ///< median difference of brightness to the frame before, in 0..255
};

/// Measures light and noise of frames on a grid of pixels of the whole picture, however little of
/// it is being worked on.
class Gauge {
  public:
    explicit Gauge(const Camera& camera);
    /// Of the next frame.
    [[nodiscard]] FrameGauge measure(const ReferenceView& frame);
    [[nodiscard]] const DepthNoise& noise() const { return noise_; }
    /// The mean of all frames' gains.
    [[nodiscard]] glm::vec3 meanGain() const;
    /// The mean of all frames' noise.
    [[nodiscard]] float meanNoise() const {
        return frames_ > 1 ? static_cast<float>(noises_ / (frames_ - 1)) : 0.0f;
    }

  private:
    struct GaugePixel {
        std::uint32_t pixel = 0;
        float before = 0;              ///< depth in the frame before, 0 = none
        glm::vec3 beforeColour{0.0f};  ///< without its gain
        float depth = 0;               ///< mean of the layer whose light is known
        glm::vec3 colour{0.0f};        ///< and its mean colour, without gains
        float count = 0;
    };

    std::vector<GaugePixel> points_;
    DepthNoise noise_;
    glm::dvec3 gains_{0.0};
    double noises_ = 0;
    int frames_ = 0;
};

/// Colour in steps of 0..255: 8-bit codes as they are, linear light by its square root, so that
/// noise and shadows are of like size in both.
[[nodiscard]] inline glm::vec3 stepsOf(const Texture& texture, std::size_t pixel) {
    if (const auto* bytes = texture.rgba8()) return glm::vec3(glm::u8vec3(bytes->data()[pixel]));
    return 255.0f * glm::sqrt(glm::max(glm::vec3(texture.rgbaFloat()->data()[pixel]), 0.0f));
}
/// Brightness of such a colour (weights of BT.601, rounded).
[[nodiscard]] inline float brightness(glm::vec3 c) {
    return 0.3f * c.r + 0.59f * c.g + 0.11f * c.b;
}

}  // namespace stx::temporal
