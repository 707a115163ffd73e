#include "lib/render/surface/cpu/cpu_surface.hpp"

#include <algorithm>
#include <array>

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

/// Draws tiles, one after another, in memory that is kept from one to the next.
class TileDrawer {
  public:
    void draw(const SurfaceFrame& frame, int tile, DrawnFrame out) {
        frame_ = &frame;
        tile_ = tile;
        chosen_ = &frame.sourcesOf(tile);
        if (std::all_of(chosen_->begin(), chosen_->end(),
                        [&](int k) { return sourceAt(k).blocksOf(tile).empty(); }))
            return;
        listSources();
        listBlocks();
        makePieces(out.q.width(), out.q.height());
        shadePieces(pieces_, shade_, rayFrom(frame.space, frame.space), frame.effort.shade,
                    colours_, best_);
        addPiecesTo(out);
    }

  private:
    [[nodiscard]] const FrameSource& sourceAt(int k) const {
        return frame_->sources[static_cast<std::size_t>(k)];
    }
    [[nodiscard]] SampleGrid grid() const { return {frame_->effort.samplesPerPixel}; }

    void listSources() {
        room_ = std::max(grid().count(), kMiddles.count());
        samples_.resize(std::max(samples_.size(), room_ * chosen_->size()));
        local_.clear();
        shade_.clear();
        for (const int k : *chosen_) {
            const FrameSource& f = sourceAt(k);
            local_.push_back({f.source, f.sourceFromPixel, nullptr, f.pixelFromSource});
            shade_.push_back({f.source, f.sourceFromPixel, f.fromEye});
        }
    }

    void listBlocks() {
        facing_.clear();
        facingEnd_.clear();
        drawnIn_.clear();
        for (const int k : *chosen_) {
            const FrameSource& f = sourceAt(k);
            for (const std::uint32_t block : f.blocksOf(tile_))
                if (!f.turnedAway[block]) facing_.push_back(block);
            facingEnd_.push_back(facing_.size());
        }
    }

    /// Draws each source into its samples.
    void drawSources(const SampleGrid& each, const RasterNeeds& needs) {
        const glm::dmat4 sampleFromPixel =
            frame_->sampleFromPixel(tile_, each.perPixel, each.apron);
        std::size_t first = 0;
        for (std::size_t k = 0; k < chosen_->size(); ++k) {
            const FrameSource& f = sourceAt((*chosen_)[k]);
            float* mine = samples_.data() + room_ * k;
            const std::span<const std::uint32_t> blocks{facing_.data() + first,
                                                        facingEnd_[k] - first};
            if (blocks.empty()) continue;
            RasterNeeds own = needs;
            if (each.apron > 0) {
                drawnIn_.resize(facingEnd_[k]);
                own.drawnIn = {drawnIn_.data() + first, blocks.size()};
            } else if (!drawnIn_.empty()) {
                own.of = {drawnIn_.data() + first, blocks.size()};
            }
            first = facingEnd_[k];
            const bool drawn =
                rasteriseSource(*f.source, warpFrom(sampleFromPixel * f.pixelFromSource), blocks,
                                each, frame_->space.axis, mine, own);
            local_[k].samples = drawn ? mine : nullptr;
        }
    }

    /// Finds the surfaces that each pixel shows. The frame has this size, pixels.
    void makePieces(int width, int height) {
        pieces_.clear();
        const DepthAxis& axis = frame_->space.axis;
        const int tileX = frame_->tileX(tile_), tileY = frame_->tileY(tile_);
        const int columns = std::min(kTile, width - tileX), rows = std::min(kTile, height - tileY);
        const int core = frame_->tileCore[static_cast<std::size_t>(tile_)];
        if (!frame_->effort.settle) {
            drawSources(grid(), {});
            fuseTile(local_, grid(), axis, tileX, tileY, columns, rows, pieces_, nullptr, core);
            return;
        }
        // One sample for each pixel is drawn first; where it does not settle the pixel, all of
        // them.
        drawSources(kMiddles, {kAllSquares, true, {}, {}});
        const TilePixels open = fuseSettled(local_, axis, tileX, tileY, columns, rows,
                                            frame_->effort.samplesPerPixel, pieces_);
        if (const Squares squares = squaresOf(open)) {
            drawSources(grid(), {squares, false, {}, {}});
            fuseTile(local_, grid(), axis, tileX, tileY, columns, rows, pieces_, &open, core);
        }
    }

    /// Adds the colours of the pieces, each by its share of the pixel. The depth and the origin of
    /// a pixel are those of its largest piece.
    void addPiecesTo(DrawnFrame& out) const {
        const int tileX = frame_->tileX(tile_), tileY = frame_->tileY(tile_);
        std::array<float, kTile * kTile> mainShare{};
        for (std::size_t i = 0; i < pieces_.size(); ++i) {
            const int x = tileX + pieces_.pixel[i] % kTile, y = tileY + pieces_.pixel[i] / kTile;
            out.colour.at(x, y) += glm::vec4(colours_[i], 1.0f) * pieces_.share[i];
            float& most = mainShare[pieces_.pixel[i]];
            if (!(pieces_.share[i] > most)) continue;
            most = pieces_.share[i];
            out.q.at(x, y) = pieces_.q[i];
            if (out.origin.empty() || best_[i] < 0) continue;
            const auto k = static_cast<std::size_t>(best_[i]);
            const glm::vec4 h =
                local_[k].sourceFromPixel.homogeneous(pieces_.x[i], pieces_.y[i], pieces_.q[i]);
            out.origin.at(x, y) = {static_cast<float>((*chosen_)[k]), h.x / h.w, h.y / h.w};
        }
    }

    const SurfaceFrame* frame_ = nullptr;
    int tile_ = 0;
    const std::vector<int>* chosen_ = nullptr;  ///< the tile's sources, the best first
    std::size_t room_ = 0;                      ///< samples of a source
    std::vector<float> samples_;
    std::vector<LocalSource> local_;
    std::vector<ShadeSource> shade_;
    std::vector<std::uint32_t> facing_;   ///< blocks that may show, one source after another
    std::vector<std::size_t> facingEnd_;  ///< of each source
    std::vector<Squares> drawnIn_;        ///< where each block was drawn
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
        parallelFor(0, static_cast<std::int64_t>(frame_->tilesX) * frame_->tilesY,
                    [&](std::int64_t tile) {
                        if (job_.cancelled || frame_->sources.empty()) return;
                        static thread_local TileDrawer drawer;
                        drawer.draw(*frame_, static_cast<int>(tile), out);
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
