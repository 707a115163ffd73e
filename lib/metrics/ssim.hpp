#pragma once

#include <cstdint>

#include "lib/base/image.hpp"
#include "lib/base/job.hpp"

namespace stx {

/// Structural similarity of two images of one channel and equal size, for each pixel (Wang, Bovik,
/// Sheikh, Simoncelli 2004: Gaussian window 11x11, sigma 1.5, K1 = 0.01, K2 = 0.03; `peak` is their
/// L). Windows that reach over the border, or over pixels that the mask does not hold (>= 128; null
/// = it holds all), are cut there and weighted anew. 1 at pixels that it does not hold. When `job`,
/// where there is one, is cancelled, it ends early, and what it gives is of no use.
[[nodiscard]] Image<float> ssimMap(const Image<float>& a, const Image<float>& b, double peak,
                                   const Image<std::uint8_t>* mask = nullptr,
                                   const Job* job = nullptr);

/// The mean of the map over the windows wholly inside the image whose centre the mask holds; over
/// all such centres when no window is wholly inside. 1 when none counts.
[[nodiscard]] double meanSsim(const Image<float>& a, const Image<float>& b, double peak,
                              const Image<std::uint8_t>* mask, const Job* job = nullptr);

}  // namespace stx
