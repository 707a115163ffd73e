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
                        drawTile(*frame_, static_cast<int>(tile), out);
                        frame_->sources.front().source->set->settle();
                    });
        return {};
    }
    void drop() override {}
    bool drawsAhead() const override { return false; }
    std::string name() const override { return "cpu"; }
    std::string device() const override { return cpuDeviceName(); }

  private:
    static void drawTile(const SurfaceFrame& frame, int tile, DrawnFrame out);

    Job& job_;
    const SurfaceFrame* frame_ = nullptr;
};

/// The squares that those pixels and the pixels beside them are in.
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

void CpuSurfaceBackend::drawTile(const SurfaceFrame& frame, int tile, DrawnFrame out) {
    const std::vector<int>& chosen = frame.sourcesOf(tile);
    if (std::all_of(chosen.begin(), chosen.end(), [&](int k) {
            return frame.sources[static_cast<std::size_t>(k)].blocksOf(tile).empty();
        }))
        return;
    const PixelSpace& space = frame.space;
    const int tileX = frame.tileX(tile), tileY = frame.tileY(tile);
    const int columns = std::min(kTile, out.q.width() - tileX);
    const int rows = std::min(kTile, out.q.height() - tileY);
    const int perPixel = frame.effort.samplesPerPixel;
    const SampleGrid grid{perPixel};
    static thread_local std::vector<float> samples;
    static thread_local Pieces pieces;
    static thread_local std::vector<glm::vec3> colours;
    static thread_local std::vector<std::int8_t> best;
    static thread_local std::vector<LocalSource> local;
    static thread_local std::vector<ShadeSource> shade;
    const std::size_t room = std::max(grid.count(), kMiddles.count());
    samples.resize(std::max(samples.size(), room * chosen.size()));
    local.clear();
    shade.clear();
    for (const int k : chosen) {
        const FrameSource& f = frame.sources[static_cast<std::size_t>(k)];
        local.push_back({f.source, f.sourceFromPixel, nullptr, f.pixelFromSource});
        shade.push_back({f.source, f.sourceFromPixel, f.fromEye});
    }
    // The blocks of each source that may show, one source after another, and where each is drawn.
    static thread_local std::vector<std::uint32_t> facing;
    static thread_local std::vector<std::size_t> facingEnd;
    static thread_local std::vector<Squares> drawnIn;
    facing.clear();
    facingEnd.clear();
    drawnIn.clear();
    for (const int k : chosen) {
        const FrameSource& f = frame.sources[static_cast<std::size_t>(k)];
        for (const std::uint32_t block : f.blocksOf(tile))
            if (!f.turnedAway[block]) facing.push_back(block);
        facingEnd.push_back(facing.size());
    }
    const auto drawAll = [&](const SampleGrid& each, const RasterNeeds& needs) {
        const glm::dmat4 sampleFromPixel = frame.sampleFromPixel(tile, each.perPixel, each.apron);
        std::size_t first = 0;
        for (std::size_t k = 0; k < chosen.size(); ++k) {
            const FrameSource& f = frame.sources[static_cast<std::size_t>(chosen[k])];
            float* mine = samples.data() + room * k;
            const std::span<const std::uint32_t> blocks{facing.data() + first,
                                                        facingEnd[k] - first};
            if (blocks.empty()) continue;
            RasterNeeds own = needs;
            if (each.apron > 0) {
                drawnIn.resize(facingEnd[k]);
                own.drawnIn = {drawnIn.data() + first, blocks.size()};
            } else if (!drawnIn.empty()) {
                own.of = {drawnIn.data() + first, blocks.size()};
            }
            first = facingEnd[k];
            const bool drawn =
                rasteriseSource(*f.source, warpFrom(sampleFromPixel * f.pixelFromSource), blocks,
                                each, space.axis, mine, own);
            local[k].samples = drawn ? mine : nullptr;
        }
    };
    pieces.clear();
    const int core = frame.tileCore[static_cast<std::size_t>(tile)];
    if (!frame.effort.settle) {
        drawAll(grid, {});
        fuseTile(local, grid, space.axis, tileX, tileY, columns, rows, pieces, nullptr, core);
    } else {
        // First one sample for each pixel; all of them only where that does not tell.
        drawAll(kMiddles, {kAllSquares, true, {}, {}});
        const TilePixels open =
            fuseSettled(local, space.axis, tileX, tileY, columns, rows, perPixel, pieces);
        if (const Squares squares = squaresOf(open)) {
            drawAll(grid, {squares, false, {}, {}});
            fuseTile(local, grid, space.axis, tileX, tileY, columns, rows, pieces, &open, core);
        }
    }
    shadePieces(pieces, shade, rayFrom(space, space), frame.effort.shade, colours, best);
    std::array<float, kTile * kTile> mainShare{};
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        const int x = tileX + pieces.pixel[i] % kTile, y = tileY + pieces.pixel[i] / kTile;
        out.colour.at(x, y) += glm::vec4(colours[i], 1.0f) * pieces.share[i];
        float& most = mainShare[pieces.pixel[i]];
        if (!(pieces.share[i] > most)) continue;
        most = pieces.share[i];
        out.q.at(x, y) = pieces.q[i];
        if (out.origin.empty() || best[i] < 0) continue;
        const auto k = static_cast<std::size_t>(best[i]);
        const glm::vec4 h =
            local[k].sourceFromPixel.homogeneous(pieces.x[i], pieces.y[i], pieces.q[i]);
        out.origin.at(x, y) = {static_cast<float>(chosen[k]), h.x / h.w, h.y / h.w};
    }
}

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
