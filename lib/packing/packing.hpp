#pragma once

#include <cstdint>
#include <optional>

#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

struct PackSettings {
    enum class Layout {
        /// Whole views in equal cells, in view order, row by row from the top left: view i lies in
        /// column i % columns and row i / columns of its page (i counted from the page's first);
        /// columns is the least number whose square holds the views of a page (N x N views: N),
        /// unless the size forbids it. A cell is the largest view and `padding` on each side; a
        /// view's pixel (0,0) is at (padding, padding) of its cell. Of several objects each has
        /// such a grid on one page, and the grids are fitted closely.
        grid,
        /// Views trimmed to their content (points, and pixels with partial coverage), cut into
        /// patches where that saves room, fitted closely, turned where that makes the textures
        /// smaller. Views without content are dropped with a note, but for frames that are packed
        /// alike. Pixels of full alpha without a depth (pruned, or missed by a sensor) are left out
        /// unless they lie amid others, and counted in Atlas::sourcePixels; of those that a sensor
        /// missed a note says so.
        tight,
    };
    Layout layout = Layout::grid;
    /// Pixels around each rectangle, 0..64. 2^L - 1 keep neighbours out of mip level L: 1, 3, 7.
    int padding = 2;
    int maxSize = 16384;  ///< largest width and height of a texture: what a GPU takes; 1..65535
    /// Each page is exactly this large, whatever is left of it; {0, 0}: as large as is needed.
    glm::ivec2 size{0};
    /// Largest page, where one side may be longer than the other; {0, 0}: maxSize both ways.
    glm::ivec2 maxPage{0};
    /// Width and height of pages are powers of two, the smallest in which all fits.
    bool powerOfTwo = false;
    /// Of several models in one bundle (joinObjects()): which views are whose; null: it is one.
    const std::vector<AtlasObject>* objects = nullptr;
    /// Object pixels before pruning (PruneReport::sourcePixels), for Atlas::sourcePixels; 0 = the
    /// points and the pixels of full alpha without a depth.
    std::int64_t sourcePixels = 0;
    /// Pixels with colours but no depth before pruning (PruneReport::unmeasuredPixels), for the
    /// note of the tight layout, 0: there is none; nothing: those of views that were not pruned.
    std::optional<std::int64_t> unmeasuredPixels{};
    /// Memory that writing takes beside the pages, bytes a pixel; nothing: the most of any
    /// container.
    std::optional<std::uint64_t> bytesToWrite{};
    /// Of frames that are packed alike (PackPeriod::content()): the tight layout goes by these
    /// views, in number and size those of the bundle, and keeps all; null = by the bundle itself.
    const Bundle* contentOf = nullptr;
};

/// Merges the views of a bundle into one atlas of at most four textures: one page, or two when
/// there are neither normals nor splats and one is not enough. Padding repeats what surrounds a
/// rectangle in its view, and the view's edge beyond that, so that filters see the neighbours that
/// they would see in the view.
///
/// Errors: settings out of range; a bundle that fails check(), or other views than contentOf; views
/// that cannot fit, with a size in which they do and what to change; cancelled; memory over the
/// limit.
[[nodiscard]] Result<Atlas> pack(const Bundle& bundle, const PackSettings& settings, Job& job);

/// A model among those that are to share an atlas.
struct PackObject {
    std::string name;  ///< not empty
    Bundle bundle;
    std::int64_t sourcePixels = 0;  ///< as PackSettings::sourcePixels
};
/// All their views, for pack() with PackSettings::objects.
struct JoinedObjects {
    Bundle bundle;
    std::vector<AtlasObject> objects;
};

/// Puts models into one bundle, each in coordinates of its own. Environments, times and durations
/// are left out, the first with a note.
/// Errors: a bundle that fails check(); (usage) two objects of one name; (invalidInput) one without
/// a point, or in another colour space than the first.
[[nodiscard]] Result<JoinedObjects> joinObjects(std::vector<PackObject> objects, Job& job);

/// Whether most pixels of a view that lack a depth have less than full alpha, as of a masked
/// photograph: they are empty. Photographs that fill their frame lack it where a sensor missed it.
[[nodiscard]] bool lacksDepthByMask(const ReferenceView& view);

/// A bit for each pixel of a view, row by row: set where the object is, or may be, even where no
/// rectangle shows it. Empty, as if none were set, where nothing of the object is missing: in
/// atlases with all its pixels (keptPixels = sourcePixels), and of views that are neither pruned
/// nor have unknown depth. Else that is where points of other views fall, a little generously, and
/// everywhere in a view whose missing depth is unknown, unless it is masked as lacksDepthByMask()
/// says of the whole view (ViewHeader::masked; of older atlases: of its rectangles and their
/// padding). The atlas must pass check().
[[nodiscard]] std::vector<std::uint64_t> outsideBits(const Atlas& atlas, std::size_t view);

/// The bundle of an atlas: every pixel of every rectangle back in its view. Pixels in no rectangle
/// are coloured from the nearest covered ones and are background (alpha 0). Of views that lack
/// pixels those in outsideBits() have full alpha instead (the object is there, another view gives
/// its distance), and next to rectangles the padding decides. unpack(pack(b)) == b for points and
/// pixels of partial coverage. Views without metallic-roughness come back with 0 and 1, which is
/// what materials are that do not say them, where others have it. Errors: an atlas that fails
/// check(), memory over the limit.
[[nodiscard]] Result<Bundle> unpack(const Atlas& atlas, Job& job);

}  // namespace stx
