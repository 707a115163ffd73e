#pragma once

#include <memory>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/render/api/renderer.hpp"

namespace stx {

/// Makes the renderer of a backend. Backend::automatic takes a hardware GPU when there is one, else
/// cpu: a software GL driver is slower than the processor; when the GPU fails midway, cpu draws on.
/// The bundle must outlive the renderer, and so must the job. `device` chooses among listDevices()
/// (-1 = the best). Errors: a bundle that fails check(); unsupported, with what was tried.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeRenderer(Backend backend, const Bundle& bundle,
                                                             const RenderSettings& settings,
                                                             int device, Job& job);
/// What drawing a bundle so takes beside its images.
[[nodiscard]] const PeakMemory& drawingMemory(const RenderSettings& settings);
/// The same of a bundle in a spool, which must outlive the renderer: what is made of its pixels is
/// kept there, too. Errors beside those: (invalidInput) captured views to refine side by side that
/// take more memory than the limit.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeRenderer(Backend backend, const Bundle& bundle,
                                                             PixelSpool& spool,
                                                             const RenderSettings& settings,
                                                             int device, Job& job);
/// The same of an atlas, which is drawn from its own textures.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeRenderer(Backend backend, const Atlas& atlas,
                                                             const RenderSettings& settings,
                                                             int device, Job& job);

/// All devices; empty with a note of what was tried, when there is no EGL.
[[nodiscard]] std::vector<Device> listDevices(Job& job);

}  // namespace stx
