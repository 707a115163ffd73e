#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "formats/mpeg4/scene/placement.hpp"
#include "lib/base/job.hpp"
#include "lib/geometry/bounds.hpp"

// clang-format off
/// What our scenes say in WorldInfo.info beyond the nodes' fields, so that nothing of a bundle is
/// lost:
///
///     "bounds minX minY minZ maxX maxY maxZ"
///     "start seconds" (of the film's own clock, at the presentation's 0; see Timeline)
///     "origin x y z" (added to all coordinates here, gives the world's; see Bundle::origin)
///     "name DEFNAME the view's own name"
///     "padding DEFNAME left top right bottom cx cy"
///     "pruned DEFNAME layer where"
///     "unknown DEFNAME layer where" (see ReferenceView::noDepth)
///     "background DEFNAME layer" (see ReferenceView::background)
///
/// Padding is in pixels, cx and cy are the principal point without it. A pruned view is layer 0 of
/// its DepthImage, or a further one of a PointTexture; where it was pruned is "alpha" (full alpha
/// without a depth), or, when the scene has no alpha for it, "all" (all that has no depth) or a PNG
/// in base64, white where it was pruned. The same of views whose missing depth is unknown. Other
/// strings are left alone.
// clang-format on
namespace stx::mpeg4 {

struct ViewNotes {
    std::optional<Bounds> bounds;
    glm::dvec3 origin{0.0};
    std::optional<double> start;
    std::map<std::string, std::string> names;  ///< by DEF name
    struct Pad {
        int left = 0, top = 0, right = 0, bottom = 0;
        double cx = 0, cy = 0;
    };
    std::map<std::string, Pad> paddings;  ///< by DEF name
    /// Where depth is unknown, by DEF name and layer: kUnknownInAlpha, kUnknownAll, or the text of
    /// a mask. Of views that were pruned, and of those with NoDepth::unknown.
    std::map<std::pair<std::string, int>, std::string> pruned, unknown;

    /// Views that are background, by DEF name and layer.
    std::set<std::pair<std::string, int>> backgrounds;

    /// Strings that are not ours, or do not parse, are passed over.
    [[nodiscard]] static ViewNotes parse(const std::vector<std::string>& info);
    [[nodiscard]] std::vector<std::string> text() const;
};

/// Takes the padding off a view again: images are cropped, the principal point goes back to where
/// it was. Does nothing when the padding does not fit the view.
void removePadding(ReferenceView& view, const ViewNotes::Pad& pad);

/// What a note says of a view whose alpha is written, and of one that is opaque all over.
inline constexpr const char *kUnknownInAlpha = "alpha", *kUnknownAll = "all";
/// The pixels of full alpha without a depth, as a note's text: kUnknownAll where no pixel is
/// without both, else a PNG of grey in base64.
[[nodiscard]] Result<std::string> unknownMask(const Rgba8Image& texture, const Image<float>& depth);
/// Gives a view of 8-bit colour the alpha that a mask says. Errors: the mask is not such a PNG, or
/// has another size than the view.
[[nodiscard]] Result<void> applyUnknownMask(ReferenceView& view, const std::string& mask,
                                            const Limits& limits);

}  // namespace stx::mpeg4
