#pragma once

#include <memory>

#include "lib/base/job.hpp"
#include "lib/render/api/renderer.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// Splat mode on plain processor cores: each depth pixel a splat (Lee & Park 2006, sections 3.2 to
/// 3.4), drawn in two passes. The first finds the nearest surface of each output pixel, the second
/// blends all splats within a small depth of it with weights that fall off from their centre, and
/// prefer views that saw the surface head-on and close.
///
/// SplatRule::data: the splat is the picture of the source pixel's patch of surface, as splatU and
/// splatV, the normal or the neighbours' depth tilt it, never smaller than an output pixel.
/// SplatRule::paper: round, of diameter splatCoefficient / distance pixels; a coefficient of 0 is
/// chosen so that the nearest view's samples just close. SplatRule::point: one pixel, nearest wins.
///
/// Frames carry normals when there is light. Bytes are the same on any number of threads. Errors of
/// render(): a camera that fails check(), or a frame over the job's memory limit.
[[nodiscard]] std::unique_ptr<Renderer> makeCpuSplatRenderer(const PageSet& set,
                                                             const RenderSettings& settings,
                                                             Job& job);

}  // namespace stx
