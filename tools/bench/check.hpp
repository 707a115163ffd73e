#pragma once

#include <functional>
#include <string_view>

#include "lib/base/job.hpp"

namespace stx {

struct GpuCheckSettings {
    int device = -1;  ///< of listDevices(); -1 = all of them
    /// Gets a table for each device, piece by piece as they are known: a driver that crashes or
    /// hangs does so behind the name of the way to draw.
    std::function<void(std::string_view)> print;
};

/// What a check found.
struct GpuCheckReport {
    int drawn = 0;    ///< pictures that were compared
    int wrong = 0;    ///< of these, those unlike the processor's
    int refused = 0;  ///< ways to draw that a device does not have
};

/// Draws the analytic object and room by every mode, quality, rule of splats and pipeline on every
/// device, and compares each picture with the processor's of the same mode: PSNR of 8-bit sRGB over
/// black. Modes differ in the order of their sums, so pictures are alike from kAlikeDb on. Errors:
/// unsupported when there is no device, with what was tried; cancelled.
[[nodiscard]] Result<GpuCheckReport> checkGpus(const GpuCheckSettings& settings, Job& job);

/// Found with llvmpipe and zink, whose least is 57 dB: half of the squared error of one code in all
/// pixels of every picture is room enough for other rounding.
inline constexpr double kAlikeDb = 40.0;

}  // namespace stx
