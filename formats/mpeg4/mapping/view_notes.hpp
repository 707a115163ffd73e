#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "formats/mpeg4/scene/placement.hpp"
#include "lib/base/job.hpp"
#include "lib/geometry/bounds.hpp"
#include "lib/model/reference_view.hpp"

// clang-format off
/// What our scenes say in WorldInfo.info beyond the nodes' fields, so that nothing of a bundle is
/// lost:
///
///     "bounds minX minY minZ maxX maxY maxZ"
///     "start seconds" (of the film's own clock, at the presentation's 0; see Timeline)
///     "duration seconds" (of a moment of a film that stands alone, see Bundle::duration; of a film
///     whose pictures and commands do not tell its end)
///     "origin x y z" (added to all coordinates beside the WorldInfo, in its frame, gives the
///     world's; see Bundle::origin)
///     "views count" (DepthImages, or pictures of an OctreeImage, beside the WorldInfo)
///     "name #N the view's own name"
///     "padding #N left top right bottom cx cy"
///     "pruned #N layer where"
///     "unknown #N layer where" (see ReferenceView::noDepth)
///     "background #N layer" (see ReferenceView::background)
///     "refined #N layer steps doubt" (see Refined::text())
///
/// N is the view's number among those beside the WorldInfo, from 0: programs that write a scene
/// anew keep the order, not DEF names. Files of before have DEF names instead. Padding is in pixels, cx and cy are the principal point without it. A pruned view is layer 0 of
/// its DepthImage, or a further one of a PointTexture; where it was pruned is "alpha" (full alpha
/// without a depth), or, when the scene has no alpha for it, "all" (all that has no depth) or a PNG
/// in base64, white where it was pruned. The same of views whose missing depth is unknown. Other
/// strings are left alone.
// clang-format on
namespace stx::mpeg4 {

struct ViewNotes {
    std::optional<Bounds> bounds;
    std::optional<glm::dvec3> origin;
    std::optional<double> start, duration;
    std::optional<int> count;  ///< of the views that keys number
    struct Pad {
        int left = 0, top = 0, right = 0, bottom = 0;
        double cx = 0, cy = 0;
    };
    struct Layer {
        /// Where depth is unknown: kUnknownInAlpha, kUnknownAll, or the text of a mask. Of a view
        /// that was pruned, and of one with NoDepth::unknown.
        std::optional<std::string> pruned, unknown;
        bool background = false;
        Refined refined;
    };
    struct View {
        std::string name;  ///< its own; empty: not said
        std::optional<Pad> padding;
        std::map<int, Layer> layers;
    };
    std::map<std::string, View> views;  ///< by keyOf() or DEF name
    /// Of a view with that number.
    [[nodiscard]] static std::string keyOf(std::size_t number) {
        return fmt::format("#{}", number);
    }

    /// Strings that do not parse are passed over, and so are all of a WorldInfo that has no
    /// kMadeByUs among them: they are not ours.
    [[nodiscard]] static ViewNotes parse(const std::vector<std::string>& info);
    [[nodiscard]] std::vector<std::string> text() const;
};

/// Takes the padding off a view again: images are cropped, the principal point goes back to where
/// it was. Does nothing when the padding does not fit the view.
void removePadding(ReferenceView& view, const ViewNotes::Pad& pad);

/// What a note says of a view whose alpha is written, and of one that is opaque all over.
inline constexpr const char *kUnknownInAlpha = "alpha", *kUnknownAll = "all";
/// The pixels of full alpha without a depth, of one picture of a view or of a film's together: a
/// note is of the whole film, so what is unknown in one picture is so in all that have no depth
/// there.
class UnknownPixels {
  public:
    void add(const Rgba8Image& texture, const Image<float>& depth);
    /// A picture with NoDepth::empty.
    void addEmpty() { elsewhere_ = true; }
    /// Whether a pixel is unknown, or all would be that have no depth.
    [[nodiscard]] bool any() const { return !unknown_.empty() || !elsewhere_; }
    /// A note's text: kUnknownAll where no pixel is without both, else a PNG of grey in base64.
    [[nodiscard]] Result<std::string> text() const;

  private:
    glm::ivec2 size_{0};
    std::vector<bool> unknown_;  ///< row by row; empty: none
    bool elsewhere_ = false;     ///< some pixel has neither depth nor full alpha
};
/// The same of one picture.
[[nodiscard]] Result<std::string> unknownMask(const Rgba8Image& texture, const Image<float>& depth);
/// Gives a view of 8-bit colour the alpha that a mask says. Errors: the mask is not such a PNG, or
/// has another size than the view.
[[nodiscard]] Result<void> applyUnknownMask(ReferenceView& view, const std::string& mask,
                                            const Limits& limits);

}  // namespace stx::mpeg4
