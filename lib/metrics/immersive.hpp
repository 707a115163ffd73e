#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/metrics/compare.hpp"

namespace stx {

/// The two figures that immersive video is compared by, of one pair of pictures or of several.
///
/// IV-PSNR (Dziembowski, Mieloch, Stankowski, Grzelka, "IV-PSNR - The Objective Quality Metric for
/// Immersive Video Applications", IEEE Transactions on Circuits and Systems for Video Technology
/// 32(11), 2022): a pixel is compared with the likest of the 5x5 around it, each of Y, Cb, Cr by
/// itself, after a mean difference of up to 1 % of white is taken out; what is left counts 4:1:1.
/// Of both directions the lower one is given. What novel views are off by a pixel at edges costs
/// nothing then, as nobody sees it.
///
/// WS-PSNR (Sun, Lu, Yu, "Weighted-to-Spherically-Uniform Quality Evaluation for Omnidirectional
/// Video", IEEE Signal Processing Letters 24(9), 2017): PSNR of Y in which a row of an
/// equirectangular picture counts as much as it covers of the sphere.
///
/// Y, Cb, Cr are those of BT.709, full range, not rounded.
class ImmersiveComparison {
  public:
    /// A pair that compare() takes with these settings.
    void add(const Image<glm::u8vec4>& a, const Image<glm::u8vec4>& b,
             const CompareSettings& settings = {});
    void add(const Image<glm::vec4>& a, const Image<glm::vec4>& b,
             const CompareSettings& settings = {});
    /// What another has. Squared errors of all pixels are added up, not decibels.
    void add(const ImmersiveComparison& other);

    /// dB; nothing when all pictures are identical. A component without any error counts as if one
    /// pixel were off by 1/255 of white.
    [[nodiscard]] std::optional<double> ivPsnr() const;
    /// dB; nothing when all are identical or have not twice as many columns as rows.
    [[nodiscard]] std::optional<double> wsPsnrY() const;
    /// Whether all pictures have twice as many columns as rows, as equirectangular ones have.
    [[nodiscard]] bool panoramas() const { return panoramas_; }

  private:
    template <class P>
    void addPair(const Image<P>& a, const Image<P>& b, const CompareSettings& settings,
                 double peak);

    /// Squared errors with white as 1: from the first to the second and back, of Y, Cb and Cr.
    std::array<std::array<double, 3>, 2> squared_{};
    double weighted_ = 0, weights_ = 0;
    std::int64_t pixels_ = 0;
    bool panoramas_ = true, identical_ = true;
};

}  // namespace stx
