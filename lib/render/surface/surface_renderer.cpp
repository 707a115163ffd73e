#include "lib/render/surface/surface_renderer.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/render/cpu_device.hpp"
#include "lib/render/finish/fill.hpp"
#include "lib/render/surface/backend.hpp"
#include "lib/render/surface/cpu/fuse.hpp"
#include "lib/render/surface/cpu/raster.hpp"
#include "lib/render/surface/cpu/shade.hpp"
#include "lib/render/surface/source.hpp"
#include "lib/surface/depth_gradient.hpp"

namespace stx {
namespace {

using namespace surface;

/// Views that tell less of the object than this have no picture of their own to give back.
constexpr double kWhole = 0.9;
/// Sources that a tile can be built from.
constexpr int kMostGeometry = 32;

Effort effortOf(Quality quality) {
    Effort e;
    switch (quality) {
        case Quality::draft:
            e.samplesPerPixel = 1;
            e.mostGeometry = 4;
            e.shade.mostSources = 2;
            break;
        case Quality::normal:
            break;
        case Quality::best:
            e.samplesPerPixel = 4;
            e.mostGeometry = kMostGeometry;
            break;
    }
    return e;
}

class CpuSurfaceRenderer final : public Renderer {
  public:
    CpuSurfaceRenderer(const PageSet& set, const RenderSettings& settings, Job& job,
                       std::unique_ptr<TilePainter> painter = nullptr)
        : bundle_(copyOf(set)),
          settings_(settings),
          effort_(effortOf(settings.quality)),
          job_(job),
          painter_(std::move(painter)) {
        const Bundle& bundle = bundle_;
        sources_.resize(bundle.views.size());
        parallelFor(0, static_cast<std::int64_t>(sources_.size()), [&](std::int64_t i) {
            sources_[static_cast<std::size_t>(i)] =
                prepareSource(bundle.views[static_cast<std::size_t>(i)]);
        });
        double border = 0, told = 0;
        for (const Source& s : sources_) {
            border += borderCoverage(s) / static_cast<double>(sources_.size());
            told += s.told / static_cast<double>(sources_.size());
            addBounds(s);
        }
        fillsFrame_ = border > 0.5;
        pruned_ = bundle.pruned();
        // Pruned views share the surface among them: each may be the only one left to show a piece
        // of it. Of views with gaps as many are needed as together show what the usual number
        // would.
        if (pruned_) {
            effort_.mostGeometry = kMostGeometry;
            effort_.freeAlpha = kFreeAlphaPruned;
            for (Source& s : sources_) s.freeAlpha = kFreeAlphaPruned;
        } else if (told < 1) {
            effort_.mostGeometry = static_cast<int>(
                std::min<double>(kMostGeometry, std::ceil(effort_.mostGeometry / told)));
        }
        if (settings.wantNormals()) findNormals();
    }

    [[nodiscard]] Result<Frame> render(const Camera& camera) override;
    void expect(const Camera& next) override {
        if (painter_) expected_ = next;
    }
    [[nodiscard]] std::string backend() const override {
        return painter_ ? painter_->backend() : "cpu";
    }
    [[nodiscard]] std::string device() const override {
        return painter_ ? painter_->device() : cpuDeviceName();
    }
    /// Hands the sources to the painter.
    [[nodiscard]] Result<void> preparePainter() {
        return painter_->prepare(sources_, effort_, job_);
    }

  private:
    static Bundle copyOf(const PageSet& set) {
        Bundle b;
        for (std::size_t i = 0; i < set.views().size(); ++i) b.views.push_back(set.copyOfView(i));
        return b;
    }
    void addBounds(const Source& s);
    void findNormals();
    /// Unit world normal of a source at pixel position (u, v); zero where it has none.
    [[nodiscard]] glm::vec3 normalAt(std::size_t source, float u, float v) const;
    [[nodiscard]] FrameSource placeSource(const Source& s, const PixelSpace& space, int tilesX,
                                          int tilesY) const;
    void drawTile(const FrameWork& work, int tile, Frame& frame, Image<float>& q) const;
    /// Everything about a frame that comes before its samples.
    [[nodiscard]] std::unique_ptr<FrameWork> planFrame(const Camera& camera) const;
    /// The plan of a frame; with a painter the frame is under way, perhaps since the last call.
    [[nodiscard]] Result<std::unique_ptr<FrameWork>> beginFrame(const Camera& camera);
    /// Starts the frame that is expected next.
    void beginExpected(const std::optional<Camera>& next);
    [[nodiscard]] Result<void> checkSize(const Camera& camera) const {
        STX_CHECK(camera.check());
        return job_.limits.checkAllocation(static_cast<std::uint64_t>(camera.width) * camera.height,
                                           sizeof(glm::vec4) + 2 * sizeof(float), "the frame");
    }
    [[nodiscard]] Result<void> paintTiles(const FrameWork& work, Frame& frame,
                                          Image<float>& q) const;
    [[nodiscard]] std::vector<int> chooseSources(const PixelSpace& space,
                                                 std::span<const FrameSource> all, int tile,
                                                 int tileX, int tileY) const;
    /// The view that stands exactly where the camera does, -1 = none.
    [[nodiscard]] int viewAt(const Camera& camera) const;
    [[nodiscard]] Frame copyOf(std::size_t index) const;
    void light(const Camera& camera, Frame& frame) const;

    Bundle bundle_;
    RenderSettings settings_;
    Effort effort_;
    Job& job_;
    std::vector<Source> sources_;
    std::vector<Image<glm::vec3>> normals_;  ///< of views that bring none, when frames want them
    Bounds bounds_;
    bool fillsFrame_ = false;
    bool pruned_ = false;  ///< some view is
    std::optional<Camera> expected_;
    std::unique_ptr<FrameWork> begun_;      ///< a frame under way before it was asked for
    std::unique_ptr<TilePainter> painter_;  ///< null = the processor paints
};

void CpuSurfaceRenderer::addBounds(const Source& s) {
    for (int by = 0; by < s.blocksY; ++by) {
        for (int bx = 0; bx < s.blocksX; ++bx) {
            const SourceBlock& block = s.blocks[static_cast<std::size_t>(by) * s.blocksX + bx];
            if (!(block.qMax > 0)) continue;
            for (int corner = 0; corner < 8; ++corner) {
                const double x = std::min((bx + (corner & 1)) * kBlock, s.width);
                const double y = std::min((by + (corner >> 1 & 1)) * kBlock, s.height);
                const double q = (corner & 4) ? block.qMax : block.qMin;
                const glm::dvec4 p = s.space.worldFromPixel * glm::dvec4(x, y, q, 1.0);
                bounds_.add(glm::dvec3(p) / p.w);
            }
        }
    }
}

void CpuSurfaceRenderer::findNormals() {
    normals_.resize(sources_.size());
    parallelFor(0, static_cast<std::int64_t>(sources_.size()), [&](std::int64_t i) {
        const ReferenceView& view = bundle_.views[static_cast<std::size_t>(i)];
        if (view.hasNormals()) return;
        const DepthSurface surface = depthSurface(view, {});
        const glm::dmat3 worldFromCamera = glm::mat3_cast(view.camera.orientation);
        auto& normals = normals_[static_cast<std::size_t>(i)];
        normals = Image<glm::vec3>(view.camera.width, view.camera.height, glm::vec3(0.0f));
        for (int y = 0; y < normals.height(); ++y)
            for (int x = 0; x < normals.width(); ++x)
                if (hasPoint(view.depth.at(x, y)))
                    normals.at(x, y) = glm::vec3(worldFromCamera *
                                                 planeNormal(view.camera, x, y, surface.w.at(x, y),
                                                             surface.gradient.at(x, y)));
    });
}

glm::vec3 CpuSurfaceRenderer::normalAt(std::size_t source, float u, float v) const {
    const ReferenceView& view = bundle_.views[source];
    const Image<glm::vec3>& normals = view.hasNormals() ? view.normal : normals_[source];
    const float fu = std::floor(u - 0.5f), fv = std::floor(v - 0.5f);
    glm::vec3 sum(0.0f);
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
            const int x = static_cast<int>(fu) + i, y = static_cast<int>(fv) + j;
            if (!normals.contains(x, y)) continue;
            const float tu = u - 0.5f - fu, tv = v - 0.5f - fv;
            sum += (i ? tu : 1 - tu) * (j ? tv : 1 - tv) * normals.at(x, y);
        }
    }
    const float length = glm::length(sum);
    return length > 1e-6f ? sum / length : glm::vec3(0.0f);
}

FrameSource CpuSurfaceRenderer::placeSource(const Source& s, const PixelSpace& space, int tilesX,
                                            int tilesY) const {
    FrameSource f;
    f.source = &s;
    f.pixelFromSource = space.pixelFromWorld * s.space.worldFromPixel;
    f.sourceFromPixel = warpFrom(s.space.pixelFromWorld * space.worldFromPixel);
    f.fromEye = rayFrom(s.space, space);
    const Warp warp = warpFrom(f.pixelFromSource);
    struct Range {
        std::uint32_t block;
        int x0, y0, x1, y1;
    };
    std::vector<Range> ranges;
    f.tileBegin.assign(static_cast<std::size_t>(tilesX) * tilesY + 1, 0);
    for (std::uint32_t index = 0; index < s.blocks.size(); ++index) {
        const SourceBlock& block = s.blocks[index];
        if (!(block.qMax > 0)) continue;
        const auto bx = static_cast<float>(index % s.blocksX * kBlock);
        const auto by = static_cast<float>(index / s.blocksX * kBlock);
        const float margin = 0.021f * s.space.axis.whole(block.qMax);
        float x0 = std::numeric_limits<float>::max(), y0 = x0, x1 = -x0, y1 = -x0;
        bool front = false, behind = false;
        for (int corner = 0; corner < 8; ++corner) {
            const float x = (corner & 1) ? bx + kBlock + 1.5f : bx - 0.5f;
            const float y = (corner & 2) ? by + kBlock + 1.5f : by - 0.5f;
            const float q = (corner & 4) ? block.qMax + margin
                                         : std::max(block.qMin - margin, 0.5f * block.qMin);
            const glm::vec4 h = warp.homogeneous(x, y, q);
            if (!(h.w > 0)) {
                behind = true;
                continue;
            }
            front = true;
            x0 = std::min(x0, h.x / h.w);
            x1 = std::max(x1, h.x / h.w);
            y0 = std::min(y0, h.y / h.w);
            y1 = std::max(y1, h.y / h.w);
        }
        if (!front) continue;
        const auto limitX = static_cast<float>(space.camera.width),
                   limitY = static_cast<float>(space.camera.height);
        if (behind) {
            x0 = y0 = 0;
            x1 = limitX;
            y1 = limitY;
        }
        x0 = std::max(x0 - 0.5f, 0.0f);
        y0 = std::max(y0 - 0.5f, 0.0f);
        x1 = std::min(x1 + 0.5f, limitX - 0.5f);
        y1 = std::min(y1 + 0.5f, limitY - 0.5f);
        if (!(x0 <= x1 && y0 <= y1)) continue;
        const Range r{index, static_cast<int>(x0) / kTile, static_cast<int>(y0) / kTile,
                      static_cast<int>(x1) / kTile, static_cast<int>(y1) / kTile};
        ranges.push_back(r);
        for (int ty = r.y0; ty <= r.y1; ++ty)
            for (int tx = r.x0; tx <= r.x1; ++tx)
                ++f.tileBegin[static_cast<std::size_t>(ty * tilesX + tx) + 1];
    }
    for (std::size_t t = 1; t < f.tileBegin.size(); ++t) f.tileBegin[t] += f.tileBegin[t - 1];
    f.blocks.resize(f.tileBegin.back());
    std::vector<std::uint32_t> next(f.tileBegin.begin(), f.tileBegin.end() - 1);
    for (const Range& r : ranges)
        for (int ty = r.y0; ty <= r.y1; ++ty)
            for (int tx = r.x0; tx <= r.x1; ++tx)
                f.blocks[next[static_cast<std::size_t>(ty * tilesX + tx)]++] = r.block;
    return f;
}

std::vector<int> CpuSurfaceRenderer::chooseSources(const PixelSpace& space,
                                                   std::span<const FrameSource> all, int tile,
                                                   int tileX, int tileY) const {
    std::vector<int> chosen;
    const auto count = static_cast<int>(all.size());
    if (count <= effort_.mostGeometry) {
        for (int i = 0; i < count; ++i) chosen.push_back(i);
        return chosen;
    }
    // A point of the scene in the middle of the tile: where the blocks that fall in it are.
    double q = 0;
    int blocks = 0;
    for (const FrameSource& f : all) {
        for (auto k = f.tileBegin[static_cast<std::size_t>(tile)];
             k < f.tileBegin[static_cast<std::size_t>(tile) + 1]; ++k) {
            const std::uint32_t index = f.blocks[k];
            const SourceBlock& block = f.source->blocks[index];
            const glm::dvec4 h =
                f.pixelFromSource * glm::dvec4((index % f.source->blocksX + 0.5) * kBlock,
                                               (index / f.source->blocksX + 0.5) * kBlock,
                                               0.5 * (block.qMin + block.qMax), 1.0);
            if (!(h.w > 0)) continue;
            q += h.z / h.w;
            ++blocks;
        }
    }
    if (!blocks) return chosen;
    const glm::dvec4 h = space.worldFromPixel *
                         glm::dvec4(tileX + kTile * 0.5, tileY + kTile * 0.5, q / blocks, 1.0);
    const glm::dvec3 point = glm::dvec3(h) / h.w;
    const auto towards = [&](const Camera& c) {
        return c.orthographic ? c.forward() : glm::normalize(point - c.position);
    };
    const glm::dvec3 look = towards(space.camera);
    std::vector<std::pair<double, int>> ranked;
    for (int i = 0; i < count; ++i) {
        const FrameSource& f = all[static_cast<std::size_t>(i)];
        // Of many pruned views those come first that have something here.
        const auto t = static_cast<std::size_t>(tile);
        const double idle = pruned_ && f.tileBegin[t] == f.tileBegin[t + 1] ? 2.0 : 0.0;
        ranked.emplace_back(idle - glm::dot(look, towards(f.source->space.camera)), i);
    }
    std::nth_element(ranked.begin(), ranked.begin() + effort_.mostGeometry - 1, ranked.end());
    for (int i = 0; i < effort_.mostGeometry; ++i)
        chosen.push_back(ranked[static_cast<std::size_t>(i)].second);
    std::sort(chosen.begin(), chosen.end());
    return chosen;
}

void CpuSurfaceRenderer::drawTile(const FrameWork& work, int tile, Frame& frame,
                                  Image<float>& qImage) const {
    const PixelSpace& space = work.space;
    const std::span<const FrameSource> all = work.sources;
    const int tileX = tile % work.tilesX * kTile, tileY = tile / work.tilesX * kTile;
    const auto t = static_cast<std::size_t>(tile);
    if (std::all_of(all.begin(), all.end(),
                    [&](const FrameSource& f) { return f.tileBegin[t] == f.tileBegin[t + 1]; }))
        return;
    const SampleGrid grid{effort_.samplesPerPixel};
    static thread_local std::vector<float> samples;
    static thread_local Pieces pieces;
    static thread_local std::vector<glm::vec3> colours;
    static thread_local std::vector<std::int8_t> best;
    static thread_local std::vector<LocalSource> local;
    static thread_local std::vector<ShadeSource> shade;
    const std::vector<int> chosen = work.chooseSources(tile);
    samples.resize(std::max(samples.size(), grid.count() * chosen.size()));
    local.clear();
    shade.clear();
    const glm::dmat4 sampleFromPixel = work.sampleFromPixel(tile);
    const float qLimit = work.qLimit();
    for (std::size_t k = 0; k < chosen.size(); ++k) {
        const FrameSource& f = all[static_cast<std::size_t>(chosen[k])];
        float* mine = samples.data() + grid.count() * k;
        const std::span<const std::uint32_t> blocks(f.blocks.data() + f.tileBegin[t],
                                                    f.tileBegin[t + 1] - f.tileBegin[t]);
        if (!blocks.empty())
            rasteriseSource(*f.source, warpFrom(sampleFromPixel * f.pixelFromSource), blocks, grid,
                            qLimit, mine);
        local.push_back({f.source, f.sourceFromPixel, blocks.empty() ? nullptr : mine});
        shade.push_back({f.source, f.sourceFromPixel, f.fromEye});
    }
    pieces.clear();
    fuseTile(local, grid, space.axis, tileX, tileY, std::min(kTile, frame.colour.width() - tileX),
             std::min(kTile, frame.colour.height() - tileY), pieces);
    shadePieces(pieces, shade, rayFrom(space, space), effort_.shade, colours, best);
    std::array<float, kTile * kTile> mainShare{};
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        const int x = tileX + pieces.pixel[i] % kTile, y = tileY + pieces.pixel[i] / kTile;
        frame.colour.at(x, y) += glm::vec4(colours[i], 1.0f) * pieces.share[i];
        float& most = mainShare[pieces.pixel[i]];
        if (pieces.share[i] > most) {
            most = pieces.share[i];
            qImage.at(x, y) = pieces.q[i];
            if (frame.normal.empty() || best[i] < 0) continue;
            const auto k = static_cast<std::size_t>(best[i]);
            const glm::vec4 h =
                local[k].sourceFromPixel.homogeneous(pieces.x[i], pieces.y[i], pieces.q[i]);
            frame.normal.at(x, y) =
                normalAt(static_cast<std::size_t>(chosen[k]), h.x / h.w, h.y / h.w);
        }
    }
}

Result<void> CpuSurfaceRenderer::paintTiles(const FrameWork& work, Frame& frame,
                                            Image<float>& q) const {
    if (!painter_) {
        parallelFor(0, static_cast<std::int64_t>(work.tilesX) * work.tilesY,
                    [&](std::int64_t tile) {
                        if (!job_.cancelled) drawTile(work, static_cast<int>(tile), frame, q);
                    });
        return {};
    }
    Image<glm::vec3> origin;
    if (work.wantOrigin) origin = Image<glm::vec3>(q.width(), q.height(), glm::vec3(-1, 0, 0));
    STX_CHECK(painter_->finish({frame.colour, q, origin}));
    for (std::size_t i = 0; i < origin.count(); ++i) {
        const glm::vec3 from = origin.data()[i];
        if (from.x >= 0)
            frame.normal.data()[i] = normalAt(static_cast<std::size_t>(from.x), from.y, from.z);
    }
    return {};
}

int CpuSurfaceRenderer::viewAt(const Camera& camera) const {
    const auto near = [](double a, double b) {
        return std::abs(a - b) <= 1e-9 * std::max(1.0, std::abs(a));
    };
    for (std::size_t i = 0; i < bundle_.views.size(); ++i) {
        if (sources_[i].told < (bundle_.views[i].pruned ? 1.0 : kWhole)) continue;
        const Camera& c = bundle_.views[i].camera;
        if (c.width != camera.width || c.height != camera.height ||
            c.orthographic != camera.orthographic)
            continue;
        if (!near(c.fx, camera.fx) || !near(c.fy, camera.fy) || !near(c.cx, camera.cx) ||
            !near(c.cy, camera.cy))
            continue;
        if (glm::length(c.position - camera.position) >
            1e-9 * std::max(1.0, glm::length(c.position)))
            continue;
        if (std::abs(std::abs(glm::dot(c.orientation, camera.orientation)) - 1.0) > 1e-12) continue;
        return static_cast<int>(i);
    }
    return -1;
}

Frame CpuSurfaceRenderer::copyOf(std::size_t index) const {
    const ReferenceView& view = bundle_.views[index];
    Frame frame;
    if (settings_.wantNormals()) frame.normal = view.hasNormals() ? view.normal : normals_[index];
    frame.colour = Image<glm::vec4>(view.camera.width, view.camera.height);
    frame.depth = view.depth;
    for (int y = 0; y < view.camera.height; ++y) {
        for (int x = 0; x < view.camera.width; ++x) {
            const glm::vec4 c = view.texture.at(x, y);
            frame.colour.at(x, y) = glm::vec4(glm::vec3(c) * c.a, c.a);
        }
    }
    return frame;
}

void CpuSurfaceRenderer::light(const Camera& camera, Frame& frame) const {
    const int width = frame.colour.width(), height = frame.colour.height();
    const Lighting lighting = lightsInWorld(settings_.lighting, camera.worldFromCamera());
    const glm::dmat3 worldFromCamera = glm::mat3_cast(camera.orientation);
    parallelForBlocks(0, height, 16, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y) {
            for (int x = 0; x < width; ++x) {
                const float dist = frame.depth.at(x, y);
                glm::vec4& pixel = frame.colour.at(x, y);
                if (!hasPoint(dist) || !(pixel.a > 0.0f)) continue;
                const glm::vec3 toEye(-camera.viewDirection(x + 0.5, y + 0.5));
                glm::vec3& normal = frame.normal.at(x, y);
                // What was filled has no normal of its own.
                if (normal == glm::vec3(0.0f)) normal = toEye;
                const glm::dvec3 world =
                    camera.position + worldFromCamera * camera.unproject(x + 0.5, y + 0.5, dist);
                const glm::vec3 lit = shadePhong(lighting, glm::vec3(pixel) / pixel.a,
                                                 glm::vec3(world), normal, toEye);
                pixel = glm::vec4(lit * pixel.a, pixel.a);
            }
        }
    });
}

std::unique_ptr<FrameWork> CpuSurfaceRenderer::planFrame(const Camera& camera) const {
    double farthest = 1.0;
    if (!bounds_.empty())
        farthest = std::max(
            1e-6 * bounds_.radius(),
            glm::dot(bounds_.centre() - camera.position, camera.forward()) + bounds_.radius());
    auto work = std::make_unique<FrameWork>();
    FrameWork& w = *work;
    w.space = PixelSpace(camera, farthest);
    w.tilesX = (camera.width + kTile - 1) / kTile;
    w.tilesY = (camera.height + kTile - 1) / kTile;
    w.effort = effort_;
    w.wantOrigin = settings_.wantNormals();
    w.sources.resize(sources_.size());
    parallelFor(0, static_cast<std::int64_t>(sources_.size()), [&](std::int64_t i) {
        w.sources[static_cast<std::size_t>(i)] =
            placeSource(sources_[static_cast<std::size_t>(i)], w.space, w.tilesX, w.tilesY);
    });
    w.chooseSources = [this, &w](int tile) {
        return chooseSources(w.space, w.sources, tile, tile % w.tilesX * kTile,
                             tile / w.tilesX * kTile);
    };
    return work;
}

Result<std::unique_ptr<FrameWork>> CpuSurfaceRenderer::beginFrame(const Camera& camera) {
    if (auto begun = std::exchange(begun_, nullptr)) {
        if (begun->space.camera == camera) return begun;
        painter_->drop();
    }
    auto work = planFrame(camera);
    if (painter_) STX_CHECK(painter_->begin(*work));
    return work;
}

void CpuSurfaceRenderer::beginExpected(const std::optional<Camera>& next) {
    if (!next || begun_ || !checkSize(*next) || viewAt(*next) >= 0) return;
    auto work = planFrame(*next);
    // What fails here fails again, and is told, when the frame is asked for.
    if (painter_->begin(*work)) begun_ = std::move(work);
}

Result<Frame> CpuSurfaceRenderer::render(const Camera& camera) {
    const auto next = std::exchange(expected_, std::nullopt);
    STX_CHECK(checkSize(camera));
    const auto start = std::chrono::steady_clock::now();
    Frame frame;
    if (const int same = viewAt(camera); same >= 0) {
        beginExpected(next);
        frame = copyOf(static_cast<std::size_t>(same));
    } else {
        frame.colour = Image<glm::vec4>(camera.width, camera.height, glm::vec4(0.0f));
        Image<float> q(camera.width, camera.height, 0.0f);
        if (settings_.wantNormals())
            frame.normal = Image<glm::vec3>(camera.width, camera.height, glm::vec3(0.0f));
        STX_TRY(const std::unique_ptr<FrameWork> work, beginFrame(camera));
        const PixelSpace& space = work->space;
        beginExpected(next);
        STX_CHECK(paintTiles(*work, frame, q));
        STX_CHECK(job_.checkCancelled());
        if (fillsFrame_ && settings_.fill == Fill::background) {
            fillBackground({frame.colour, q, space});
        } else {
            std::vector<LocalSource> all;
            for (const FrameSource& f : work->sources)
                all.push_back({f.source, f.sourceFromPixel, nullptr});
            fillUnseen({frame.colour, q, space}, all);
        }
        frame.depth = Image<float>(camera.width, camera.height, kNoDepth);
        for (std::size_t i = 0; i < q.count(); ++i)
            if (q.data()[i] > 0.0f)
                frame.depth.data()[i] = static_cast<float>(space.axis.dist(q.data()[i]));
    }
    frame.linear = bundle_.views[0].texture.isLinear();
    if (settings_.wantNormals()) frame.albedo = frame.colour;
    if (settings_.lighting.on()) light(camera, frame);
    frame.milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return frame;
}

}  // namespace

namespace surface {

glm::dmat4 FrameWork::sampleFromPixel(int tile) const {
    const int S = effort.samplesPerPixel;
    glm::dmat4 m(1.0);
    m[0][0] = m[1][1] = S;
    m[3][0] = -(tile % tilesX * kTile) * S - 0.5;
    m[3][1] = -(tile / tilesX * kTile) * S - 0.5;
    return m;
}

float FrameWork::qLimit() const {
    return space.axis.inverse ? std::numeric_limits<float>::max()
                              : static_cast<float>(space.axis.q(0.0));
}

Result<std::unique_ptr<Renderer>> makePaintedSurfaceRenderer(const PageSet& set,
                                                             const RenderSettings& settings,
                                                             Job& job,
                                                             std::unique_ptr<TilePainter> painter) {
    auto renderer = std::make_unique<CpuSurfaceRenderer>(set, settings, job, std::move(painter));
    STX_CHECK(renderer->preparePainter());
    return std::unique_ptr<Renderer>(std::move(renderer));
}

}  // namespace surface

std::unique_ptr<Renderer> makeCpuSurfaceRenderer(const PageSet& set, const RenderSettings& settings,
                                                 Job& job) {
    return std::make_unique<CpuSurfaceRenderer>(set, settings, job);
}

}  // namespace stx
