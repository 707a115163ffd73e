#pragma once

#include <cstdint>
#include <string>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

/// How far to the side of a photograph the eye may go without a hole, percent of the median
/// distance: what people turn a picture by to see that it is deep, and what depth of phones bears.
inline constexpr double kUsualBehindPercent = 8;
/// The greatest that may be asked for: what is invented then is larger than what is seen.
inline constexpr double kMostBehindPercent = 25;

struct BehindSettings {
    double shiftPercent = kUsualBehindPercent;  ///< above 0, at most kMostBehindPercent
};

struct BehindPhoto {
    /// Colour and depth; marked as ReferenceView::background. The photograph's pose and focal
    /// length, larger by the border on all sides, a little wider where that puts the principal
    /// point into the middle. Pixels where nothing was invented are empty:
    /// alpha 0, kNoDepth.
    ReferenceView view;
    glm::ivec2 border{0};     ///< pixels at the left, and above
    std::int64_t hidden = 0;  ///< pixels inside of the photograph's frame that were invented
};

/// Invents what one photograph with depth hides, as far as an eye uncovers it that goes to the
/// side, up or down by a share of the median distance and looks at what is there, and what is
/// around its frame. What can be uncovered follows from depth alone (no threshold on edges); depth
/// there is that of the nearest place beside it that is behind it; colours go on from what is at
/// that depth or farther. `view`: perspective, with a point at least; its images are not changed.
/// The same bytes on any number of threads. Errors (invalidInput): an orthographic view, one
/// without points, more memory than the job allows; (usage) a shift out of range; cancelled.
[[nodiscard]] Result<BehindPhoto> behindPhoto(const ReferenceView& view,
                                              const BehindSettings& settings, Job& job);

/// What addBehind() added.
struct AddedBehind {
    std::string name;
    glm::ivec2 border{0};
    double hidden = 0;  ///< share of the photograph's pixels
    double seen = 0;    ///< share of the added view's pixels that it shows

    /// For people: what was invented.
    [[nodiscard]] std::string note(const BehindSettings& settings) const;
};
/// Adds behindPhoto() of the one view of a bundle, named after it, in place of background views
/// that the bundle has. Errors: those of behindPhoto(); (invalidInput) another number of views.
[[nodiscard]] Result<AddedBehind> addBehind(Bundle& bundle, const BehindSettings& settings,
                                            Job& job);

}  // namespace stx
