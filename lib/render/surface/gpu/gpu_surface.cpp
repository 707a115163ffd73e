#include "lib/render/surface/gpu/gpu_surface.hpp"

#include <array>
#include <cstring>
#include <deque>

#include "lib/base/parallel.hpp"
#include "lib/render/device/egl_context.hpp"
#include "lib/render/device/growing_buffer.hpp"
#include "lib/render/device/returned_buffer.hpp"
#include "lib/render/surface/backend.hpp"
#include "lib/render/surface/gpu/surface_shaders.hpp"
#include "lib/render/surface/gpu/surface_textures.hpp"
#include "lib/render/surface/prepare/structs.hpp"

namespace stx::gpu {
namespace {

using surface::DrawnFrame;
using surface::FrameEntry;
using surface::FrameSource;
using surface::kNoSlot;
using surface::kShadeGroup;
using surface::kTile;
using surface::SlotEntry;
using surface::Source;
using surface::SourceEntry;
using surface::SurfaceFrame;
using surface::SurfaceScene;
using surface::TileEntry;

constexpr std::int64_t kTilePixels = static_cast<std::int64_t>(kTile) * kTile;
/// Samples of one batch of tiles take at most this much video memory.
constexpr std::int64_t kSampleBytes = 256ll << 20;
constexpr std::int64_t kPieceBytes = sizeof(surface::Piece);
constexpr std::int64_t kMostGroups = 65535;

/// The four rows of a warp.
struct Rows {
    glm::vec4 x, y, q, w;
    explicit Rows(const Warp& warp) { std::memcpy(this, warp.m.data(), sizeof(*this)); }
};
/// The three rows of a ray.
struct RayRows {
    glm::vec4 x, y, z;
    explicit RayRows(const surface::Ray& ray) { std::memcpy(this, ray.data(), sizeof(*this)); }
};

/// A tile that shows something, and how much work it is.
struct TilePlan {
    int tile = 0;
    std::vector<int> sources;
    std::uint32_t slots = 0, meshes = 0, edges = 0;  ///< blocks with cells, with edges
    std::uint32_t firstLocal = 0, firstSlot = 0, firstMesh = 0, firstEdge = 0;  ///< in its batch
};

bool hasCells(const surface::SourceBlock& block) {
    return block.anyCell || block.leafBegin < block.leafEnd;
}

/// What a batch of tiles uploads.
struct Batch {
    std::vector<TileEntry> tiles;
    std::vector<glm::uvec2> locals;
    std::vector<SlotEntry> slots;
    std::vector<glm::uvec4> meshes, edges;  ///< tasks
};

/// Where a batch arrives on its way back.
struct Returned {
    ReturnedBuffer memory;
    std::span<const TilePlan> tiles;  ///< that it holds and nobody has taken
};

/// Everything that lives in the context; destroyed while it is current.
struct Resources {
    GpuSurfaceScene scene;
    GlProgram mesh, extensions, fuse, shade, resolve, resolveWithOrigin;
    GlBuffer uniforms;
    GrowingBuffer sources, slots, meshes, edges, tiles, locals;
    GrowingBuffer samples, pieces, ranges, counts, pieceColours, colour, depth, origin;
    std::array<Returned, 2> returned;
};

/// A frame under way: its first batch is being drawn.
struct Begun {
    const SurfaceFrame* work = nullptr;
    std::vector<TilePlan> plans;
    std::size_t drawn = 0;  ///< tiles so far
    Returned* back = nullptr;
};

class GpuSurfaceBackend final : public surface::SurfaceBackend {
  public:
    explicit GpuSurfaceBackend(std::shared_ptr<EglContext> context)
        : context_(std::move(context)) {}
    ~GpuSurfaceBackend() override { destroyIn(*context_, resources_); }

    Result<void> prepare(const SurfaceScene& scene, const surface::Effort& effort,
                         Job& job) override;
    Result<void> begin(const SurfaceFrame& work) override;
    Result<void> finish(DrawnFrame out) override;
    void drop() override;
    bool drawsAhead() const override { return true; }
    std::string name() const override { return "gpu"; }
    std::string device() const override { return context_->device().name; }

  private:
    [[nodiscard]] Result<GlProgram> build(SurfaceProgram program) const;
    [[nodiscard]] std::vector<TilePlan> planTiles(const SurfaceFrame& work) const;
    [[nodiscard]] std::size_t batchEnd(std::span<TilePlan> plans, std::size_t begin) const;
    /// Of the samples of a batch.
    [[nodiscard]] std::int64_t sampleBytes(const Batch& batch) const {
        return static_cast<std::int64_t>(batch.slots.size()) * kTilePixels * perPixel_ * perPixel_ *
               4;
    }
    [[nodiscard]] Batch fillBatch(const SurfaceFrame& work, std::span<const TilePlan> plans) const;
    void uploadSources(const SurfaceFrame& work);
    Result<void> drawNext(Begun& frame, Returned& back);
    Result<void> draw(const SurfaceFrame& work, std::span<const TilePlan> plans, Returned& back);
    Result<void> upload(const SurfaceFrame& work, const Batch& batch, std::int64_t pixels,
                        Returned& back);
    void bind(const SurfaceFrame& work, const Batch& batch);
    void dispatch(const SurfaceFrame& work, const Batch& batch, std::int64_t pixels);
    Result<void> collect(const SurfaceFrame& work, Returned& back, DrawnFrame out) const;

    std::shared_ptr<EglContext> context_;
    int perPixel_ = 1, mostSources_ = 4;
    int answers_ = 1;  ///< 2: pixels are the mean of what all sources and of what the first show
    float freeLevel_ = surface::kFreeLevel;
    std::int64_t mostSlots_ = 0, mostTiles_ = 0;  ///< of a batch
    std::unique_ptr<Resources> resources_;
    std::deque<Begun> begun_;
};

Result<GlProgram> GpuSurfaceBackend::build(SurfaceProgram program) const {
    const std::array<ShaderStage, 1> stages{surfaceStage(program)};
    return buildProgram(surfaceHeader({perPixel_, mostSources_, freeLevel_}, program), stages);
}

Result<void> GpuSurfaceBackend::prepare(const SurfaceScene& scene, const surface::Effort& effort,
                                        Job& job) {
    STX_TRY(auto current, context_->makeCurrent());
    resources_ = std::make_unique<Resources>();
    Resources& r = *resources_;
    perPixel_ = effort.samplesPerPixel;
    mostSources_ = effort.shade.mostSources;
    freeLevel_ = effort.freeLevel;
    answers_ = effort.moreGeometry > 0 && effort.mean ? 2 : 1;
    const std::int64_t storage = context_->abilities().maxStorageBytes;
    const std::int64_t perTile = kTilePixels * perPixel_ * perPixel_;
    mostSlots_ = std::min(storage, kSampleBytes) / (perTile * 4);
    mostTiles_ = std::min({storage / (answers_ * perTile * kPieceBytes),
                           kMostGroups * kShadeGroup / (answers_ * perTile),
                           kMostGroups * kShadeGroup / kTilePixels});
    STX_TRY(r.scene, GpuSurfaceScene::upload(scene, *context_, job));
    STX_TRY(r.mesh, build(SurfaceProgram::mesh));
    STX_TRY(r.extensions, build(SurfaceProgram::extensions));
    STX_TRY(r.fuse, build(SurfaceProgram::fuse));
    STX_TRY(r.shade, build(SurfaceProgram::shade));
    STX_TRY(r.resolve, build(SurfaceProgram::resolve));
    STX_TRY(r.resolveWithOrigin, build(SurfaceProgram::resolveWithOrigin));
    r.uniforms = GlBuffer::create();
    glNamedBufferStorage(r.uniforms.get(), sizeof(FrameEntry), nullptr, GL_DYNAMIC_STORAGE_BIT);
    return context_->check("preparing the renderer");
}

std::vector<TilePlan> GpuSurfaceBackend::planTiles(const SurfaceFrame& work) const {
    std::vector<TilePlan> plans(static_cast<std::size_t>(work.tiles.count()));
    parallelFor(0, static_cast<std::int64_t>(plans.size()), [&](std::int64_t i) {
        TilePlan& plan = plans[static_cast<std::size_t>(i)];
        plan.tile = static_cast<int>(i);
        plan.sources = work.sourcesOf(plan.tile);
        for (const int k : plan.sources) {
            const FrameSource& f = work.sources[static_cast<std::size_t>(k)];
            const auto blocks = f.blocksOf(plan.tile);
            plan.slots += !blocks.empty();
            for (const std::uint32_t b : blocks) {
                const surface::SourceBlock& block = f.source->blocks[b];
                plan.meshes += hasCells(block);
                plan.edges += block.anyEdge;
            }
        }
    });
    std::erase_if(plans, [](const TilePlan& plan) { return plan.slots == 0; });
    return plans;
}

/// The end of the batch that begins at a tile; sets where the parts of its tiles begin.
std::size_t GpuSurfaceBackend::batchEnd(std::span<TilePlan> plans, std::size_t begin) const {
    std::uint32_t locals = 0, slots = 0, meshes = 0, edges = 0;
    std::size_t end = begin;
    for (; end < plans.size() && static_cast<std::int64_t>(end - begin) < mostTiles_; ++end) {
        TilePlan& plan = plans[end];
        if (end > begin && slots + plan.slots > mostSlots_) break;
        plan.firstLocal = locals;
        plan.firstSlot = slots;
        plan.firstMesh = meshes;
        plan.firstEdge = edges;
        locals += static_cast<std::uint32_t>(plan.sources.size());
        slots += plan.slots;
        meshes += plan.meshes;
        edges += plan.edges;
    }
    return end;
}

Batch GpuSurfaceBackend::fillBatch(const SurfaceFrame& work,
                                   std::span<const TilePlan> plans) const {
    const TilePlan& last = plans.back();
    Batch batch;
    batch.tiles.resize(plans.size());
    batch.locals.resize(last.firstLocal + last.sources.size());
    batch.slots.resize(last.firstSlot + last.slots);
    batch.meshes.resize(last.firstMesh + last.meshes);
    batch.edges.resize(last.firstEdge + last.edges);
    parallelFor(0, static_cast<std::int64_t>(plans.size()), [&](std::int64_t i) {
        const TilePlan& plan = plans[static_cast<std::size_t>(i)];
        const glm::dmat4 sampleFromPixel =
            work.sampleFromPixel(plan.tile, work.effort.samplesPerPixel);
        std::uint32_t local = plan.firstLocal, slot = plan.firstSlot;
        std::uint32_t mesh = plan.firstMesh, edge = plan.firstEdge;
        float step = 0;
        for (const int k : plan.sources) {
            const FrameSource& f = work.sources[static_cast<std::size_t>(k)];
            step = std::max(step, f.source->step);
            const auto blocks = f.blocksOf(plan.tile);
            const bool any = !blocks.empty();
            batch.locals[local++] = {static_cast<std::uint32_t>(k), any ? slot : kNoSlot};
            if (!any) continue;
            const Rows warp(warpFrom(sampleFromPixel * f.pixelFromSource));
            batch.slots[slot] = {warp.x, warp.y, warp.q, warp.w, glm::ivec4(k, 0, 0, 0)};
            const std::uint32_t firstLeaf = resources_->scene.firstLeaf[f.source->number];
            for (const std::uint32_t b : blocks) {
                const surface::SourceBlock& block = f.source->blocks[b];
                const glm::uvec4 task(slot, b, firstLeaf + block.leafBegin, 0);
                if (hasCells(block)) batch.meshes[mesh++] = task;
                if (block.anyEdge) batch.edges[edge++] = task;
            }
            ++slot;
        }
        batch.tiles[static_cast<std::size_t>(i)] = {
            work.tiles.x(plan.tile),
            work.tiles.y(plan.tile),
            plan.firstLocal,
            static_cast<std::uint32_t>(plan.sources.size()),
            step,
            static_cast<std::uint32_t>(work.tileCore[static_cast<std::size_t>(plan.tile)]),
            0,
            0};
    });
    return batch;
}

void GpuSurfaceBackend::uploadSources(const SurfaceFrame& work) {
    std::vector<SourceEntry> entries;
    for (const FrameSource& f : work.sources) {
        const Source& s = *f.source;
        const DepthAxis& axis = s.space.axis;
        const Rows warp(f.sourceFromPixel);
        const RayRows ray(f.fromEye);
        entries.push_back({warp.x,
                           warp.y,
                           warp.q,
                           warp.w,
                           ray.x,
                           ray.y,
                           ray.z,
                           glm::ivec4(s.width, s.height, s.hasAlpha ? 1 : 0, s.blocksX),
                           glm::vec4(axis.inverse ? 1.0f : 0.0f, 1.0f / axis.unit, s.step,
                                     surface::kClearlyBehind + s.noise),
                           resources_->scene.places[s.number],
                           glm::vec4(s.beside, axis.nearest(), axis.coarse, axis.pixel),
                           {f.pixelFromSource[0], f.pixelFromSource[1], f.pixelFromSource[2]}});
    }
    resources_->sources.upload(entries);
}

/// Brings what is drawn of `batch` to the device, and makes room for the answers of `pixels`.
Result<void> GpuSurfaceBackend::upload(const SurfaceFrame& work, const Batch& batch,
                                       std::int64_t pixels, Returned& back) {
    Resources& r = *resources_;
    uploadSources(work);
    r.slots.upload(batch.slots);
    r.meshes.upload(batch.meshes);
    r.edges.upload(batch.edges);
    r.tiles.upload(batch.tiles);
    r.locals.upload(batch.locals);
    const std::int64_t most = pixels * perPixel_ * perPixel_ * answers_;
    r.samples.reserve(sampleBytes(batch));
    r.pieces.reserve(most * kPieceBytes);
    r.pieceColours.reserve(most * 16);
    r.ranges.reserve(pixels * 16);
    r.colour.reserve(pixels * 16);
    r.depth.reserve(pixels * 4);
    if (work.wantOrigin) r.origin.reserve(pixels * 16);
    r.counts.upload(std::vector<std::uint32_t>{0, 1, 1, 0});
    back.memory.reserve(pixels * (work.wantOrigin ? 36 : 20));
    STX_CHECK(context_->check("making the frame's buffers"));
    if (!back.memory.memory)
        return fail(ErrorCode::failed, "'{}' gives no memory to read the frame back through",
                    context_->device().name);
    return {};
}

/// Sets the uniforms, empties the samples and binds what the shaders read and write.
void GpuSurfaceBackend::bind(const SurfaceFrame& work, const Batch& batch) {
    Resources& r = *resources_;
    const DepthAxis& axis = work.space.axis;
    const bool bytes = !work.sources[0].source->set->linear();
    const surface::ShadeSettings& shade = work.effort.shade;
    const RayRows eye(surface::rayFrom(work.space, work.space));
    const FrameEntry uniforms{
        glm::vec4(axis.inverse ? 1.0f : 0.0f, 1.0f / axis.unit, work.qLimit(), 0.0f),
        eye.x,
        eye.y,
        eye.z,
        glm::vec4(shade.kernel, shade.ridge, bytes ? 1.0f : 0.0f, shade.edgeWeight),
        glm::ivec4(work.space.camera.width, work.space.camera.height, batch.meshes.size(),
                   batch.edges.size())};
    glNamedBufferSubData(r.uniforms.get(), 0, sizeof(uniforms), &uniforms);
    const std::uint32_t zero = 0;
    glClearNamedBufferSubData(r.samples.buffer.get(), GL_R32UI, 0, sampleBytes(batch),
                              GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);

    glBindTextureUnit(0, r.scene.surfaces.get());
    glBindTextureUnit(1, r.scene.colours.get());
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, r.uniforms.get());
    const std::array<GLuint, 15> storage{
        r.sources.buffer.get(), r.slots.buffer.get(),        r.meshes.buffer.get(),
        r.scene.leaves.get(),   r.samples.buffer.get(),      r.tiles.buffer.get(),
        r.locals.buffer.get(),  r.pieces.buffer.get(),       r.ranges.buffer.get(),
        r.counts.buffer.get(),  r.pieceColours.buffer.get(), r.colour.buffer.get(),
        r.depth.buffer.get(),   r.origin.buffer.get(),       r.scene.table.get()};
    for (GLuint i = 0; i < storage.size(); ++i)
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, i, storage[i]);
}

/// Runs the shaders: samples, fused pieces, their colours, pixels.
void GpuSurfaceBackend::dispatch(const SurfaceFrame& work, const Batch& batch,
                                 std::int64_t pixels) {
    Resources& r = *resources_;
    const auto rasterise = [&](const GlProgram& program, const GrowingBuffer& tasks,
                               std::size_t count) {
        if (count == 0) return;
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, tasks.buffer.get());
        glUseProgram(program.get());
        // A dispatch has at most 65535 groups a side; the shader counts in rows of 32768.
        glDispatchCompute(static_cast<GLuint>(std::min<std::size_t>(count, 32768)),
                          static_cast<GLuint>((count + 32767) / 32768), 1);
    };
    rasterise(r.mesh, r.meshes, batch.meshes.size());
    rasterise(r.extensions, r.edges, batch.edges.size());
    glUseProgram(r.fuse.get());
    for (int core = 0; core < answers_; ++core) {
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
        glUniform1i(kFuseCore, core);
        glDispatchCompute(static_cast<GLuint>(pixels / 256), 1, 1);
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
    glUseProgram(r.shade.get());
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, r.counts.buffer.get());
    glDispatchComputeIndirect(0);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    glUseProgram(work.wantOrigin ? r.resolveWithOrigin.get() : r.resolve.get());
    glDispatchCompute(static_cast<GLuint>(pixels / kShadeGroup), 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
}

Result<void> GpuSurfaceBackend::draw(const SurfaceFrame& work, std::span<const TilePlan> plans,
                                     Returned& back) {
    const Batch batch = fillBatch(work, plans);
    const std::int64_t pixels = static_cast<std::int64_t>(plans.size()) * kTilePixels;
    for (Returned& r : resources_->returned) STX_CHECK(r.memory.wait(*context_));
    STX_CHECK(upload(work, batch, pixels, back));
    bind(work, batch);
    dispatch(work, batch, pixels);
    const Resources& r = *resources_;
    const auto fetch = [&](const GrowingBuffer& from, std::int64_t at, std::int64_t each) {
        glCopyNamedBufferSubData(from.buffer.get(), back.memory.buffer.get(), 0, at * pixels,
                                 each * pixels);
    };
    fetch(r.colour, 0, 16);
    fetch(r.depth, 16, 4);
    if (work.wantOrigin) fetch(r.origin, 20, 16);
    back.memory.fence();
    back.tiles = plans;
    return context_->check("drawing");
}

Result<void> GpuSurfaceBackend::collect(const SurfaceFrame& work, Returned& back,
                                        DrawnFrame out) const {
    if (back.tiles.empty()) return {};
    STX_CHECK(back.memory.wait(*context_));
    const std::byte* memory = back.memory.memory;
    const std::int64_t pixels = static_cast<std::int64_t>(back.tiles.size()) * kTilePixels;
    const auto* colour = reinterpret_cast<const glm::vec4*>(memory);
    const auto* depth = reinterpret_cast<const float*>(memory + 16 * pixels);
    const auto* origin = reinterpret_cast<const glm::vec4*>(memory + 20 * pixels);
    parallelFor(0, static_cast<std::int64_t>(back.tiles.size()), [&](std::int64_t i) {
        const int tile = back.tiles[static_cast<std::size_t>(i)].tile;
        const int tileX = work.tiles.x(tile), tileY = work.tiles.y(tile);
        const int x0 = std::max(tileX, 0), columns = std::min(tileX + kTile, out.q.width()) - x0;
        for (int y = std::max(tileY, 0); y < std::min(tileY + kTile, out.q.height()); ++y) {
            const std::int64_t from =
                i * kTilePixels + static_cast<std::int64_t>(y - tileY) * kTile + x0 - tileX;
            std::copy_n(colour + from, columns, out.colour.row(y).data() + x0);
            std::copy_n(depth + from, columns, out.q.row(y).data() + x0);
            if (!work.wantOrigin) continue;
            for (int x = 0; x < columns; ++x)
                out.origin.at(x0 + x, y) = glm::vec3(origin[from + x]);
        }
    });
    back.tiles = {};
    return {};
}

/// Draws the next batch of a frame into `back`.
Result<void> GpuSurfaceBackend::drawNext(Begun& frame, Returned& back) {
    const std::size_t end = batchEnd(frame.plans, frame.drawn);
    const auto plans = std::span<const TilePlan>(frame.plans);
    STX_CHECK(draw(*frame.work, plans.subspan(frame.drawn, end - frame.drawn), back));
    frame.drawn = end;
    return {};
}

Result<void> GpuSurfaceBackend::begin(const SurfaceFrame& work) {
    Begun frame;
    frame.work = &work;
    frame.plans = planTiles(work);
    if (!frame.plans.empty()) {
        STX_TRY(auto current, context_->makeCurrent());
        auto& returned = resources_->returned;
        const bool taken = !begun_.empty() && begun_.front().back == &returned[0];
        frame.back = &returned[taken ? 1 : 0];
        STX_CHECK(drawNext(frame, *frame.back));
    }
    begun_.push_back(std::move(frame));
    return {};
}

Result<void> GpuSurfaceBackend::finish(DrawnFrame out) {
    Begun frame = std::move(begun_.front());
    begun_.pop_front();
    if (frame.plans.empty()) return {};
    STX_TRY(auto current, context_->makeCurrent());
    // While no other frame is under way, one batch is drawn while the one before it arrives.
    auto& returned = resources_->returned;
    Returned* other = &returned[frame.back == &returned[0] ? 1 : 0];
    if (!begun_.empty()) other = nullptr;
    while (frame.drawn < frame.plans.size()) {
        if (other) {
            STX_CHECK(drawNext(frame, *other));
            STX_CHECK(collect(*frame.work, *frame.back, out));
            std::swap(frame.back, other);
        } else {
            STX_CHECK(collect(*frame.work, *frame.back, out));
            STX_CHECK(drawNext(frame, *frame.back));
        }
    }
    return collect(*frame.work, *frame.back, out);
}

void GpuSurfaceBackend::drop() {
    const Begun frame = std::move(begun_.front());
    begun_.pop_front();
    if (frame.back) frame.back->tiles = {};
}

}  // namespace

Result<std::unique_ptr<Renderer>> makeGpuSurfaceRenderer(const PageSet& set,
                                                         const RenderSettings& settings, int device,
                                                         Job& job) {
    const auto backend = [&]() -> Result<std::unique_ptr<surface::SurfaceBackend>> {
        STX_TRY(auto context, EglContext::create(device, EglContext::Profile::core));
        STX_CHECK(
            context->requireModern("surface mode on the GPU", "--mode splat or --backend cpu"));
        return std::make_unique<GpuSurfaceBackend>(std::move(context));
    };
    return surface::makeSurfaceRenderer(set, settings, job, backend);
}

}  // namespace stx::gpu
