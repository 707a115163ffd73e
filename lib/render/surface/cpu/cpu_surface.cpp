#include "lib/render/surface/cpu/cpu_surface.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "lib/base/cpu_device.hpp"
#include "lib/base/parallel.hpp"
#include "lib/render/surface/backend.hpp"
#include "lib/render/surface/cpu/fuse.hpp"
#include "lib/render/surface/cpu/raster.hpp"
#include "lib/render/surface/cpu/shade.hpp"

namespace stx {
namespace surface {
namespace {

/// Which squares of the tile hold these pixels or a pixel beside them.
Squares squaresOf(const TilePixels& pixels) {
    Squares squares = 0;
    for (std::size_t y = 0; y < kTile; ++y) {
        std::uint32_t row = pixels[y];
        if (y > 0) row |= pixels[y - 1];
        if (y + 1 < kTile) row |= pixels[y + 1];
        row |= row << 1 | row >> 1;
        for (int x = 0; x < 8; ++x)
            if (row >> (x * kSquare) & ((1u << kSquare) - 1))
                squares |= Squares{1} << (static_cast<int>(y) / kSquare * 8 + x);
    }
    return squares;
}

/// Tiles along each side of a group. Blocks are drawn once for a group, not once for each tile that
/// they touch: drawing spot from 16 views takes 0.9 of the time of the processor with two tiles,
/// 0.87 with four, which leave many threads too few groups to share.
constexpr int kGroupTiles = 2;
/// A group of tiles with one sample in the middle of each pixel, and one pixel around it.
constexpr SampleGrid kGroupMiddles{kMiddles.perPixel, kMiddles.apron, kGroupTiles* kTile};

/// Draws groups of tiles, one after another, in memory that is kept from one to the next.
class GroupDrawer {
  public:
    /// Draws the tiles from this one on, to the right and down.
    void draw(const SurfaceFrame& frame, int firstTile, DrawnFrame out) {
        frame_ = &frame;
        firstTile_ = firstTile;
        listTiles();
        if (tiles_.empty()) return;
        listSources();
        if (frame.effort.settle) drawMiddles();
        for (const int tile : tiles_) drawTile(tile, out);
    }

  private:
    /// A source of some tiles of the group.
    struct GroupSource {
        int number;                      ///< in the frame
        std::size_t begin = 0, end = 0;  ///< its blocks in facing_
        bool drawn = false;              ///< something of it shows in the middles of the group
    };

    [[nodiscard]] const FrameSource& sourceAt(int k) const {
        return frame_->sources[static_cast<std::size_t>(k)];
    }
    [[nodiscard]] SampleGrid grid() const { return {frame_->effort.samplesPerPixel}; }

    /// The tiles of the group in which some source may have something.
    void listTiles() {
        tiles_.clear();
        const glm::ivec2 size = frame_->tiles.size;
        const int x0 = firstTile_ % size.x, y0 = firstTile_ / size.x;
        for (int y = y0; y < std::min(y0 + kGroupTiles, size.y); ++y) {
            for (int x = x0; x < std::min(x0 + kGroupTiles, size.x); ++x) {
                const int tile = y * size.x + x;
                if (std::ranges::any_of(frame_->sourcesOf(tile),
                                        [&](int k) { return !sourceAt(k).blocksOf(tile).empty(); }))
                    tiles_.push_back(tile);
            }
        }
    }

    /// The sources of the tiles, and those of their blocks that face the camera, in their order in
    /// the source.
    void listSources() {
        sources_.clear();
        facing_.clear();
        placeOf_.assign(frame_->sources.size(), -1);
        for (const int tile : tiles_) {
            for (const int k : frame_->sourcesOf(tile)) {
                int& place = placeOf_[static_cast<std::size_t>(k)];
                if (place >= 0) continue;
                place = static_cast<int>(sources_.size());
                sources_.push_back({k});
            }
        }
        for (GroupSource& g : sources_) {
            const FrameSource& f = sourceAt(g.number);
            listed_.assign((f.turnedAway.size() + 63) / 64, 0);
            for (const int tile : tiles_) {
                if (std::ranges::find(frame_->sourcesOf(tile), g.number) ==
                    frame_->sourcesOf(tile).end())
                    continue;
                for (const std::uint32_t block : f.blocksOf(tile))
                    if (!f.turnedAway[block]) listed_[block / 64] |= std::uint64_t{1} << block % 64;
            }
            g.begin = facing_.size();
            for (std::size_t word = 0; word < listed_.size(); ++word)
                for (std::uint64_t left = listed_[word]; left; left &= left - 1)
                    facing_.push_back(static_cast<std::uint32_t>(word * 64) +
                                      static_cast<std::uint32_t>(std::countr_zero(left)));
            g.end = facing_.size();
        }
    }

    [[nodiscard]] Warp sampleFromSource(int tile, const SampleGrid& each, int k) const {
        return warpFrom(frame_->sampleFromPixel(tile, each.perPixel, each.apron) *
                        sourceAt(k).pixelFromSource);
    }

    /// Draws the sources into one sample for each pixel of the group.
    void drawMiddles() {
        middles_.resize(std::max(middles_.size(), kGroupMiddles.count() * sources_.size()));
        drawnIn_.assign(facing_.size(), {});
        for (std::size_t i = 0; i < sources_.size(); ++i) {
            GroupSource& g = sources_[i];
            const std::size_t count = g.end - g.begin;
            g.drawn =
                count > 0 &&
                rasteriseSource(*sourceAt(g.number).source,
                                sampleFromSource(firstTile_, kGroupMiddles, g.number),
                                {facing_.data() + g.begin, count}, kGroupMiddles,
                                frame_->space.axis, middles_.data() + kGroupMiddles.count() * i,
                                {kAllSquares, true, {drawnIn_.data() + g.begin, count}});
        }
    }

    void drawTile(int tile, DrawnFrame out) {
        tile_ = tile;
        chosen_ = &frame_->sourcesOf(tile);
        local_.clear();
        shade_.clear();
        for (const int k : *chosen_) {
            const FrameSource& f = sourceAt(k);
            local_.push_back({f.source, f.sourceFromPixel, nullptr, f.pixelFromSource});
            shade_.push_back({f.source, f.sourceFromPixel, f.fromEye});
        }
        makePieces(out.q.width(), out.q.height());
        shadePieces(pieces_, shade_, rayFrom(frame_->space, frame_->space), frame_->effort.shade,
                    colours_, best_);
        addPiecesTo(out);
    }

    /// Gives each source of the tile its samples in the middles of the group.
    void takeMiddles() {
        const int x = frame_->tiles.x(tile_) - frame_->tiles.x(firstTile_);
        const int y = frame_->tiles.y(tile_) - frame_->tiles.y(firstTile_);
        const auto corner = static_cast<std::size_t>(y * kGroupMiddles.stride() + x);
        for (std::size_t k = 0; k < chosen_->size(); ++k) {
            const auto place =
                static_cast<std::size_t>(placeOf_[static_cast<std::size_t>((*chosen_)[k])]);
            local_[k].samples = sources_[place].drawn
                                    ? middles_.data() + kGroupMiddles.count() * place + corner
                                    : nullptr;
        }
    }

    /// Draws each source into all samples of these squares of the tile. Of what the middles showed,
    /// blocks that lie elsewhere are left out.
    void drawSources(Squares squares) {
        const std::size_t room = grid().count();
        samples_.resize(std::max(samples_.size(), room * chosen_->size()));
        const int x = frame_->tiles.x(tile_) - frame_->tiles.x(firstTile_) + kMiddles.apron;
        const int y = frame_->tiles.y(tile_) - frame_->tiles.y(firstTile_) + kMiddles.apron;
        for (std::size_t k = 0; k < chosen_->size(); ++k) {
            const int number = (*chosen_)[k];
            const GroupSource& g =
                sources_[static_cast<std::size_t>(placeOf_[static_cast<std::size_t>(number)])];
            here_.clear();
            for (std::size_t i = g.begin; i < g.end; ++i)
                if (!frame_->effort.settle || drawnIn_[i].squaresOf(x, y) & squares)
                    here_.push_back(facing_[i]);
            float* const mine = samples_.data() + room * k;
            const bool drawn =
                !here_.empty() &&
                rasteriseSource(*sourceAt(number).source, sampleFromSource(tile_, grid(), number),
                                here_, grid(), frame_->space.axis, mine, {squares});
            local_[k].samples = drawn ? mine : nullptr;
        }
    }

    /// Finds the surfaces that each pixel shows. The frame has this size, pixels.
    void makePieces(int width, int height) {
        pieces_.clear();
        const DepthAxis& axis = frame_->space.axis;
        const int tileX = frame_->tiles.x(tile_), tileY = frame_->tiles.y(tile_);
        TilePixels inside = pixelsInFrame(tileX, tileY, width, height);
        if (!frame_->wanted.empty())
            for (std::size_t y = 0; y < kTile; ++y)
                inside[y] &= frame_->wanted[static_cast<std::size_t>(tile_)][y];
        const int core = frame_->tileCore[static_cast<std::size_t>(tile_)];
        if (!frame_->effort.settle) {
            drawSources(kAllSquares);
            fuseTile(local_, grid(), axis, tileX, tileY, inside, pieces_, core);
            return;
        }
        // Where one sample in the middle does not settle a pixel, all of them are drawn.
        takeMiddles();
        const TilePixels open = fuseSettled(local_, kGroupMiddles, axis, tileX, tileY, inside,
                                            frame_->effort.samplesPerPixel, pieces_);
        if (const Squares squares = squaresOf(open)) {
            drawSources(squares);
            fuseTile(local_, grid(), axis, tileX, tileY, open, pieces_, core);
        }
    }

    /// Adds the colours of the pieces, each by its share of the pixel. The depth and the origin of
    /// a pixel are those of its main piece.
    void addPiecesTo(DrawnFrame& out) const {
        const int tileX = frame_->tiles.x(tile_), tileY = frame_->tiles.y(tile_);
        std::array<float, kTile * kTile> mainRank{};
        for (std::size_t i = 0; i < pieces_.size(); ++i) {
            const int x = tileX + pieces_.pixel[i] % kTile, y = tileY + pieces_.pixel[i] / kTile;
            out.colour.at(x, y) += glm::vec4(colours_[i], 1.0f) * pieces_.share[i];
            float& most = mainRank[pieces_.pixel[i]];
            const float dx = pieces_.x[i] - (static_cast<float>(x) + 0.5f);
            const float dy = pieces_.y[i] - (static_cast<float>(y) + 0.5f);
            const float rank = pieces_.share[i] - kOffCentre * (dx * dx + dy * dy);
            if (!(rank > most + kSameRank)) continue;
            most = rank;
            out.q.at(x, y) = pieces_.q[i];
            if (out.origin.empty() || best_[i] < 0) continue;
            const auto k = static_cast<std::size_t>(best_[i]);
            const glm::vec4 h =
                local_[k].sourceFromPixel.homogeneous(pieces_.x[i], pieces_.y[i], pieces_.q[i]);
            out.origin.at(x, y) = {static_cast<float>((*chosen_)[k]), h.x / h.w, h.y / h.w};
        }
    }

    const SurfaceFrame* frame_ = nullptr;
    int firstTile_ = 0;
    std::vector<int> tiles_;  ///< of the group
    std::vector<GroupSource> sources_;
    std::vector<int> placeOf_;           ///< by source of the frame: where it is in sources_, or -1
    std::vector<std::uint64_t> listed_;  ///< by block of a source, a bit each
    std::vector<std::uint32_t> facing_;  ///< blocks that may show, one source after another
    std::vector<DrawnBox> drawnIn_;      ///< where each of them was drawn
    std::vector<float> middles_;         ///< of each source in turn

    int tile_ = 0;
    const std::vector<int>* chosen_ = nullptr;  ///< the tile's sources, the best first
    std::vector<std::uint32_t> here_;           ///< blocks of a source
    std::vector<float> samples_;                ///< of each source in turn
    std::vector<LocalSource> local_;
    std::vector<ShadeSource> shade_;
    Pieces pieces_;
    std::vector<glm::vec3> colours_;  ///< of each piece
    std::vector<std::int8_t> best_;   ///< the source that a piece shows most of, or -1
};

class CpuSurfaceBackend final : public SurfaceBackend {
  public:
    explicit CpuSurfaceBackend(Job& job) : job_(job) {}

    Result<void> prepare(const SurfaceScene&, const Effort&, Job&) override { return {}; }
    Result<void> begin(const SurfaceFrame& frame) override {
        frame_ = &frame;
        return {};
    }
    Result<void> finish(DrawnFrame out) override {
        const int columns = (frame_->tiles.size.x + kGroupTiles - 1) / kGroupTiles;
        const int rows = (frame_->tiles.size.y + kGroupTiles - 1) / kGroupTiles;
        parallelFor(0, static_cast<std::int64_t>(columns) * rows, [&](std::int64_t group) {
            if (job_.cancelled || frame_->sources.empty()) return;
            static thread_local GroupDrawer drawer;
            const int column = static_cast<int>(group) % columns;
            const int row = static_cast<int>(group) / columns;
            drawer.draw(*frame_, kGroupTiles * (row * frame_->tiles.size.x + column), out);
            frame_->sources.front().source->set->settle();
        });
        return {};
    }
    void drop() override {}
    bool drawsAhead() const override { return false; }
    std::string name() const override { return "cpu"; }
    std::string device() const override { return cpuDeviceName(); }

  private:
    Job& job_;
    const SurfaceFrame* frame_ = nullptr;
};

}  // namespace
}  // namespace surface

std::unique_ptr<Renderer> makeCpuSurfaceRenderer(const PageSet& set, const RenderSettings& settings,
                                                 Job& job) {
    // The processor's backend cannot fail before a frame is asked for.
    return std::move(*surface::makeSurfaceRenderer(
        set, settings, job, [&job]() -> Result<std::unique_ptr<surface::SurfaceBackend>> {
            return std::make_unique<surface::CpuSurfaceBackend>(job);
        }));
}

}  // namespace stx
