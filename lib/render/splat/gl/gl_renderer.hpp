#pragma once

#include <memory>

#include "lib/render/api/renderer.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx::gl {

/// The conventional OpenGL path that Lee & Park compare with: points from system memory as vertex
/// arrays in each frame, splat sizes computed on the CPU, fixed lighting, no shaders of ours.
/// Splat mode only. Errors: unsupported (no device or no compatibility profile), memory.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeGlRenderer(const PageSet& set,
                                                               const RenderSettings& settings,
                                                               int device, Job& job);

}  // namespace stx::gl
