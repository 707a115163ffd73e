#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/render/renderer.hpp"
#include "lib/render/scene/page_set.hpp"
#include "lib/render/surface/cpu/shade.hpp"
#include "lib/render/surface/source.hpp"

namespace stx::surface {

/// What a quality means.
struct Effort {
    int samplesPerPixel = 3;  ///< along one side of a pixel
    int mostGeometry = 8;     ///< sources that one tile is built from, at most 32
    float freeAlpha = kFreeAlpha;
    ShadeSettings shade;
};

/// One source in one frame: its maps, and which of its blocks may show in which tile.
struct FrameSource {
    const Source* source = nullptr;
    Warp sourceFromPixel;
    glm::dmat4 pixelFromSource{1.0};
    Ray fromEye{};
    std::vector<std::uint32_t> tileBegin;  ///< tile t has blocks[tileBegin[t] .. tileBegin[t + 1])
    std::vector<std::uint32_t> blocks;
};

/// A frame to paint: tiles of kTile x kTile pixels, row by row. Not to be moved.
struct FrameWork {
    PixelSpace space;
    std::vector<FrameSource> sources;
    int tilesX = 0, tilesY = 0;
    Effort effort;
    bool wantOrigin = false;
    /// The sources that a tile is built from, at most 32, in order.
    std::function<std::vector<int>(int tile)> chooseSources;

    /// Samples of a tile from pixels of the frame: the tile's corner to the origin, S to the pixel,
    /// the first sample at ½.
    [[nodiscard]] glm::dmat4 sampleFromPixel(int tile) const;
    /// Surfaces with a larger q are behind the camera.
    [[nodiscard]] float qLimit() const;
};

/// What painting gives, before holes are filled. All images have the frame's size and are cleared.
struct PaintedFrame {
    Image<glm::vec4>& colour;  ///< premultiplied
    Image<float>& q;           ///< of the main surface of each pixel, 0 = none
    /// Source (-1 = none) and position in it that the main surface takes its colour from; empty
    /// unless wanted.
    Image<glm::vec3>& origin;
};

/// Something other than the processor that paints the tiles of frames: everything between the
/// prepared sources and the holes.
class TilePainter {
  public:
    virtual ~TilePainter() = default;
    /// Called once, before any frame. The sources outlive the painter.
    [[nodiscard]] virtual Result<void> prepare(std::span<const Source> sources,
                                               const Effort& effort, Job& job) = 0;
    /// Starts a frame; at most two are under way. The work must live until finish() or drop().
    [[nodiscard]] virtual Result<void> begin(const FrameWork& work) = 0;
    /// Completes the frame begun first of those under way, whether or not that succeeds.
    [[nodiscard]] virtual Result<void> finish(PaintedFrame out) = 0;
    /// Gives up the frame begun first of those under way.
    virtual void drop() = 0;
    [[nodiscard]] virtual std::string backend() const = 0;
    [[nodiscard]] virtual std::string device() const = 0;
};

/// Surface mode with a painter of its own: see makeCpuSurfaceRenderer(). Errors: the painter's.
[[nodiscard]] Result<std::unique_ptr<Renderer>> makePaintedSurfaceRenderer(
    const PageSet& set, const RenderSettings& settings, Job& job,
    std::unique_ptr<TilePainter> painter);

}  // namespace stx::surface
