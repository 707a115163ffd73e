#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "formats/mpeg4/scene/placement.hpp"
#include "lib/geometry/bounds.hpp"

// clang-format off
/// What our scenes say in WorldInfo.info beyond the nodes' fields, so that nothing of a bundle is
/// lost:
///
///     "bounds minX minY minZ maxX maxY maxZ"
///     "origin x y z" (added to all coordinates here, gives the world's; see Bundle::origin)
///     "name DEFNAME the view's own name"
///     "padding DEFNAME left top right bottom cx cy"
///
/// Padding is in pixels, cx and cy are the principal point without it. Other strings are left alone.
// clang-format on
namespace stx::mpeg4 {

struct ViewNotes {
    std::optional<Bounds> bounds;
    glm::dvec3 origin{0.0};
    std::map<std::string, std::string> names;  ///< by DEF name
    struct Pad {
        int left = 0, top = 0, right = 0, bottom = 0;
        double cx = 0, cy = 0;
    };
    std::map<std::string, Pad> paddings;  ///< by DEF name

    /// Strings that are not ours, or do not parse, are passed over.
    [[nodiscard]] static ViewNotes parse(const std::vector<std::string>& info);
    [[nodiscard]] std::vector<std::string> text() const;
};

/// Takes the padding off a view again: images are cropped, the principal point goes back to where
/// it was. Does nothing when the padding does not fit the view.
void removePadding(ReferenceView& view, const ViewNotes::Pad& pad);

}  // namespace stx::mpeg4
