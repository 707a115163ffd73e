#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lib/base/image.hpp"
#include "lib/packing/prune.hpp"
#include "lib/surface/depth_gradient.hpp"

namespace stx {

/// Where pixels of a picture are kept of which most are empty: only the blocks that have some take
/// room.
class BlockPlaces {
  public:
    static constexpr unsigned kSide = 16;  ///< of a block, pixels

    BlockPlaces() = default;
    /// Of the blocks in which `wanted` is not 0 somewhere.
    explicit BlockPlaces(const Image<std::uint8_t>& wanted);

    /// Pixels that there is room for.
    [[nodiscard]] std::size_t size() const { return size_; }
    /// Of a pixel in such a block, below size().
    [[nodiscard]] std::size_t at(int x, int y) const {
        const auto u = static_cast<unsigned>(x), v = static_cast<unsigned>(y);
        return first_[v / kSide * blocksX_ + u / kSide] + v % kSide * kSide + u % kSide;
    }

  private:
    std::size_t blocksX_ = 0, size_ = 0;
    std::vector<std::size_t> first_;  ///< of each block
};

/// One view prepared for finding pixels of other views in it: what is looked at of its points, so
/// that the view itself need not be in memory.
struct PruneView {
    Camera camera;
    bool background = false;
    double step = 0;         ///< see DepthSurface
    double codeStep = 0;     ///< see CandidateView::step
    double worldRadius = 0;  ///< of the sphere around its points
    glm::dvec3 worldCentre{0.0};
    glm::dmat3 worldFromCamera{1.0}, cameraFromWorld{1.0};
    std::vector<int> partners;  ///< views that may show the same surface, best rank first
    Image<std::uint8_t> kept;   ///< 1 = a point that is still here
    std::vector<bool> points;   ///< of each pixel, row by row
    std::vector<bool> empty;    ///< the same: mostly background, alpha below one half

    BlockPlaces places;  ///< of its points; by them:
    struct Surfel {
        float w = 0;  ///< see DepthSurface
        glm::vec2 gradient{0.0f};
    };
    std::vector<Surfel> surfels;
    std::vector<glm::u8vec4> colours;  ///< of 8 bits, or
    std::vector<glm::vec4> linear;
    std::vector<float> depths;         ///< until views are ranked by them: scene units
    std::vector<std::uint8_t> locked;  ///< 1 = replaces something, must stay
    /// Squared colour difference to the replacement, of pruned pixels.
    std::vector<float> errors;

    [[nodiscard]] bool point(int x, int y) const {
        return points[static_cast<std::size_t>(y) * kept.width() + x];
    }
    [[nodiscard]] const Surfel& surfel(int x, int y) const { return surfels[places.at(x, y)]; }
    /// As Texture::at(), of a place.
    [[nodiscard]] glm::vec3 colour(std::size_t at) const {
        if (!colours.empty()) return glm::vec4(colours[at]) * (1.0f / 255.0f);
        return linear[at];
    }
    /// Of each block of BlockPlaces::kSide, row by row: whether something of it is kept.
    std::vector<std::uint8_t> liveBlocks;
    std::vector<std::uint8_t> emptyBlocks;  ///< the same of `empty`

    /// The depth of the view, of `depths`.
    [[nodiscard]] Image<float> depth() const;
    /// Keeps all of its points, as at the start.
    void keepAll();
    /// After a change of `kept`.
    void findLiveBlocks();
};

/// Pixels of a view from (x0, y0) to before (x1, y1).
struct PruneBlock {
    int x0, y0, x1, y1;
};
/// Partners of a view in whose pictures kept pixels of a block may fall
struct BlockPartners {
    std::vector<int> kept;   ///< on kept pixels, best rank first
    std::vector<int> empty;  ///< on empty ones
};
[[nodiscard]] BlockPartners partnersOfBlock(const std::vector<PruneView>& views,
                                            const PruneView& from, const PruneBlock& block);

/// Where a pixel's surface is found in another view.
struct Replacement {
    bool found = false;
    int x = 0, y = 0;  ///< the upper left of the four pixels around its place
    double error = 0;  ///< squared colour difference, mean over the channels, 0..1
};

/// Prepares a view, without partners, and without room for what is found of its points: keepAll()
/// makes that.
[[nodiscard]] PruneView preparePruning(const ReferenceView& view);

/// Finds the partners of all views, in the order of `rank` (rank[i] = view).
void findPartners(std::vector<PruneView>& views, const std::vector<int>& rank);

/// A pixel that others might replace.
struct PrunePixel {
    PrunePixel(const PruneView& view, int x, int y);

    glm::dvec3 world{0.0};   ///< its point
    glm::dvec3 normal{0.0};  ///< of its surface, towards its view; world, unit
    double rate = 0;         ///< samples per area of its surface
    glm::vec3 colour{0.0f};
};

/// Whether a view sees background where the surface of a pixel is, and a pixel of the view behind
/// it, too: its outline is known to a part of a pixel only, and beside that surfaces are seen edge
/// on. Renderers leave a point out when more views see past it than show it.
[[nodiscard]] bool seesPast(const PruneView& view, const PrunePixel& pixel);

/// Looks for a pixel of `from` in view `to`. A sheet that both see from opposite sides is two
/// surfaces.
[[nodiscard]] Replacement findReplacement(const PruneView& from, const PrunePixel& pixel,
                                          const PruneView& to, const PruneSettings& settings);

}  // namespace stx
