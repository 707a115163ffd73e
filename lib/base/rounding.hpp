#pragma once

namespace stx {

/// std::floor() and std::ceil() of numbers that an int holds: without SSE 4.1, which is not of
/// every x86 processor, those are calls.
template <typename Real>
[[nodiscard]] constexpr int floorToInt(Real v) {
    const int i = static_cast<int>(v);
    return i - (v < static_cast<Real>(i));
}
template <typename Real>
[[nodiscard]] constexpr int ceilToInt(Real v) {
    const int i = static_cast<int>(v);
    return i + (v > static_cast<Real>(i));
}

}  // namespace stx
