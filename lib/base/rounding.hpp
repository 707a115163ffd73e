#pragma once

namespace stx {

/// std::floor(), std::ceil() and std::round() of numbers that an int holds: without SSE 4.1, which
/// is not of every x86 processor, those are calls.
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
template <typename Real>
[[nodiscard]] constexpr int roundToInt(Real v) {
    const int i = static_cast<int>(v);
    const Real rest = v - static_cast<Real>(i);
    return i + (rest >= Real{0.5}) - (rest <= Real{-0.5});
}

}  // namespace stx
