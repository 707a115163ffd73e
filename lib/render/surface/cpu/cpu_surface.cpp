#include "lib/render/surface/cpu/cpu_surface.hpp"

#include <algorithm>
#include <array>

#include "lib/base/parallel.hpp"
#include "lib/render/cpu_device.hpp"
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
                        if (!job_.cancelled) drawTile(*frame_, static_cast<int>(tile), out);
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

void CpuSurfaceBackend::drawTile(const SurfaceFrame& frame, int tile, DrawnFrame out) {
    if (std::all_of(frame.sources.begin(), frame.sources.end(),
                    [&](const FrameSource& f) { return f.blocksOf(tile).empty(); }))
        return;
    const PixelSpace& space = frame.space;
    const int tileX = frame.tileX(tile), tileY = frame.tileY(tile);
    const SampleGrid grid{frame.effort.samplesPerPixel};
    static thread_local std::vector<float> samples;
    static thread_local Pieces pieces;
    static thread_local std::vector<glm::vec3> colours;
    static thread_local std::vector<std::int8_t> best;
    static thread_local std::vector<LocalSource> local;
    static thread_local std::vector<ShadeSource> shade;
    const std::vector<int> chosen = frame.sourcesOf(tile);
    samples.resize(std::max(samples.size(), grid.count() * chosen.size()));
    local.clear();
    shade.clear();
    const glm::dmat4 sampleFromPixel = frame.sampleFromPixel(tile);
    const float qLimit = frame.qLimit();
    for (std::size_t k = 0; k < chosen.size(); ++k) {
        const FrameSource& f = frame.sources[static_cast<std::size_t>(chosen[k])];
        float* mine = samples.data() + grid.count() * k;
        const auto blocks = f.blocksOf(tile);
        const bool drawn = !blocks.empty() &&
                           rasteriseSource(*f.source, warpFrom(sampleFromPixel * f.pixelFromSource),
                                           blocks, grid, qLimit, mine);
        local.push_back({f.source, f.sourceFromPixel, drawn ? mine : nullptr});
        shade.push_back({f.source, f.sourceFromPixel, f.fromEye});
    }
    pieces.clear();
    fuseTile(local, grid, space.axis, tileX, tileY, std::min(kTile, out.q.width() - tileX),
             std::min(kTile, out.q.height() - tileY), pieces);
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
        set, settings, job, std::make_unique<surface::CpuSurfaceBackend>(job),
        set.behind() ? std::make_unique<surface::CpuSurfaceBackend>(job) : nullptr));
}

}  // namespace stx
