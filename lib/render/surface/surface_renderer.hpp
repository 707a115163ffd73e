#pragma once

#include <memory>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/render/renderer.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// Surface mode on the processor: each reference is warped as a surface, the surfaces are fused and
/// checked against what the other references see, and each pixel's colour is fitted to the samples
/// of the references that see it. Prepares every view; the bundle must pass check() and outlive the
/// renderer. A camera that stands exactly where a reference stands gets that reference's pixels.
[[nodiscard]] std::unique_ptr<Renderer> makeCpuSurfaceRenderer(const PageSet& set,
                                                               const RenderSettings& settings,
                                                               Job& job);

}  // namespace stx
