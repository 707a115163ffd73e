#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lib/base/image.hpp"
#include "lib/model/reference_view.hpp"
#include "lib/refine/refine.hpp"

/// Refining of views wherever their images are: in a bundle, or on the pages of an atlas.

namespace stx {

/// A view whose depth is refined. All images have the camera's size.
struct RefineView {
    const ViewHeader* header = nullptr;
    const Texture* texture = nullptr;
    const Image<float>* depth = nullptr;  ///< scene units, kNoDepth = no point
};

struct RefinedView {
    /// None: as it was. Pixels that no step changed have the very same value; those without depth
    /// that have full alpha are unknown in a view with doubt.
    std::optional<Image<float>> depth;
    bool lost = false;  ///< points were taken away: what is there is not known
    Refined refined;    ///< what the view had before, and its new doubt; see RefineReport::record()

    /// Writes into a view's header what is said there: steps, doubt, planes around the new depth.
    void giveTo(ViewHeader& view) const;
};

/// Where refining keeps what it knows of all views, and on how many it works at a time: in a spool
/// memory is taken for those alone.
struct RefineRoom {
    PixelSpool* spool = nullptr;  ///< null: memory. It must outlive what refineDepth() gives
    std::int64_t atOnce = 0;      ///< 0: any number
};

/// The room of a spool, for views of which the largest has so many pixels. Errors (invalidInput):
/// that one alone takes more than the limit.
[[nodiscard]] Result<RefineRoom> roomIn(PixelSpool& spool, std::uint64_t largest,
                                        const Limits& limits);

/// Refines the depth of views of one moment, unless one of them was refined before: see
/// RefineSettings::after(). The same on any number of threads, and in any room.
[[nodiscard]] std::vector<RefinedView> refineDepth(std::span<const RefineView> views,
                                                   const RefineSettings& settings,
                                                   RefineReport& report,
                                                   const RefineRoom& room = {});

/// Tells of views that are looked at one by one whether refineDepth() may change one of them: views
/// in the rectangles of an atlas cost memory to be side by side.
class RefineNeeds {
  public:
    explicit RefineNeeds(const RefineSettings& settings) : settings_(settings) {}
    void add(const RefineView& view);
    /// What was found of others, with the same settings.
    void add(const RefineNeeds& others);
    [[nodiscard]] bool any() const;
    /// Whether that is so whatever more views show.
    [[nodiscard]] bool surely() const;

  private:
    RefineSettings settings_;
    bool some_ = false;
    std::int64_t noisyPoints_ = 0;
    std::vector<float> edgeShares_;
};

}  // namespace stx
