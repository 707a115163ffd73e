#pragma once

#include <functional>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/mesh.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// How many views to choose.
struct SelectSettings {
    int count = 0;  ///< at most so many; 0 = as many as `share` asks for
    /// Enough when the choice is worth this share of all candidates together, 0..1. With a count
    /// and the default of 1, the count decides.
    double share = 1.0;
    double targetDensity =
        0;                ///< wanted samples per scene unit; 0 = what candidates typically give
    int samples = 40000;  ///< pieces of surface looked at, 100..10,000,000;
                          ///< fewer among more than a thousand views
};

/// The views chosen among candidates, and how good the choice is.
struct Selection {
    std::vector<int> views;  ///< indices of candidates, the most valuable first
    /// Quality after each view, as a share of that of all candidates, 0..1: the curve.
    std::vector<double> quality;
    /// The choice reaches at least this share of the best possible quality with as many views.
    double certificate = 1;
    double coverage = 0;       ///< share of the surface that the chosen views see
    double coverageOfAll = 0;  ///< share of the surface that any candidate sees
    /// Share of the surface that no candidate sees: inside cavities. 0 when chosen from a bundle,
    /// whose views are all that is known.
    double neverSeen = 0;
    int candidates = 0;
};

/// Chooses the fewest views of a bundle that still cover its surface (CoverProblem). Views without
/// points are never chosen (said with a note). Errors: settings out of range, a bundle that fails
/// check() or has no point, points too near for any view to see their surface, cancelled.
[[nodiscard]] Result<Selection> selectViews(const Bundle& bundle, const SelectSettings& settings,
                                            Job& job);

/// The same of a table, whose views are read one by one: twice, and where their file does not say
/// how many points they have three times.
[[nodiscard]] Result<Selection> selectViews(const ViewTable& table, const SelectSettings& settings,
                                            Job& job);

/// The bundle with only the chosen views, in their old order.
[[nodiscard]] Bundle keepViews(Bundle bundle, const std::vector<int>& views);

/// Candidate directions around a mesh.
struct MeshCandidates {
    int directions = 200;  ///< even on the sphere, 1..4096
    int depthSize = 384;   ///< longer side of the depth images that tell what each sees, 16..2048
    ViewFraming framing;   ///< of the views that will be captured; each drawn in to fill its frame
};

struct MeshSelection {
    Selection selection;
    std::vector<Camera> cameras;  ///< of the chosen views, ready to capture, best first
};

/// Chooses the best views around a mesh. Errors: settings out of range, a mesh without surface,
/// cancelled.
[[nodiscard]] Result<MeshSelection> selectMeshViews(const Mesh& mesh,
                                                    const MeshCandidates& candidates,
                                                    const SelectSettings& settings, Job& job);

/// The least number of views, from 1 to `most`, whose measure reaches `target`: measure(n) (in dB,
/// say) is taken to grow with n and is called for few n. Returns `most` when nothing reaches it.
[[nodiscard]] Result<int> leastViews(int most, double target,
                                     const std::function<Result<double>(int)>& measure);

/// A picture (SVG) of quality against the number of views. The same bytes for the same selection.
[[nodiscard]] std::string selectionPlotSvg(const Selection& selection, const std::string& title);

}  // namespace stx
