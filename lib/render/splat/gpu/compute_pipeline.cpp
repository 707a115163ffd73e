#include <array>

#include "lib/render/device/gl_object.hpp"
#include "lib/render/device/growing_buffer.hpp"
#include "lib/render/device/returned_buffer.hpp"
#include "lib/render/splat/gpu/splat_pipeline.hpp"

namespace stx::gpu {
namespace {

/// Splats by atomics: the front distance of each pixel, then sums of what lies near it.
class ComputeSplats final : public SplatPipeline {
  public:
    ComputeSplats(const EglContext& context, const GpuScene& scene, const RenderSettings& settings)
        : context_(context), scene_(scene), programs_(false, scene, settings) {
        SplatVariant& variant = programs_.variant;
        // Round splats of the paper's rule may reach beyond what the plan says of a block.
        variant.cull = settings.does(Stage::cull) && settings.splat != SplatRule::paper;
        const auto& able = context.abilities();
        // Linear colours need a float's range; 8-bit ones sum exactly in integers, two to a 64-bit
        // atomic where there is one.
        if (scene.linear && able.atomicFloat)
            variant.sums = Sums::floats;
        else if (able.atomicInt64)
            variant.sums = Sums::pairs;
    }

    Result<void> prepare(Job& job);
    Result<void> draw(SplatFrame& frame, int slot) override;
    Result<SplatPlanes> map(int slot) override;
    void unmap(int) override {}
    int margin() const override { return 0; }
    int largestPiece() const override;
    SplatCounts counts() override;

  private:
    [[nodiscard]] int channels() const {
        const int n = 4 + (variant_.translucent ? 1 : 0) + (variant_.normals ? 3 : 0);
        return variant_.sums == Sums::pairs ? (n + 1) / 2 * 2 : n;
    }
    [[nodiscard]] std::int64_t bytesEach() const { return variant_.normals ? 48 : 20; }
    void bind(const SplatFrame& frame);
    void setDraw(int firstTask, int tasks, FrameUniforms& uniforms) const;
    Result<void> drawTasks(int pass, SplatFrame& frame);
    Result<void> cull(SplatFrame& frame);
    Result<void> resolve(SplatFrame& frame, int slot);

    const EglContext& context_;
    const GpuScene& scene_;
    SplatPrograms programs_;
    const SplatVariant& variant_ = programs_.variant;
    GlBuffer uniforms_;
    GrowingBuffer views_, tasks_, lights_, front_, sums_, visible_, tiles_;
    GrowingBuffer colour_, depth_, normal_, albedo_;
    struct Slot {
        ReturnedBuffer back;
        std::int64_t pixels = 0;
    };
    std::array<Slot, 2> slots_;
    int lastTasks_ = 0;
};

Result<void> ComputeSplats::prepare(Job& job) {
    uniforms_ = GlBuffer::create();
    glNamedBufferStorage(uniforms_.get(), sizeof(FrameUniforms), nullptr, GL_DYNAMIC_STORAGE_BIT);
    if (auto built = programs_.build(); !built) {
        if (variant_.sums == Sums::integers) return built;
        // A driver that names the extension and then does not take it.
        job.note(fmt::format(
            "'{}' does not compile its {} atomics; sums are added in integers of "
            "32 bits, which is slower",
            context_.device().name, variant_.sums == Sums::floats ? "float" : "64-bit"));
        programs_.variant.sums = Sums::integers;
        programs_.clear();
        STX_CHECK(programs_.build());
    }
    return context_.check("preparing the renderer");
}

int ComputeSplats::largestPiece() const {
    // What one storage block takes bounds a piece, too.
    int piece = std::min(kLargestPiece, context_.abilities().maxTextureSize);
    const std::int64_t perPixel = std::max(16, 4 * channels());
    while (piece > 256 &&
           (piece + 2ll) * (piece + 2) * perPixel > context_.abilities().maxStorageBytes)
        piece /= 2;
    return piece;
}

void ComputeSplats::bind(const SplatFrame& frame) {
    views_.upload(frame.views);
    tasks_.upload(frame.tasks);
    lights_.upload(frame.lights);
    glBindTextureUnit(0, scene_.colour.get());
    glBindTextureUnit(1, scene_.depth.get());
    glBindTextureUnit(2, scene_.normal.get());
    glBindTextureUnit(3, scene_.slope.get());
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, uniforms_.get());
    const std::array<std::pair<GLuint, GLuint>, 5> storage{{{0, views_.buffer.get()},
                                                            {1, tasks_.buffer.get()},
                                                            {3, front_.buffer.get()},
                                                            {4, sums_.buffer.get()},
                                                            {5, lights_.buffer.get()}}};
    for (const auto& [at, name] : storage) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, at, name);
}

void ComputeSplats::setDraw(int firstTask, int tasks, FrameUniforms& uniforms) const {
    uniforms.counts.y = tasks;
    uniforms.counts.z = firstTask;
    glNamedBufferSubData(uniforms_.get(), 0, sizeof(FrameUniforms), &uniforms);
}

Result<void> ComputeSplats::drawTasks(int pass, SplatFrame& frame) {
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    return drawRuns(
        frame, programs_.rule(), [&](SplatShape shape, int first, int count) -> Result<void> {
            STX_TRY(const GLuint name, programs_.get(SplatProgram::splats, pass, shape));
            glUseProgram(name);
            setDraw(first, count, frame.uniforms);
            // A dispatch has at most 65535 groups a side; the shader counts in rows of 32768.
            glDispatchCompute(static_cast<GLuint>(std::min(count, 32768)),
                              static_cast<GLuint>((count + 32767) / 32768), 1);
            return {};
        });
}

/// Marks the tasks that lie behind what the visibility pass found, by the farthest front distance
/// of tiles: they cannot show, so the picture is the same without them.
Result<void> ComputeSplats::cull(SplatFrame& frame) {
    const auto tiles = (glm::ivec2(frame.uniforms.frameSize) + kCullTile - 1) / kCullTile;
    tiles_.reserve(static_cast<std::int64_t>(tiles.x) * tiles.y * 4);
    visible_.reserve(static_cast<std::int64_t>(frame.tasks.size()) * 4);
    STX_CHECK(context_.check("making the frame's buffers"));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 10, visible_.buffer.get());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 11, tiles_.buffer.get());
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    STX_TRY(const GLuint farthest, programs_.get(SplatProgram::tiles));
    glUseProgram(farthest);
    setDraw(0, static_cast<int>(frame.tasks.size()), frame.uniforms);
    glDispatchCompute(static_cast<GLuint>(tiles.x), static_cast<GLuint>(tiles.y), 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    STX_TRY(const GLuint mark, programs_.get(SplatProgram::cull));
    glUseProgram(mark);
    glDispatchCompute(static_cast<GLuint>((frame.tasks.size() + 63) / 64), 1, 1);
    return {};
}

Result<void> ComputeSplats::resolve(SplatFrame& frame, int slot) {
    const glm::ivec2 size(frame.uniforms.frameSize);
    const std::int64_t pixels = static_cast<std::int64_t>(size.x) * size.y;
    Slot& to = slots_[slot];
    colour_.reserve(pixels * 16);
    depth_.reserve(pixels * 4);
    if (variant_.normals) {
        normal_.reserve(pixels * 12);
        albedo_.reserve(pixels * 16);
    }
    to.back.reserve(pixels * bytesEach());
    to.pixels = pixels;
    STX_CHECK(context_.check("making the frame's buffers"));
    if (!to.back.memory)
        return fail(ErrorCode::failed, "'{}' gives no memory to read the frame back through",
                    context_.device().name);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 6, colour_.buffer.get());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 7, depth_.buffer.get());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 8, normal_.buffer.get());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 9, albedo_.buffer.get());
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    STX_TRY(const GLuint name, programs_.get(SplatProgram::resolve));
    glUseProgram(name);
    setDraw(0, 0, frame.uniforms);
    glDispatchCompute(static_cast<GLuint>((size.x + 15) / 16),
                      static_cast<GLuint>((size.y + 7) / 8), 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    std::int64_t at = 0;
    const auto fetch = [&](const GrowingBuffer& from, std::int64_t each) {
        glCopyNamedBufferSubData(from.buffer.get(), to.back.buffer.get(), 0, at, each * pixels);
        at += each * pixels;
    };
    fetch(colour_, 16);
    if (variant_.normals) fetch(albedo_, 16);
    fetch(depth_, 4);
    if (variant_.normals) fetch(normal_, 12);
    to.back.fence();
    return context_.check("drawing");
}

Result<void> ComputeSplats::draw(SplatFrame& frame, int slot) {
    const std::int64_t padded =
        static_cast<std::int64_t>(frame.uniforms.frameSize.z) * (frame.uniforms.frameSize.y + 2);
    front_.reserve(padded * 4);
    sums_.reserve(padded * 4 * channels());
    STX_CHECK(context_.check("making the frame's buffers"));
    for (Slot& s : slots_) STX_CHECK(s.back.wait(context_));
    const std::uint32_t nothing = 0x7f800000u, zero = 0;
    glClearNamedBufferSubData(front_.buffer.get(), GL_R32UI, 0, padded * 4, GL_RED_INTEGER,
                              GL_UNSIGNED_INT, &nothing);
    glClearNamedBufferSubData(sums_.buffer.get(), GL_R32UI, 0, padded * 4 * channels(),
                              GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
    bind(frame);
    lastTasks_ = static_cast<int>(frame.tasks.size());
    STX_CHECK(drawTasks(1, frame));
    if (variant_.cull && lastTasks_ > 0) STX_CHECK(cull(frame));
    STX_CHECK(drawTasks(2, frame));
    return resolve(frame, slot);
}

Result<SplatPlanes> ComputeSplats::map(int slot) {
    Slot& from = slots_[slot];
    STX_CHECK(from.back.wait(context_));
    return SplatPlanes::in(from.back.memory, from.pixels, variant_.normals);
}

SplatCounts ComputeSplats::counts() {
    SplatCounts out{lastTasks_, 0, variant_.sums};
    if (!variant_.cull || lastTasks_ == 0) return out;
    std::vector<std::uint32_t> visible(static_cast<std::size_t>(lastTasks_));
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetNamedBufferSubData(visible_.buffer.get(), 0, lastTasks_ * 4ll, visible.data());
    out.hidden = static_cast<int>(std::count(visible.begin(), visible.end(), 0u));
    return out;
}

}  // namespace

Result<std::unique_ptr<SplatPipeline>> makeComputeSplats(const EglContext& context,
                                                         const GpuScene& scene,
                                                         const RenderSettings& settings, Job& job) {
    auto made = std::make_unique<ComputeSplats>(context, scene, settings);
    STX_CHECK(made->prepare(job));
    return std::unique_ptr<SplatPipeline>(std::move(made));
}

}  // namespace stx::gpu
