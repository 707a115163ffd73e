#pragma once

#include <cstdint>
#include <optional>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/base/job.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// How two pictures are compared.
struct CompareSettings {
    /// Only pixels of the mask that are >= 128 count. Null: all pixels. Same size as the pictures.
    /// The others are not looked at, by windows and as neighbours neither: they may be NaN.
    const Image<std::uint8_t>* mask = nullptr;
    /// What both pictures are laid over first where their alpha is below full: colours of 0..1 in
    /// the pictures' own coding. Alpha itself is not compared: what nobody sees is not a
    /// difference.
    glm::vec3 background{0.0f};
    /// Float pictures: the value that counts as full white. 8-bit pictures: always 255.
    double peak = 1.0;

    [[nodiscard]] bool counts(int x, int y) const { return !mask || mask->at(x, y) >= 128; }
};

/// The pixel with the largest difference in one channel (the first in reading order of equals).
struct WorstPixel {
    int x = 0, y = 0;
    double difference = 0;  ///< in the pictures' own values: 0..255 for 8 bits, else as floats are
};

/// What compare() found.
struct Comparison {
    /// Peak signal to noise ratio in dB over R, G and B together; nothing when they are identical.
    std::optional<double> psnrRgb;
    /// The same of luma Y = 0.2126 R + 0.7152 G + 0.0722 B (BT.709, full range, not rounded).
    std::optional<double> psnrY;
    /// Mean structural similarity of Y, at most 1 (Wang, Bovik, Sheikh, Simoncelli 2004: Gaussian
    /// window 11x11, sigma 1.5, K1 = 0.01, K2 = 0.03). As there, only windows wholly inside the
    /// picture count, unless none is; with a mask those whose centre is in it, cut at its border.
    double ssimY = 1.0;
    WorstPixel worst;
    double white = 255.0;              ///< full white in the values that `worst` is in
    std::int64_t pixels = 0;           ///< that counted
    std::int64_t differentPixels = 0;  ///< of these, with any difference in R, G or B

    [[nodiscard]] bool identical() const { return differentPixels == 0; }
};

/// Compares two 8-bit pictures with straight alpha, in their coded values. The result is the same
/// on any number of threads. Errors when sizes disagree or nothing is left to compare, (usage) when
/// the background is not of 0..1, and when `job`, where there is one, is cancelled.
[[nodiscard]] Result<Comparison> compare(const Image<glm::u8vec4>& a, const Image<glm::u8vec4>& b,
                                         const CompareSettings& settings = {},
                                         const Job* job = nullptr);
/// The same of float pictures with straight alpha. Errors also on NaN and infinite values that
/// count, and on a peak that is not positive.
[[nodiscard]] Result<Comparison> compare(const Image<glm::vec4>& a, const Image<glm::vec4>& b,
                                         const CompareSettings& settings = {},
                                         const Job* job = nullptr);

/// A picture of where two pictures differ: the largest difference of the three channels from black
/// over red and yellow to white, `gain` times enlarged; pixels outside the mask are dark blue.
/// Errors as compare().
[[nodiscard]] Result<Image<glm::u8vec4>> errorPicture(const Image<glm::u8vec4>& a,
                                                      const Image<glm::u8vec4>& b,
                                                      const CompareSettings& settings = {},
                                                      double gain = 8.0);
[[nodiscard]] Result<Image<glm::u8vec4>> errorPicture(const Image<glm::vec4>& a,
                                                      const Image<glm::vec4>& b,
                                                      const CompareSettings& settings = {},
                                                      double gain = 8.0);

/// Gathers frames into the figures of a sequence: the mean squared error over all pixels of all
/// frames gives the PSNR (not the mean of decibels), SSIM is the mean over frames.
class SequenceComparison {
  public:
    void add(const Comparison& frame);
    /// Figures of all frames so far; `worst` is that of the frame whose is the largest part of
    /// white, in that frame's values.
    [[nodiscard]] Comparison total() const;
    /// Index of the frame that holds the worst pixel.
    [[nodiscard]] int worstFrame() const { return worstFrame_; }
    [[nodiscard]] int frames() const { return frames_; }

  private:
    int frames_ = 0;
    int worstFrame_ = 0;
    /// With white as 1.
    double squaredRgb_ = 0, squaredY_ = 0, ssim_ = 0;
    Comparison total_;
};

}  // namespace stx
