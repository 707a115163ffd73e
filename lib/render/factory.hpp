#pragma once

#include <memory>
#include <span>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/view_summary.hpp"
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

/// What is kept of a view, so that its pixels need not be read for pictures in which it has no
/// part. The same pixels have the same summary.
[[nodiscard]] ViewSummary summaryOfView(const ReferenceView& view);
/// False where a summary says of a view what its pixels do not show, as far as a quick look tells:
/// how many points there are, whether all is covered in full, and how far what it shows reaches.
[[nodiscard]] bool mayBeSummaryOf(const ViewSummary& summary, const ReferenceView& view);
/// Whether summaries of such views, by their headers, may spare the reading of some.
[[nodiscard]] bool tellWithoutPixels(const std::vector<ReferenceView>& views);
/// Of each view of a bundle whether its pixels must be there for some pictures; `views` are their
/// headers, `summaries` one for each. The others may be empty, see below. All must, unless surface
/// mode draws on the processor, and where summaries do not tell.
[[nodiscard]] std::vector<bool> neededViews(Backend backend, int device,
                                            const std::vector<ReferenceView>& views,
                                            std::span<const ViewSummary> summaries,
                                            const RenderSettings& settings,
                                            std::span<const Camera> pictures);
/// The renderer of a bundle whose views are not all there: what it draws of the pictures that the
/// views were chosen for is the same to the bit as from all of them. Those without images have the
/// summaries of theirs, and all that stx refine finds nothing to do in (mayRefine()), so that
/// nothing is refined. `spool` may be null. The bundle, the summaries and the spool must outlive
/// the renderer.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeRenderer(const Bundle& bundle,
                                                             std::span<const ViewSummary> summaries,
                                                             PixelSpool* spool,
                                                             const RenderSettings& settings,
                                                             Job& job);
/// The same of an atlas, which is drawn from its own textures.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makeRenderer(Backend backend, const Atlas& atlas,
                                                             const RenderSettings& settings,
                                                             int device, Job& job);

/// All devices; empty with a note of what was tried, when there is no EGL.
[[nodiscard]] std::vector<Device> listDevices(Job& job);

}  // namespace stx
