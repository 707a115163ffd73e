#include <array>

#include "lib/render/device/gl_object.hpp"
#include "lib/render/device/returned_buffer.hpp"
#include "lib/render/splat/gpu/splat_pipeline.hpp"

namespace stx::gpu {
namespace {

/// A small splat's point must have its centre inside the targets to be drawn.
constexpr int kMargin = 1;

/// Texture units by the names that the shaders have for them.
constexpr std::array<const char*, 11> kUnits{
    "colourTexture", "depthTexture", "normalTexture", "slopeTexture", "frontTexture", "colourSums",
    "alphaSums",     "normalSums",   "viewBuffer",    "taskBuffer",   "lightBuffer"};
constexpr GLuint kFront = 4, kColourSums = 5, kAlphaSums = 6, kNormalSums = 7, kViews = 8,
                 kTasks = 9, kLights = 10;

void bindTexture(GLuint unit, GLenum target, GLuint name) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(target, name);
}

/// A table that shaders read as a texture.
struct Table {
    GlBuffer buffer = GlBuffer::generate();
    GlTexture texture = GlTexture::generate();

    /// Replaces what is there and binds it.
    void upload(GLuint unit, GLenum format, const void* data, std::size_t bytes) {
        glBindBuffer(GL_TEXTURE_BUFFER, buffer.get());
        glBufferData(GL_TEXTURE_BUFFER, static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 16)),
                     bytes > 0 ? data : nullptr, GL_STREAM_DRAW);
        bindTexture(unit, GL_TEXTURE_BUFFER, texture.get());
        glTexBuffer(GL_TEXTURE_BUFFER, format, buffer.get());
    }
};

/// OpenGL 3.3 binds by name, not in the shader.
void connectUnits(GLuint program) {
    glUseProgram(program);
    for (std::size_t unit = 0; unit < kUnits.size(); ++unit)
        if (const GLint at = glGetUniformLocation(program, kUnits[unit]); at >= 0)
            glUniform1i(at, static_cast<GLint>(unit));
    if (const GLuint block = glGetUniformBlockIndex(program, "FrameBlock");
        block != GL_INVALID_INDEX)
        glUniformBlockBinding(program, block, 0);
}

/// Lee & Park's pipeline: points drawn with vertex texture fetch, the least distance by MIN
/// blending, then sums by additive blending. Everything is OpenGL 3.3.
class RasterSplats final : public SplatPipeline {
  public:
    RasterSplats(const EglContext& context, const GpuScene& scene, const RenderSettings& settings)
        : context_(context), scene_(scene), programs_(true, scene, settings, connectUnits) {}

    Result<void> prepare();
    Result<void> draw(SplatFrame& frame, int slot) override;
    Result<SplatPlanes> map(int slot) override;
    void unmap(int slot) override;
    int margin() const override { return kMargin; }
    int largestPiece() const override {
        return std::min(kLargestPiece, context_.abilities().maxTextureSize - 2 * kMargin);
    }

  private:
    Result<void> makeTargets(glm::ivec2 size);
    void setDraw(int tasks, FrameUniforms& uniforms) const;
    Result<void> drawTasks(int pass, SplatFrame& frame);
    Result<void> drawRun(int pass, SplatShape rule, SplatFrame& frame, int first, int count);
    Result<void> resolve(SplatFrame& frame, int slot);

    const EglContext& context_;
    const GpuScene& scene_;
    SplatPrograms programs_;
    const SplatVariant& variant_ = programs_.variant;
    GlVertexArray noAttributes_;
    GlBuffer uniforms_;
    std::unique_ptr<Table> views_, tasks_, lights_;
    int tasksAtOnce_ = 1;
    glm::ivec2 targetSize_{0};
    GlTexture front_, colour_, alpha_, normal_;
    GlTexture colourOut_, depthOut_, normalOut_, albedoOut_;
    GlFramebuffer frontPass_, blendPass_, resolvePass_;
    struct Slot {
        GlBuffer back;
        std::int64_t bytes = 0, pixels = 0;
        GLsync done = nullptr;
    };
    std::array<Slot, 2> slots_;
};

Result<void> RasterSplats::prepare() {
    noAttributes_ = GlVertexArray::generate();
    uniforms_ = GlBuffer::generate();
    glBindBuffer(GL_UNIFORM_BUFFER, uniforms_.get());
    glBufferData(GL_UNIFORM_BUFFER, sizeof(FrameUniforms), nullptr, GL_STREAM_DRAW);
    views_ = std::make_unique<Table>();
    tasks_ = std::make_unique<Table>();
    lights_ = std::make_unique<Table>();
    GLint texels = 65536;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    if (static_cast<std::size_t>(texels) < scene_.rectangles.size() * sizeof(ViewEntry) / 16)
        return fail(ErrorCode::unsupported,
                    "{} rectangles are more than a table of '{}' holds ({}); use --backend cpu",
                    scene_.rectangles.size(), context_.device().name, texels / 6);
    // The tasks of a draw must fit into a texture buffer, too.
    tasksAtOnce_ = std::min(context_.abilities().verticesAtOnce / (256 * 6),
                            texels / static_cast<int>(sizeof(TaskEntry) / 16));
    STX_CHECK(programs_.build());
    return context_.check("preparing the renderer");
}

Result<void> RasterSplats::makeTargets(glm::ivec2 size) {
    if (targetSize_ == size) return {};
    targetSize_ = {};
    const auto make = [](GLenum format, GLenum pixels, glm::ivec2 of) {
        auto t = GlTexture::generate();
        bindTexture(0, GL_TEXTURE_2D, t.get());
        glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(format), of.x, of.y, 0, pixels, GL_FLOAT,
                     nullptr);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        return t;
    };
    // Targets of a pass; an empty texture leaves its place free.
    const auto pass = [](std::initializer_list<const GlTexture*> textures) {
        auto f = GlFramebuffer::generate();
        glBindFramebuffer(GL_FRAMEBUFFER, f.get());
        std::vector<GLenum> targets;
        for (const GlTexture* t : textures) {
            const auto at = static_cast<GLenum>(GL_COLOR_ATTACHMENT0 + targets.size());
            if (*t) glFramebufferTexture2D(GL_FRAMEBUFFER, at, GL_TEXTURE_2D, t->get(), 0);
            targets.push_back(*t ? at : GLenum{GL_NONE});
        }
        glDrawBuffers(static_cast<GLsizei>(targets.size()), targets.data());
        return f;
    };
    front_ = make(GL_R32F, GL_RED, size);
    colour_ = make(GL_RGBA32F, GL_RGBA, size);
    if (variant_.translucent) alpha_ = make(GL_R32F, GL_RED, size);
    if (variant_.normals) normal_ = make(GL_RGBA32F, GL_RGBA, size);
    const glm::ivec2 inner = size - 2 * kMargin;
    colourOut_ = make(GL_RGBA32F, GL_RGBA, inner);
    depthOut_ = make(GL_R32F, GL_RED, inner);
    if (variant_.normals) {
        normalOut_ = make(GL_RGBA32F, GL_RGBA, inner);
        albedoOut_ = make(GL_RGBA32F, GL_RGBA, inner);
    }
    frontPass_ = pass({&front_});
    blendPass_ = pass({&colour_, &alpha_, &normal_});
    resolvePass_ = pass({&colourOut_, &depthOut_, &normalOut_, &albedoOut_});
    STX_CHECK(context_.check("making the frame's targets"));
    for (const GlFramebuffer* f : {&frontPass_, &blendPass_, &resolvePass_}) {
        glBindFramebuffer(GL_FRAMEBUFFER, f->get());
        if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
            return fail(ErrorCode::unsupported,
                        "'{}' cannot draw into float textures; use --backend cpu",
                        context_.device().name);
    }
    targetSize_ = size;
    return {};
}

void RasterSplats::setDraw(int tasks, FrameUniforms& uniforms) const {
    uniforms.counts.y = tasks;
    uniforms.counts.z = 0;
    glBindBuffer(GL_UNIFORM_BUFFER, uniforms_.get());
    glBufferData(GL_UNIFORM_BUFFER, sizeof(FrameUniforms), &uniforms, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, uniforms_.get());
}

Result<void> RasterSplats::drawRun(int pass, SplatShape rule, SplatFrame& frame, int first,
                                   int count) {
    STX_TRY(const GLuint name, programs_.get(SplatProgram::splats, pass, rule));
    glUseProgram(name);
    const bool quads = rule == SplatShape::ellipse || rule == SplatShape::paper;
    for (int done = 0; done < count; done += tasksAtOnce_) {
        const int tasks = std::min(tasksAtOnce_, count - done);
        tasks_->upload(kTasks, GL_RGBA32UI, frame.tasks.data() + first + done,
                       static_cast<std::size_t>(tasks) * sizeof(TaskEntry));
        setDraw(tasks, frame.uniforms);
        if (quads)
            glDrawArrays(GL_TRIANGLES, 0, tasks * 256 * 6);
        else
            glDrawArrays(GL_POINTS, 0, tasks * 256);
    }
    return {};
}

Result<void> RasterSplats::drawTasks(int pass, SplatFrame& frame) {
    return drawRuns(frame, programs_.rule(), [&](SplatShape shape, int first, int count) {
        return drawRun(pass, shape, frame, first, count);
    });
}

Result<void> RasterSplats::resolve(SplatFrame& frame, int slot) {
    const glm::ivec2 size(frame.uniforms.frameSize);
    glBindFramebuffer(GL_FRAMEBUFFER, resolvePass_.get());
    glViewport(0, 0, size.x, size.y);
    glDisable(GL_BLEND);
    bindTexture(kFront, GL_TEXTURE_2D, front_.get());
    bindTexture(kColourSums, GL_TEXTURE_2D, colour_.get());
    bindTexture(kAlphaSums, GL_TEXTURE_2D, alpha_.get());
    bindTexture(kNormalSums, GL_TEXTURE_2D, normal_.get());
    lights_->upload(kLights, GL_RGBA32F, frame.lights.data(),
                    frame.lights.size() * sizeof(LightEntry));
    STX_TRY(const GLuint name, programs_.get(SplatProgram::resolve));
    glUseProgram(name);
    setDraw(0, frame.uniforms);
    glDrawArrays(GL_TRIANGLES, 0, 3);

    Slot& to = slots_[slot];
    to.pixels = static_cast<std::int64_t>(size.x) * size.y;
    const std::int64_t wanted = to.pixels * (variant_.normals ? 48 : 20);
    if (!to.back) to.back = GlBuffer::generate();
    glBindBuffer(GL_PIXEL_PACK_BUFFER, to.back.get());
    if (to.bytes < wanted) {
        glBufferData(GL_PIXEL_PACK_BUFFER, wanted, nullptr, GL_STREAM_READ);
        to.bytes = wanted;
    }
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    std::int64_t at = 0;
    const auto fetch = [&](GLenum attachment, GLenum format, std::int64_t each) {
        glReadBuffer(attachment);
        glReadPixels(0, 0, size.x, size.y, format, GL_FLOAT, reinterpret_cast<void*>(at));
        at += each * to.pixels;
    };
    fetch(GL_COLOR_ATTACHMENT0, GL_RGBA, 16);
    if (variant_.normals) fetch(GL_COLOR_ATTACHMENT3, GL_RGBA, 16);
    fetch(GL_COLOR_ATTACHMENT1, GL_RED, 4);
    if (variant_.normals) fetch(GL_COLOR_ATTACHMENT2, GL_RGB, 12);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    if (to.done) glDeleteSync(to.done);
    to.done = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    glFlush();
    return context_.check("drawing");
}

Result<void> RasterSplats::draw(SplatFrame& frame, int slot) {
    const glm::ivec2 size = glm::ivec2(frame.uniforms.frameSize) + 2 * kMargin;
    STX_CHECK(makeTargets(size));
    glBindVertexArray(noAttributes_.get());
    views_->upload(kViews, GL_RGBA32F, frame.views.data(), frame.views.size() * sizeof(ViewEntry));
    bindTexture(0, GL_TEXTURE_2D_ARRAY, scene_.colour.get());
    bindTexture(1, GL_TEXTURE_2D_ARRAY, scene_.depth.get());
    bindTexture(2, GL_TEXTURE_2D_ARRAY, scene_.normal.get());
    bindTexture(3, GL_TEXTURE_2D_ARRAY, scene_.slope.get());
    glViewport(0, 0, size.x, size.y);
    glEnable(GL_PROGRAM_POINT_SIZE);
    glPointParameteri(GL_POINT_SPRITE_COORD_ORIGIN, GL_LOWER_LEFT);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    const std::array<float, 4> nothing{kNoDepth, kNoDepth, kNoDepth, kNoDepth}, zero{};
    glBindFramebuffer(GL_FRAMEBUFFER, frontPass_.get());
    glClearBufferfv(GL_COLOR, 0, nothing.data());
    glBlendEquation(GL_MIN);
    // Bound for no pass to read what it writes.
    bindTexture(kFront, GL_TEXTURE_2D, 0);
    STX_CHECK(drawTasks(1, frame));
    glBindFramebuffer(GL_FRAMEBUFFER, blendPass_.get());
    glClearBufferfv(GL_COLOR, 0, zero.data());
    if (variant_.translucent) glClearBufferfv(GL_COLOR, 1, zero.data());
    if (variant_.normals) glClearBufferfv(GL_COLOR, 2, zero.data());
    glBlendEquation(GL_FUNC_ADD);
    bindTexture(kFront, GL_TEXTURE_2D, front_.get());
    STX_CHECK(drawTasks(2, frame));
    return resolve(frame, slot);
}

Result<SplatPlanes> RasterSplats::map(int slot) {
    Slot& from = slots_[slot];
    STX_CHECK(waitFor(from.done, context_));
    glBindBuffer(GL_PIXEL_PACK_BUFFER, from.back.get());
    const auto* at = static_cast<const std::byte*>(glMapBufferRange(
        GL_PIXEL_PACK_BUFFER, 0, from.pixels * (variant_.normals ? 48 : 20), GL_MAP_READ_BIT));
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    STX_CHECK(context_.check("reading the frame back"));
    if (!at)
        return fail(ErrorCode::failed, "'{}' gives no memory to read the frame back through",
                    context_.device().name);
    return SplatPlanes::in(at, from.pixels, variant_.normals);
}

void RasterSplats::unmap(int slot) {
    glBindBuffer(GL_PIXEL_PACK_BUFFER, slots_[slot].back.get());
    glUnmapBuffer(GL_PIXEL_PACK_BUFFER);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
}

}  // namespace

Result<std::unique_ptr<SplatPipeline>> makeRasterSplats(const EglContext& context,
                                                        const GpuScene& scene,
                                                        const RenderSettings& settings, Job&) {
    auto made = std::make_unique<RasterSplats>(context, scene, settings);
    STX_CHECK(made->prepare());
    return std::unique_ptr<SplatPipeline>(std::move(made));
}

}  // namespace stx::gpu
