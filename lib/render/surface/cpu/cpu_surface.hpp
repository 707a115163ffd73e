#pragma once

#include <memory>

#include "lib/base/job.hpp"
#include "lib/render/api/renderer.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {

/// Surface mode on the processor: see surface::makeSurfaceRenderer(). The job must outlive it.
[[nodiscard]] std::unique_ptr<Renderer> makeCpuSurfaceRenderer(const PageSet& set,
                                                               const RenderSettings& settings,
                                                               Job& job);

}  // namespace stx
