#pragma once

#include <string_view>

#include "lib/base/job.hpp"

namespace stx::imagesets {

/// calib.txt of a rectified pair (Middlebury 2014): lengths of the scene in millimetres, others in
/// pixels from the first pixel's centre. cx[1] - cx[0] is doffs.
struct MiddleburyCalibration {
    double f = 1, cx[2] = {0, 0}, cy[2] = {0, 0};
    double doffs = 0, baseline = 1;
    int width = 0, height = 0;
};

/// Errors name the line or the key that is missing.
[[nodiscard]] Result<MiddleburyCalibration> parseMiddlebury(std::string_view text,
                                                            const Limits& limits);

}  // namespace stx::imagesets
