#pragma once

namespace stx {

/// Pictures are within this of the figures once reached, dB.
inline constexpr double kTolerance = 0.2;

}  // namespace stx
