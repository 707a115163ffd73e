#pragma once

#include <vector>

#include "lib/base/job.hpp"
#include "lib/capture/capture.hpp"

namespace stx {

/// The least number of `cameras`, counted from the first, whose captured views render a mesh with a
/// PSNR (RGB, dB) of at least `wantedPsnr`: over six views of 256x256 between the references, drawn
/// in surface mode at normal quality and compared with the mesh itself. All cameras when that is
/// not reached. Errors: no camera (usage), those of captureBundle() and layoutCameras(), cancelled.
[[nodiscard]] Result<int> fewestCameras(const Mesh& mesh, const std::vector<Camera>& cameras,
                                        const CaptureSettings& settings, double wantedPsnr,
                                        Job& job);

}  // namespace stx
