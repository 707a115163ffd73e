#pragma once

#include <vector>

#include "lib/base/job.hpp"
#include "lib/capture/capture.hpp"

namespace stx {

struct FewestCameras {
    int count = 0;    ///< of the cameras, from the first
    double psnr = 0;  ///< what they reach, RGB, dB
};

/// The least number of `cameras`, counted from the first, whose captured views render a mesh with a
/// PSNR (RGB, dB) of at least `wantedPsnr`: over six views from all sides, as large as the cameras'
/// pictures (512 pixels at most) and with the whole bounding sphere in sight, drawn in surface mode
/// at normal quality and compared with the mesh itself, whose translucent surfaces are opaque as in
/// that mode, and whose colour is without emission where `settings.materials` keeps that apart.
/// When no number reaches it: the least that comes within 0.1 dB of the best that was tried.
/// Errors: no camera (usage), those of captureBundle() and frameCamera(), cancelled.
[[nodiscard]] Result<FewestCameras> fewestCameras(const Mesh& mesh,
                                                  const std::vector<Camera>& cameras,
                                                  const CaptureSettings& settings,
                                                  double wantedPsnr, Job& job);

}  // namespace stx
