#pragma once

#include <functional>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/mesh.hpp"
#include "lib/quality/view_quality.hpp"

namespace stx {

/// What each stage of rendering and step of refining is worth: pictures are drawn without it.

/// Reference views and pictures that nobody captured from them.
struct AblationSet {
    std::string name;
    Bundle bundle;
    ViewQuality truth;
    /// Of an image set: the steps of refining that its import did, and the set read again without
    /// one of them, with all its views.
    std::vector<RefineStep> atImport;
    std::function<Result<Bundle>(RefineStep step, Job& job)> importWithout;

    /// Sixteen views of 512x512 pixels on a sphere, and the mesh itself from six sides. Errors:
    /// those of captureBundle() and of rendering.
    [[nodiscard]] static Result<AblationSet> of(const Mesh& mesh, Job& job);
    /// All but some views, four at most, which are the truth. Errors (usage): a bundle of one view.
    [[nodiscard]] static Result<AblationSet> of(Bundle bundle);
};

struct AblationCell {
    double psnr = 0;          ///< RGB, dB, of all pictures of a set together
    double milliseconds = 0;  ///< of processors: refining, preparing and drawing, not the import
};
struct AblationRow {
    std::string stage;                ///< that is left out; empty: none
    std::vector<AblationCell> cells;  ///< by set
};

/// Draws the pictures of all sets with all stages (the first row), without each step of refining
/// that is done, at the import of a set, too, and without each stage of a mode.
/// Times are the fastest of `repeats`. On the processor. Errors: those of rendering, cancelled.
[[nodiscard]] Result<std::vector<AblationRow>> ablate(const std::vector<AblationSet>& sets,
                                                      const RenderSettings& settings, int repeats,
                                                      Job& job);

}  // namespace stx
