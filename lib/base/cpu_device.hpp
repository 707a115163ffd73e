#pragma once

#include <string>

namespace stx {

/// The processor's name and the SIMD target in use, such as "AMD EPYC (AVX3_ZEN4)".
[[nodiscard]] std::string cpuDeviceName();

}  // namespace stx
