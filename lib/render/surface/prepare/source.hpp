#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/image.hpp"
#include "lib/geometry/pixel_space.hpp"
#include "lib/render/api/renderer.hpp"
#include "lib/render/scene/page_set.hpp"
#include "lib/render/surface/prepare/constants.hpp"

namespace stx::surface {

/// Side of the blocks that sources are prepared in, pixels.
inline constexpr int kBlock = kSourceBlock;
/// Blocks along a side of the regions that plans look at first.
inline constexpr int kRegion = 2;
static_assert(kBlock == PageSet::kBlock);

/// A square of (size+1)² pixels that lie on one plane: q = q0 + qx * (column - x) + qy * (row - y).
struct Leaf {
    std::uint16_t x, y, size;
    float q0, qx, qy;
};

/// Where what is drawn of a block may be.
struct BlockRange {
    float qMin = 0, qMax = 0;  ///< over the block and one pixel around; 0, 0 = nothing here
    float reach = 0;           ///< by which what is drawn may leave that range, in q
    /// dq/dx and dq/dy of all that is drawn of it are between these.
    glm::vec2 leastSlope{0}, mostSlope{0};
};

/// What one 16x16 block of a source holds.
struct SourceBlock : BlockRange {
    std::uint32_t leafBegin = 0, leafEnd = 0;
    std::array<std::uint16_t, kBlock> cells{};  ///< 2x2 quads, by upper left pixel, in no leaf
    std::array<std::uint16_t, kBlock> edges{};  ///< pixels that lay out an extension
    /// Of these, not beside background, those whose extension covers what their source shows
    /// behind.
    std::array<std::uint16_t, kBlock> rims{};
    bool anyCell = false, anyEdge = false;
};

/// Bits of PreparedPage::info; the distance to the nearest edge is above them, from bit 4 on.
struct Info {
    static constexpr std::uint8_t kLinkRight = 1, kLinkDown = 2, kBesideBackground = 4, kCrease = 8;
    /// All 0 on edges that are not outlines.
    static constexpr std::uint8_t kAwayFromInnerEdge = 0xf0 | kBesideBackground;

    /// How far a pixel is from where another surface may have a part in its colour: the nearest
    /// edge, or a crease that runs through it.
    [[nodiscard]] static int ownColour(std::uint8_t info) { return info & kCrease ? 0 : info >> 4; }
    /// Whether two surfaces have a part in the colour of a pixel: on a crease, or on an edge beside
    /// another surface. Beside background alpha tells how much of the pixel is background.
    [[nodiscard]] static bool mixesColours(std::uint8_t info) {
        return (info & kCrease) != 0 || (info & kAwayFromInnerEdge) == 0;
    }
};

/// What surface mode knows of each texel of a page.
struct PreparedPage {
    /// 0 = nothing here; below 0 = unknown: a surface is here, other sources may give its distance.
    Image<float> q;
    Image<std::uint8_t> info;
    Image<std::uint8_t> levels;  ///< outlineLevels(), of sources with alpha
    const Texture* texture = nullptr;
};

/// Where neighbouring pixels of a source are kept: those of one rectangle, or of none.
struct Place {
    const PreparedPage* page = nullptr;              ///< null: no rectangle shows them
    std::ptrdiff_t first = 0, stepX = 1, stepY = 0;  ///< texel of (i, j): first + i stepX + j stepY
    unsigned outside = 0;  ///< of no rectangle: bit i + 2 j says that the object is at (i, j)

    [[nodiscard]] std::size_t texel(int i, int j) const {
        return static_cast<std::size_t>(first + i * stepX + j * stepY);
    }
};

/// Where the 4x4 pixels around a point are kept, and which of them: those of the source from
/// (x0, y0) to (x1, y1), one past the last.
struct TapPlace : Place {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

/// One reference view prepared for warping: links between neighbours, edges, planar pieces. Its
/// pixels are in the prepared pages.
struct Source {
    const PageView* view = nullptr;
    std::size_t number = 0;  ///< of the view
    PixelSpace space;
    int width = 0, height = 0;
    bool hasAlpha = false;  ///< some pixel is not fully covered
    float freeLevel = kFreeLevel;
    float step = 0;           ///< scene units between neighbouring depth codes, or left by noise
    float beside = 0;         ///< how far to the side noise may put points, pixels
    double validShare = 1.0;  ///< of the pixels of the object (points, or full alpha): with depth
    float noise = 0;          ///< how far, as a share of q, pixels stray from their neighbours
    float flat = 0;           ///< share of q by which pixels may leave the plane of a piece
    /// The page that holds nothing but this view, upright; null when it is in rectangles.
    const PreparedPage* whole = nullptr;

    int blocksX = 0, blocksY = 0;
    std::vector<SourceBlock> blocks;
    std::vector<Leaf> leaves;
    /// The blocks that hold something, by number, region by region.
    std::vector<std::uint32_t> planned;
    /// Regions of kRegion x kRegion blocks that hold something: plans look at those of all views,
    /// and at the blocks of the views that are drawn.
    struct PlannedRegion : BlockRange {
        int x = 0, y = 0;                  ///< of its first pixel
        std::uint32_t begin = 0, end = 0;  ///< its blocks in `planned`
        glm::vec3 middle{0};               ///< mean of the middles of its blocks: pixels, q
    };
    std::vector<PlannedRegion> regions;

    const PageSet* set = nullptr;
    const PreparedPage* pages = nullptr;  ///< by number
    /// Of a view in rectangles, by block: the one rectangle that all of its pixels and those around
    /// them are read from, or one of these.
    enum : std::int32_t { kSeveralPlaces = -1, kAllPruned = -2, kNothingThere = -3 };
    std::vector<std::int32_t> placeOfBlock;

    /// Where the pixels (x, y) to (x + 1, y + 1) and, when they have points, their neighbours are.
    /// Pixels outside of the source must not be read.
    [[nodiscard]] Place placeOf(int x, int y) const {
        if (whole) return {whole, static_cast<std::ptrdiff_t>(y) * width + x, 1, width, 0};
        return placeInRectangles(x, y);
    }
    /// Where the pixels (x, y) to (x + 3, y + 3) are: taps around a point among the middle four.
    /// Pixels that cannot be read have no point.
    [[nodiscard]] TapPlace tapPlaceOf(int x, int y) const {
        if (whole) return {placeOf(x, y), 0, 0, width, height};
        return tapsInRectangles(x, y);
    }
    [[nodiscard]] float qAt(const Place& p, int i, int j) const {
        if (p.page) return p.page->q.data()[p.texel(i, j)];
        return view->depthMayBeUnknown() && (p.outside >> (i + 2 * j) & 1) ? -1.0f : 0.0f;
    }
    [[nodiscard]] int infoAt(const Place& p, int i, int j) const {
        return p.page ? p.page->info.data()[p.texel(i, j)] : 0;
    }
    /// Alpha 0..1.
    [[nodiscard]] float alphaAt(const Place& p, int i, int j) const {
        if (p.page) return p.page->texture->alpha(p.texel(i, j));
        return p.outside >> (i + 2 * j) & 1 ? 1.0f : 0.0f;
    }
    /// The outline level of a source with alpha.
    [[nodiscard]] float levelAt(const Place& p, int i, int j) const {
        if (!p.page) return p.outside >> (i + 2 * j) & 1 ? 1.0f : 0.0f;
        return (static_cast<float>(p.page->levels.data()[p.texel(i, j)]) - kLevelZero) * kLevelStep;
    }
    /// dq/dx and dq/dy on the surface of pixel (x, y) = (i, j) of the place, which must have a
    /// point, from its linked neighbours.
    [[nodiscard]] glm::vec2 gradientAt(const Place& p, int i, int j, int x, int y) const;

    // ---- Single pixels. ----
    [[nodiscard]] bool contains(int x, int y) const {
        return x >= 0 && y >= 0 && x < width && y < height;
    }
    [[nodiscard]] float q(int x, int y) const { return qAt(placeOf(x, y), 0, 0); }
    [[nodiscard]] float alpha(int x, int y) const { return alphaAt(placeOf(x, y), 0, 0); }
    /// Straight RGBA; black where no rectangle shows the pixel.
    [[nodiscard]] glm::vec4 colour(int x, int y) const {
        const Place p = placeOf(x, y);
        return p.page ? p.page->texture->at(p.texel(0, 0)) : glm::vec4(0.0f);
    }
    [[nodiscard]] glm::vec2 gradient(int x, int y) const {
        return gradientAt(placeOf(x, y), 0, 0, x, y);
    }

  private:
    [[nodiscard]] Place placeIn(const PageRectangle& r, int x, int y) const {
        return {pages + r.page, r.first + x * r.stepX + y * r.stepY, r.stepX, r.stepY, 0};
    }
    [[nodiscard]] Place placeInRectangles(int x, int y) const {
        const std::int32_t one = placeOfBlock[static_cast<std::size_t>(std::max(y, 0) / kBlock) *
                                                  static_cast<unsigned>(blocksX) +
                                              static_cast<unsigned>(std::max(x, 0) / kBlock)];
        if (one >= 0) return placeIn(set->rectangles()[static_cast<std::size_t>(one)], x, y);
        if (one == kSeveralPlaces) return placeAmongRectangles(x, y);
        return {nullptr, 0, 1, 0, one == kAllPruned ? 0b1111u : 0u};
    }
    [[nodiscard]] Place placeAmongRectangles(int x, int y) const;
    [[nodiscard]] TapPlace tapsInRectangles(int x, int y) const;
};

namespace slopes {
using namespace glsl;
#include "shaders/shared/surface_slope.glsl"
}  // namespace slopes
using slopes::chooseSlope;

/// The gradient from q and info of a pixel and its neighbours: `q` and `info` point at the pixel.
[[nodiscard]] inline glm::vec2 gradientFrom(const float* q, const std::uint8_t* info,
                                            std::ptrdiff_t stepX, std::ptrdiff_t stepY,
                                            bool hasLeft, bool hasAbove) {
    const float here = *q;
    const bool left = hasLeft && (info[-stepX] & Info::kLinkRight),
               right = *info & Info::kLinkRight;
    const bool above = hasAbove && (info[-stepY] & Info::kLinkDown),
               below = *info & Info::kLinkDown;
    return {
        chooseSlope(left, left ? here - q[-stepX] : 0.0f, right, right ? q[stepX] - here : 0.0f),
        chooseSlope(above, above ? here - q[-stepY] : 0.0f, below, below ? q[stepY] - here : 0.0f)};
}

inline glm::vec2 Source::gradientAt(const Place& p, int i, int j, int x, int y) const {
    const std::size_t texel = p.texel(i, j);
    return gradientFrom(p.page->q.data() + texel, p.page->info.data() + texel, p.stepX, p.stepY,
                        x > 0, y > 0);
}

/// All views of a PageSet prepared. Not to be moved: its parts point at each other.
struct SurfaceScene {
    PageSet set;
    std::vector<PreparedPage> pages;
    std::vector<Source> sources;

    /// Stage `blend`: the views are smooth but disagree, as captured ones do. Then all that show
    /// about the same count as one surface, and give it their colours.
    bool blends = false;

    /// Textures of `pages` that are not the set's own; see sharpenedTextures().
    std::vector<std::shared_ptr<const Texture>> sharpened;

    /// Stages of preparing that are left out are those of RenderSettings::without. Views that are
    /// alone are not sharpened.
    explicit SurfaceScene(const PageSet& pageSet, const RenderSettings& settings = {});
    SurfaceScene(const SurfaceScene&) = delete;
    SurfaceScene& operator=(const SurfaceScene&) = delete;

  private:
    void begin();
    void prepare(const RenderSettings& settings);
};

/// q and info of a block of a source and one pixel around it, row by row.
struct BlockTexels {
    const float* q = nullptr;  ///< at the block's first pixel
    const std::uint8_t* info = nullptr;
    std::ptrdiff_t stride = 0;

    /// Of the block's pixel (i, j), -1..kBlock.
    [[nodiscard]] std::ptrdiff_t at(int i, int j) const { return j * stride + i; }
};
/// Room for the texels of a block that lies in several rectangles.
struct BlockBuffer {
    static constexpr int kSide = kBlock + 2;
    std::array<float, kSide * kSide> q;
    std::array<std::uint8_t, kSide * kSide> info;
};
/// The texels of the block whose first pixel is (x0, y0). Pixels outside of the source must not be
/// read.
[[nodiscard]] BlockTexels blockTexels(const Source& source, int x0, int y0, BlockBuffer& buffer);

/// Adds the bounds, in the world, of what is drawn of a source.
void addBounds(const Source& source, Bounds& bounds);

/// Share of the image border where the view has points or full alpha: near 1 in scenes that fill
/// the frame.
[[nodiscard]] double borderCoverage(const Source& source);

}  // namespace stx::surface
