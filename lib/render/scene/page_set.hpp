#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/view_summary.hpp"
#include "lib/refine/refine.hpp"

namespace stx {

/// The images of one texture page, all of one size. They belong to the bundle or atlas.
struct Page {
    const Texture* texture = nullptr;
    const Image<float>* depth = nullptr;       ///< distances in scene units, kNoDepth = no point
    const Image<glm::vec3>* normal = nullptr;  ///< null when absent
    const Image<glm::vec3>* splatU = nullptr;  ///< null when absent
    const Image<glm::vec3>* splatV = nullptr;

    [[nodiscard]] int width() const { return depth->width(); }
    [[nodiscard]] int height() const { return depth->height(); }
};

/// A rectangle of a reference view on a page. It can be read in two ways: as a part of its view,
/// pixel (x, y) of the view being texel `first + x * stepX + y * stepY` of the page; and as a small
/// view of its own, whose pixels are the page's and whose camera is `window`.
struct PageRectangle {
    int view = 0, page = 0;
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< in the view, x1 and y1 one past the last
    std::ptrdiff_t first = 0, stepX = 1, stepY = 0;

    int pageX = 0, pageY = 0;   ///< first texel on the page
    int width = 0, height = 0;  ///< on the page
    /// Texels beyond each side of the rectangle on the page that repeat its view's pixels, without
    /// what would lie outside of the view.
    int left = 0, top = 0, right = 0, bottom = 0;
    Camera window;  ///< of the rectangle's texels: pixel (0, 0) is texel (pageX, pageY)

    [[nodiscard]] std::size_t texel(int x, int y) const {
        return static_cast<std::size_t>(first + x * stepX + y * stepY);
    }
    /// Whether texel (i, j) of the window or of what surrounds it shows a pixel of the view.
    [[nodiscard]] bool shows(int i, int j) const {
        return i >= -left && j >= -top && i < width + right && j < height + bottom;
    }
};

/// A reference view of a PageSet.
struct PageView : ViewHeader {
    bool hasNormals = false, hasSplats = false;
    /// Its rectangles in PageSet::rectangles().
    std::uint32_t firstRectangle = 0, rectangleCount = 0;
    /// One upright rectangle holds all of the view, and nothing else is on the page.
    bool whole = false;
    /// Of a view whose pixels were not read, which is whole and has no part in what is drawn; else
    /// null. It belongs to who made the set. The images of its page are empty.
    const ViewSummary* unread = nullptr;
};

/// What renderers draw from: texture pages, rectangles on them, cameras (Lee & Park, section 3.1:
/// the reference images merged into few textures). A bundle is one page and one rectangle for each
/// view; an atlas goes in as it is. Cheap to copy; safe to read from several threads. The bundle or
/// atlas must outlive it.
class PageSet {
  public:
    /// Side of the blocks in which rectangles are looked up, pixels of a view.
    static constexpr int kBlock = 16;
    /// Pixels around a rectangle that filters and links read.
    static constexpr int kPadding = 2;

    PageSet(const Bundle& bundle);  // NOLINT: a bundle is a set of pages
    /// The same of a bundle in a spool. What is made of its pixels is kept there, too.
    PageSet(const Bundle& bundle, PixelSpool& spool);
    /// The same of a bundle of which some views have no images, but a summary, which must outlive
    /// it, too; `summaries`: one for each view. `spool` may be null.
    PageSet(const Bundle& bundle, std::span<const ViewSummary> summaries, PixelSpool* spool);
    /// The pages of an atlas. Where the rectangles do not have kPadding pixels of padding to
    /// themselves (see Atlas::paddingHolds()) it is unpacked first, which costs the views' memory.
    /// Errors: an atlas that fails check(), memory over the limit.
    [[nodiscard]] static Result<PageSet> of(const Atlas& atlas, Job& job);

    [[nodiscard]] std::span<const Page> pages() const { return data_->pages; }
    [[nodiscard]] std::span<const PageView> views() const { return data_->views; }
    /// The rectangles, in the order of their views.
    [[nodiscard]] std::span<const PageRectangle> rectangles() const { return data_->rectangles; }
    [[nodiscard]] std::span<const PageRectangle> rectanglesOf(std::size_t view) const {
        const PageView& v = data_->views[view];
        return rectangles().subspan(v.firstRectangle, v.rectangleCount);
    }

    /// Where pixels are kept that are made of these; null: in memory. It outlives the set.
    [[nodiscard]] PixelSpool* spool() const { return data_->spool; }
    /// See PixelSpool::settle().
    void settle() const {
        if (spool()) spool()->settle();
    }
    /// Whether colours are linear floats; of a set without pixels: no.
    [[nodiscard]] bool linear() const;
    [[nodiscard]] bool pruned() const { return data_->pruned; }
    [[nodiscard]] std::int64_t pointCount() const;
    /// The same with translucent surfaces made opaque, for renderers to whom alpha says how much of
    /// a pixel the object covers at its outline: points with translucent points all around them,
    /// and those beside such, get full alpha. `changed` tells whether there were any.
    [[nodiscard]] PageSet solid(bool& changed) const;

    /// The views that are background, or those that are not, with their pages only. Empty when
    /// there are none: nothing can be drawn from it then.
    [[nodiscard]] PageSet part(bool background) const;
    /// The same without views that repeat another: a grid of octahedral:N has its border twice.
    /// Views that agree only because they are one would outvote the others. The first of each is
    /// kept; of pruned views all are, since each has its own part.
    [[nodiscard]] PageSet distinct() const;
    /// The same with colours in the light of another set: where a view of that has the same camera,
    /// colours are multiplied by what they differ by where both show the same surface (for each
    /// channel, robustly; nothing below half a step of 8 bits, nothing above a factor of two).
    [[nodiscard]] PageSet inLightOf(const PageSet& other) const;
    /// The same with the colours of its views matched where they show the same surfaces, as
    /// cameras with exposures of their own need it (RefineStep::exposure); the very same when they
    /// agree already, or were refined before.
    [[nodiscard]] PageSet inOneLight(const RefineSettings& settings,
                                     RefineStepReport& report) const;
    /// Whether refined() may change something. Looks at one view after the other.
    [[nodiscard]] bool mayRefine(const RefineSettings& settings) const;
    /// The same with the depth of its views refined, those behind it not, and normals and splat
    /// axes that follow it (renewSurface()): the very same where depth is exact. `report`, if any,
    /// tells what was found and changed. Works on `atOnce` views at a time (RefineRoom); 0: any
    /// number.
    [[nodiscard]] PageSet refined(const RefineSettings& settings, RefineReport* report = nullptr,
                                  std::int64_t atOnce = 0) const;
    /// The same before another background, behind its own: what views with measured depth show
    /// without it, where that could be found, else far away (unmeasuredDepth()). The very same
    /// where `captured`, these views before they were refined, has no such pixels; `pixels` tells
    /// how many.
    [[nodiscard]] PageSet withUnmeasured(const PageSet& captured, std::int64_t& pixels) const;
    /// The same without points that others show at least twice as finely, and without views that
    /// have no others, for splat mode: large splats stick out beyond outlines that finer views
    /// know. `points` tells how many.
    [[nodiscard]] PageSet withoutCoarse(std::int64_t& points) const;
    /// Scene units: points of withUnmeasured() farther than half of this are "far away", since
    /// nobody knows where they are. 0 for other sets.
    [[nodiscard]] double farAway() const { return data_->farAway; }
    /// Whether depth is as exact as its codes: no noise, nothing that reached over its edges.
    [[nodiscard]] bool exactDepth() const;
    /// The texture of a page as it was before inOneLight().
    [[nodiscard]] const Texture& captured(std::size_t page) const {
        return data_->captured.empty() ? *pages()[page].texture : *data_->captured[page];
    }
    /// The background views, which are drawn where nothing else is. Null when there are none.
    [[nodiscard]] const PageSet* behind() const { return behind_.get(); }
    /// The same views in front of a background.
    [[nodiscard]] PageSet before(PageSet background) const {
        PageSet set = *this;
        set.behind_ = std::make_shared<const PageSet>(std::move(background));
        return set;
    }

    /// World bounds of all points: those that the file gives, else computed from the pixels, and of
    /// views without pixels what their summaries tell.
    [[nodiscard]] Bounds bounds() const;

    /// A rectangle from whose texels pixel (x, y) of a view can be read, padding included; null
    /// where there is none. The pixel must be in the view.
    [[nodiscard]] const PageRectangle* find(std::size_t view, int x, int y) const {
        return find(view, x, y, x, y);
    }
    /// The same for all pixels from (x0, y0) to (x1, y1), inclusive, at most kBlock apart.
    [[nodiscard]] const PageRectangle* find(std::size_t view, int x0, int y0, int x1, int y1) const;
    /// Whether all pixels from (x0, y0) to (x1, y1), inclusive, can be read from a rectangle's
    /// texels, padding included.
    [[nodiscard]] bool reads(const PageRectangle& r, int x0, int y0, int x1, int y1) const {
        const int padding = data_->padding;
        return x0 >= r.x0 - padding && y0 >= r.y0 - padding && x1 < r.x1 + padding &&
               y1 < r.y1 + padding;
    }
    /// Numbers of the rectangles in or beside the block of a view that holds a pixel.
    [[nodiscard]] std::span<const std::uint32_t> near(std::size_t view, int x, int y) const {
        const ViewIndex& index = data_->index[view];
        const std::size_t block = static_cast<std::size_t>(y / kBlock) * index.blocksX +
                                  static_cast<unsigned>(x / kBlock);
        return std::span(index.near)
            .subspan(index.begin[block], index.begin[block + 1] - index.begin[block]);
    }
    /// Whether the object is at a pixel that no rectangle shows: another view gives its distance.
    [[nodiscard]] bool objectOutside(std::size_t view, int x, int y) const {
        const auto& bits = data_->index[view].outside;
        if (bits.empty()) return false;
        const std::size_t i = static_cast<std::size_t>(y) * data_->views[view].camera.width +
                              static_cast<unsigned>(x);
        return bits[i / 64] >> (i % 64) & 1;
    }

    /// The marks of objectOutside() of a whole view, a bit for each pixel, row by row; empty when
    /// none is set.
    [[nodiscard]] std::span<const std::uint64_t> outside(std::size_t view) const {
        return data_->index[view].outside;
    }

    // ---- Single pixels of a view; slow ways for what is not worth a loop over rectangles. ----

    /// Coverage 0..1; of pixels that no rectangle shows: 1 where the object is, else 0.
    [[nodiscard]] float alpha(std::size_t view, int x, int y) const {
        const PageRectangle* r = find(view, x, y);
        if (!r) return objectOutside(view, x, y) ? 1.0f : 0.0f;
        return pages()[r->page].texture->alpha(r->texel(x, y));
    }
    /// Distance; kNoDepth where there is no point.
    [[nodiscard]] float depth(std::size_t view, int x, int y) const {
        const PageRectangle* r = find(view, x, y);
        return r ? pages()[r->page].depth->data()[r->texel(x, y)] : kNoDepth;
    }
    /// The texture of one view, as large as the view. Pixels that no rectangle shows are black;
    /// they have full alpha where objectOutside().
    [[nodiscard]] Texture textureOfView(std::size_t view) const;
    /// One view with images of its own, as unpack() gives it.
    [[nodiscard]] ReferenceView copyOfView(std::size_t view) const;

  private:
    /// The rectangles of a view that lie in each of its blocks of kBlock pixels.
    struct ViewIndex {
        std::uint32_t blocksX = 0;
        std::vector<std::uint32_t> begin;    ///< of each block in `near`, and the end
        std::vector<std::uint32_t> near;     ///< rectangles whose padding reaches the block
        std::vector<std::uint64_t> outside;  ///< a bit for each pixel; empty = all clear
    };
    struct Data {
        std::vector<Page> pages;
        std::vector<PageView> views;
        std::vector<PageRectangle> rectangles;
        std::vector<ViewIndex> index;
        std::optional<Bounds> bounds;
        double farAway = 0;
        int padding = 0;  ///< texels around each rectangle that may be read
        bool pruned = false;
        PixelSpool* spool = nullptr;
        std::shared_ptr<const Bundle> unpacked;  ///< of an atlas without room around rectangles
        /// The copies of textures that solid(), inLightOf() and inOneLight() made.
        std::vector<std::shared_ptr<const Texture>> changed;
        std::vector<const Texture*> captured;  ///< by page; empty: those of the pages
        std::vector<std::shared_ptr<const Image<float>>>
            refined;  ///< depth of refined() and withoutCoarse()
        /// Normals and splat axes of refined().
        std::vector<std::shared_ptr<const Image<glm::vec3>>> renewed;
    };
    explicit PageSet(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
    [[nodiscard]] PageSet only(const std::vector<bool>& kept) const;
    /// The set of `data`, a copy of these that may have been changed, with another depth for pages
    /// that have one in `depths`, before the same background.
    [[nodiscard]] PageSet withDepths(std::shared_ptr<Data> data,
                                     std::vector<std::shared_ptr<Image<float>>> depths) const;
    static void addBundle(const Bundle& bundle, Data& data);
    static void addRectangle(const AtlasRectangle& from, int padding, Data& data);
    static void buildIndex(Data& data);

    std::shared_ptr<const Data> data_;
    std::shared_ptr<const PageSet> behind_;
};

inline const PageRectangle* PageSet::find(std::size_t view, int x0, int y0, int x1, int y1) const {
    const PageView& v = data_->views[view];
    const PageRectangle* all = data_->rectangles.data();
    if (v.whole) return all + v.firstRectangle;
    for (const std::uint32_t number : near(view, x0, y0))
        if (reads(all[number], x0, y0, x1, y1)) return all + number;
    return nullptr;
}

/// Whether a camera is the very one of a reference view: same pose, lens and size.
[[nodiscard]] bool sameCamera(const Camera& a, const Camera& b);

}  // namespace stx
