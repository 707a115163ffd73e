#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace stx {

/// The middle one of these values, the larger of two; `ofNone` when there are none.
template <class Real>
[[nodiscard]] Real medianOf(std::vector<Real> values, Real ofNone = {}) {
    if (values.empty()) return ofNone;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace stx
