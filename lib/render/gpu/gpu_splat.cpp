#include "lib/render/gpu/gpu_splat.hpp"

#include <chrono>
#include <map>

#include "embedded_shaders.hpp"
#include "lib/render/cpu/splat_kernels.hpp"
#include "lib/render/gpu/egl_context.hpp"
#include "lib/render/gpu/gl_object.hpp"
#include "lib/render/gpu/gpu_scene.hpp"
#include "lib/render/gpu/growing_buffer.hpp"
#include "lib/render/gpu/shader_program.hpp"
#include "lib/render/gpu/splat_frame.hpp"
#include "lib/render/pinholes.hpp"
#include "lib/render/silhouettes.hpp"

namespace stx::gpu {
namespace {

/// Margin of the raster targets: a small splat's point must have its centre inside to be drawn.
constexpr int kMargin = 1;
/// Largest piece of a frame drawn at once, pixels a side; bigger frames are drawn in pieces.
constexpr int kLargestPiece = 4096;

enum class Sums { integers = 0, floats = 1, pairs = 2 };
/// RULE of the shaders.
enum class Rule { point = 0, uniform = 1, ellipse = 2, paper = 3, small = 4 };

/// Everything that lives in the context; destroyed while it is current.
struct Resources {
    GpuScene scene;
    std::map<std::string, GlProgram> programs;
    GlVertexArray noAttributes;
    GlBuffer uniforms;
    GrowingBuffer views, tasks, lights, front, sums, colourOut, depthOut, normalOut, albedoOut;
    // Raster pipeline.
    glm::ivec2 targetSize{0};
    GlTexture frontTarget, colourTarget, alphaTarget, normalTarget;
    GlFramebuffer frontPass, blendPass;
};

class GpuSplatRenderer final : public Renderer {
  public:
    GpuSplatRenderer(std::shared_ptr<EglContext> context, RenderSettings settings,
                     Pipeline pipeline, Limits limits)
        : context_(std::move(context)),
          settings_(std::move(settings)),
          raster_(pipeline == Pipeline::raster),
          limits_(limits) {}

    ~GpuSplatRenderer() override {
        if (!resources_) return;
        // Where the context cannot be bound any more its objects are gone with it.
        if (auto current = context_->makeCurrent())
            resources_.reset();
        else
            (void)resources_.release();
    }

    Result<void> prepare(const Bundle& bundle, Job& job);
    Result<Frame> render(const Camera& camera) override;
    std::string backend() const override { return "gpu"; }
    std::string device() const override { return context_->device().name; }

  private:
    [[nodiscard]] bool lit() const { return settings_.lighting.on(); }
    [[nodiscard]] int channels() const {
        const int n = 4 + (resources_->scene.translucent ? 1 : 0) + (lit() ? 3 : 0);
        return sums_ == Sums::pairs ? (n + 1) / 2 * 2 : n;
    }
    [[nodiscard]] std::string header(int pass, Rule rule) const;
    Result<GLuint> program(const char* kind, int pass, Rule rule);
    Result<void> buildPrograms();
    Result<void> makeTargets(glm::ivec2 size);
    void bindScene() const;
    void setDraw(int firstTask, int tasks, FrameUniforms& uniforms) const;
    Result<void> drawCompute(SplatFrame& frame);
    Result<void> drawRaster(SplatFrame& frame);
    Result<void> drawPiece(const Camera& camera);
    Result<void> readPiece(glm::ivec2 at, glm::ivec2 size, Frame& frame);

    std::shared_ptr<EglContext> context_;
    std::unique_ptr<Silhouettes> silhouettes_;  ///< shared with the processor's splat mode
    RenderSettings settings_;
    bool raster_;
    Limits limits_;
    Sums sums_ = Sums::integers;
    std::unique_ptr<Resources> resources_;
};

std::string GpuSplatRenderer::header(int pass, Rule rule) const {
    const GpuScene& scene = resources_->scene;
    std::string text;
    if (!raster_ && sums_ == Sums::pairs)
        text +=
            "#extension GL_ARB_gpu_shader_int64 : require\n"
            "#extension GL_NV_shader_atomic_int64 : require\n";
    if (!raster_ && sums_ == Sums::floats)
        text += "#extension GL_NV_shader_atomic_float : require\n";
    const auto define = [&](const char* name, auto value) {
        text += fmt::format("#define {} {}\n", name, value);
    };
    define("PASS", pass);
    define("RULE", static_cast<int>(rule));
    define("ACCUMULATE", static_cast<int>(sums_));
    define("TRANSLUCENT", scene.translucent ? 1 : 0);
    define("NORMALS", lit() ? 1 : 0);
    define("LIT", lit() ? 1 : 0);
    define("SIZES", scene.hasSizes ? 1 : 0);
    define("RASTER", raster_ ? 1 : 0);
    define("LINEAR", scene.linear ? 1 : 0);
    // The kernel's constants; their meaning stands in lib/render/cpu/splat_kernels.
    text += fmt::format(
        "#define SIGMA_SOURCE_2 0.25\n#define SIGMA_PIXEL_2 0.09\n#define REACH_2 5.0\n"
        "#define CORE_2 2.1\n#define LARGEST 256.0\n#define STEEPEST 0.05\n"
        "#define RIM_CORE_2 0.5\n#define EDGE_QUALITY 0.05\n#define SMALL_COVER_2 {:.9e}\n"
        "#define LEAST_DENSITY {:.9e}\n#define GRADIENT {:.9e}\n#define FADE_TO {:.9e}\n",
        splat::kSmallCover2, splat::kLeastDensity, splat::kGradient, splat::kFadeTo);
    return text;
}

Result<GLuint> GpuSplatRenderer::program(const char* kind, int pass, Rule rule) {
    const std::string key = fmt::format("{} {} {}", kind, pass, static_cast<int>(rule));
    if (const auto found = resources_->programs.find(key); found != resources_->programs.end())
        return found->second.get();
    std::vector<ShaderStage> stages;
    if (std::string_view(kind) == "compute") {
        stages = {{GL_COMPUTE_SHADER,
                   "splat.comp",
                   {shaders::splat_frame_glsl, shaders::splat_points_glsl, shaders::splat_comp}}};
    } else if (std::string_view(kind) == "raster") {
        stages = {{GL_VERTEX_SHADER,
                   "splat.vert",
                   {shaders::splat_frame_glsl, shaders::splat_points_glsl, shaders::splat_vert}},
                  {GL_FRAGMENT_SHADER,
                   "splat.frag",
                   {shaders::splat_frame_glsl, shaders::splat_points_glsl, shaders::splat_frag}}};
    } else {
        stages = {{GL_COMPUTE_SHADER,
                   "resolve.comp",
                   {shaders::splat_frame_glsl, shaders::phong_glsl, shaders::resolve_comp}}};
    }
    STX_TRY(GlProgram built, buildProgram(header(pass, rule), stages));
    const GLuint name = built.get();
    resources_->programs.emplace(key, std::move(built));
    return name;
}

Result<void> GpuSplatRenderer::buildPrograms() {
    const char* kind = raster_ ? "raster" : "compute";
    std::vector<Rule> rules{Rule::uniform, Rule::small, Rule::ellipse};
    if (settings_.splat == SplatRule::point) rules = {Rule::point};
    if (settings_.splat == SplatRule::paper) rules = {Rule::paper};
    for (const Rule rule : rules) {
        STX_TRY(const GLuint first, program(kind, 1, rule));
        STX_TRY(const GLuint second, program(kind, 2, rule));
        (void)first;
        (void)second;
    }
    STX_TRY(const GLuint resolve, program("resolve", 0, Rule::point));
    (void)resolve;
    return {};
}

Result<void> GpuSplatRenderer::prepare(const Bundle& bundle, Job& job) {
    STX_TRY(auto current, context_->makeCurrent());
    resources_ = std::make_unique<Resources>();
    STX_TRY(resources_->scene, GpuScene::upload(bundle, *context_, lit(), job));
    silhouettes_ = std::make_unique<Silhouettes>(bundle);
    resources_->noAttributes = GlVertexArray::create();
    resources_->uniforms = GlBuffer::create();
    glNamedBufferStorage(resources_->uniforms.get(), sizeof(FrameUniforms), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    const auto& able = context_->abilities();
    // Linear colours need a float's range; 8-bit ones sum exactly in integers, two to a 64-bit
    // atomic where there is one.
    if (resources_->scene.linear && able.atomicFloat)
        sums_ = Sums::floats;
    else if (able.atomicInt64)
        sums_ = Sums::pairs;
    if (auto built = buildPrograms(); !built) {
        if (raster_ || sums_ == Sums::integers) return built;
        // A driver that names the extension and then does not take it.
        sums_ = Sums::integers;
        resources_->programs.clear();
        STX_CHECK(buildPrograms());
    }
    return context_->check("preparing the renderer");
}

void GpuSplatRenderer::bindScene() const {
    const Resources& r = *resources_;
    glBindTextureUnit(0, r.scene.colour.get());
    glBindTextureUnit(1, r.scene.depth.get());
    glBindTextureUnit(2, r.scene.normal.get());
    glBindTextureUnit(3, r.scene.slope.get());
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, r.uniforms.get());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, r.views.buffer.get());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, r.tasks.buffer.get());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 5, r.lights.buffer.get());
}

void GpuSplatRenderer::setDraw(int firstTask, int tasks, FrameUniforms& uniforms) const {
    uniforms.counts.y = tasks;
    uniforms.counts.z = firstTask;
    glNamedBufferSubData(resources_->uniforms.get(), 0, sizeof(FrameUniforms), &uniforms);
}

Result<void> GpuSplatRenderer::drawCompute(SplatFrame& frame) {
    Resources& r = *resources_;
    const std::int64_t padded =
        static_cast<std::int64_t>(frame.uniforms.frameSize.z) * (frame.uniforms.frameSize.y + 2);
    r.front.reserve(padded * 4);
    r.sums.reserve(padded * 4 * channels());
    STX_CHECK(context_->check("making the frame's buffers"));
    const std::uint32_t nothing = 0x7f800000u, zero = 0;
    glClearNamedBufferData(r.front.buffer.get(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT,
                           &nothing);
    glClearNamedBufferData(r.sums.buffer.get(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, r.front.buffer.get());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 4, r.sums.buffer.get());
    const auto dispatch = [&](int pass, Rule rule, int first, int count) -> Result<void> {
        if (count == 0) return {};
        STX_TRY(const GLuint name, program("compute", pass, rule));
        glUseProgram(name);
        setDraw(first, count, frame.uniforms);
        const int columns = std::min(count, 32768);
        glDispatchCompute(static_cast<GLuint>(columns),
                          static_cast<GLuint>((count + 32767) / 32768), 1);
        return {};
    };
    const int large = frame.uniformTasks + frame.smallTasks;
    const int all = static_cast<int>(frame.tasks.size());
    const Rule first = settings_.splat == SplatRule::point   ? Rule::point
                       : settings_.splat == SplatRule::paper ? Rule::paper
                                                             : Rule::uniform;
    for (const int pass : {1, 2}) {
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
        STX_CHECK(dispatch(pass, first, 0, frame.uniformTasks));
        STX_CHECK(dispatch(pass, Rule::small, frame.uniformTasks, frame.smallTasks));
        STX_CHECK(dispatch(pass, Rule::ellipse, large, all - large));
    }
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    return {};
}

Result<void> GpuSplatRenderer::makeTargets(glm::ivec2 size) {
    Resources& r = *resources_;
    if (r.targetSize == size) return {};
    const auto make = [&](GLenum format) {
        auto t = GlTexture::create(GL_TEXTURE_2D);
        glTextureStorage2D(t.get(), 1, format, size.x, size.y);
        glTextureParameteri(t.get(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTextureParameteri(t.get(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        return t;
    };
    r.frontPass = GlFramebuffer::create();
    r.blendPass = GlFramebuffer::create();
    r.frontTarget = make(GL_R32F);
    r.colourTarget = make(GL_RGBA32F);
    glNamedFramebufferTexture(r.frontPass.get(), GL_COLOR_ATTACHMENT0, r.frontTarget.get(), 0);
    glNamedFramebufferTexture(r.blendPass.get(), GL_COLOR_ATTACHMENT0, r.colourTarget.get(), 0);
    std::array<GLenum, 3> targets{GL_COLOR_ATTACHMENT0, GL_NONE, GL_NONE};
    if (r.scene.translucent) {
        r.alphaTarget = make(GL_R32F);
        glNamedFramebufferTexture(r.blendPass.get(), GL_COLOR_ATTACHMENT1, r.alphaTarget.get(), 0);
        targets[1] = GL_COLOR_ATTACHMENT1;
    }
    if (lit()) {
        r.normalTarget = make(GL_RGBA32F);
        glNamedFramebufferTexture(r.blendPass.get(), GL_COLOR_ATTACHMENT2, r.normalTarget.get(), 0);
        targets[2] = GL_COLOR_ATTACHMENT2;
    }
    glNamedFramebufferDrawBuffers(r.blendPass.get(), 3, targets.data());
    STX_CHECK(context_->check("making the frame's targets"));
    for (const GLuint name : {r.frontPass.get(), r.blendPass.get()}) {
        if (glCheckNamedFramebufferStatus(name, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
            return fail(ErrorCode::unsupported, "'{}' cannot draw into float textures",
                        context_->device().name);
    }
    r.targetSize = size;
    return {};
}

Result<void> GpuSplatRenderer::drawRaster(SplatFrame& frame) {
    Resources& r = *resources_;
    const glm::ivec2 size = glm::ivec2(frame.uniforms.frameSize) + 2 * kMargin;
    STX_CHECK(makeTargets(size));
    const float nothing[4] = {kNoDepth, kNoDepth, kNoDepth, kNoDepth};
    const float zero[4] = {};
    glClearNamedFramebufferfv(r.frontPass.get(), GL_COLOR, 0, nothing);
    glClearNamedFramebufferfv(r.blendPass.get(), GL_COLOR, 0, zero);
    if (r.scene.translucent) glClearNamedFramebufferfv(r.blendPass.get(), GL_COLOR, 1, zero);
    if (lit()) glClearNamedFramebufferfv(r.blendPass.get(), GL_COLOR, 2, zero);
    glViewport(0, 0, size.x, size.y);
    glBindVertexArray(r.noAttributes.get());
    glEnable(GL_PROGRAM_POINT_SIZE);
    glPointParameteri(GL_POINT_SPRITE_COORD_ORIGIN, GL_LOWER_LEFT);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    const auto draw = [&](int pass, Rule rule, int first, int count) -> Result<void> {
        if (count == 0) return {};
        STX_TRY(const GLuint name, program("raster", pass, rule));
        glUseProgram(name);
        const bool quads = rule == Rule::ellipse || rule == Rule::paper;
        // A draw's vertices are counted in 31 bits.
        const int atOnce = (1 << 30) / (256 * 6);
        for (int done = 0; done < count; done += atOnce) {
            const int tasks = std::min(atOnce, count - done);
            setDraw(first + done, tasks, frame.uniforms);
            if (quads)
                glDrawArrays(GL_TRIANGLES, 0, tasks * 256 * 6);
            else
                glDrawArrays(GL_POINTS, 0, tasks * 256);
        }
        return {};
    };
    const int large = frame.uniformTasks + frame.smallTasks;
    const int all = static_cast<int>(frame.tasks.size());
    const Rule rule = settings_.splat == SplatRule::point   ? Rule::point
                      : settings_.splat == SplatRule::paper ? Rule::paper
                                                            : Rule::uniform;
    for (const int pass : {1, 2}) {
        glBindFramebuffer(GL_FRAMEBUFFER, pass == 1 ? r.frontPass.get() : r.blendPass.get());
        glBlendEquation(pass == 1 ? GL_MIN : GL_FUNC_ADD);
        if (pass == 2) glBindTextureUnit(4, r.frontTarget.get());
        STX_CHECK(draw(pass, rule, 0, frame.uniformTasks));
        STX_CHECK(draw(pass, Rule::small, frame.uniformTasks, frame.smallTasks));
        STX_CHECK(draw(pass, Rule::ellipse, large, all - large));
    }
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glBindTextureUnit(4, r.frontTarget.get());
    glBindTextureUnit(5, r.colourTarget.get());
    glBindTextureUnit(6, r.alphaTarget.get());
    glBindTextureUnit(7, r.normalTarget.get());
    return {};
}

Result<void> GpuSplatRenderer::drawPiece(const Camera& camera) {
    Resources& r = *resources_;
    SplatFrame frame = planSplatFrame(r.scene, settings_, camera, kMargin);
    r.views.upload(frame.views);
    r.tasks.upload(frame.tasks);
    r.lights.upload(frame.lights);
    bindScene();
    if (raster_)
        STX_CHECK(drawRaster(frame));
    else
        STX_CHECK(drawCompute(frame));

    const std::int64_t pixels = static_cast<std::int64_t>(camera.width) * camera.height;
    r.colourOut.reserve(pixels * 16);
    r.depthOut.reserve(pixels * 4);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 6, r.colourOut.buffer.get());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 7, r.depthOut.buffer.get());
    if (lit()) {
        r.normalOut.reserve(pixels * 12);
        r.albedoOut.reserve(pixels * 16);
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 8, r.normalOut.buffer.get());
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 9, r.albedoOut.buffer.get());
    }
    STX_TRY(const GLuint resolve, program("resolve", 0, Rule::point));
    glUseProgram(resolve);
    setDraw(0, 0, frame.uniforms);
    glDispatchCompute(static_cast<GLuint>((camera.width + 15) / 16),
                      static_cast<GLuint>((camera.height + 7) / 8), 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glFinish();
    return context_->check("drawing");
}

Result<void> GpuSplatRenderer::readPiece(glm::ivec2 at, glm::ivec2 size, Frame& frame) {
    const Resources& r = *resources_;
    const auto read = [&](const GrowingBuffer& from, auto& image) {
        using Pixel = typename std::remove_reference_t<decltype(image)>::Pixel;
        const auto count = static_cast<std::int64_t>(size.x) * size.y;
        if (size == image.size()) {
            glGetNamedBufferSubData(from.buffer.get(), 0, count * static_cast<int>(sizeof(Pixel)),
                                    image.data());
            return;
        }
        std::vector<Pixel> piece(static_cast<std::size_t>(count));
        glGetNamedBufferSubData(from.buffer.get(), 0, count * static_cast<int>(sizeof(Pixel)),
                                piece.data());
        for (int y = 0; y < size.y; ++y)
            std::copy_n(piece.data() + static_cast<std::size_t>(y) * size.x, size.x,
                        image.row(at.y + y).data() + at.x);
    };
    read(r.colourOut, frame.colour);
    read(r.depthOut, frame.depth);
    if (lit()) {
        read(r.normalOut, frame.normal);
        read(r.albedoOut, frame.albedo);
    }
    return context_->check("reading the frame back");
}

Result<Frame> GpuSplatRenderer::render(const Camera& camera) {
    STX_CHECK(camera.check());
    const auto pixels =
        static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
    STX_CHECK(limits_.checkAllocation(pixels, lit() ? 48 : 20, "the frame"));
    STX_TRY(auto current, context_->makeCurrent());
    Frame frame;
    frame.linear = resources_->scene.linear;
    frame.colour = Image<glm::vec4>(camera.width, camera.height);
    frame.depth = Image<float>(camera.width, camera.height);
    if (lit()) {
        frame.normal = Image<glm::vec3>(camera.width, camera.height);
        frame.albedo = Image<glm::vec4>(camera.width, camera.height);
    }
    // What one storage block takes bounds a piece, too.
    int piece = std::min(kLargestPiece, context_->abilities().maxTextureSize - 2 * kMargin);
    const std::int64_t perPixel = std::max(16, 4 * channels());
    while (piece > 256 &&
           (piece + 2ll) * (piece + 2) * perPixel > context_->abilities().maxStorageBytes)
        piece /= 2;
    for (int y = 0; y < camera.height; y += piece) {
        for (int x = 0; x < camera.width; x += piece) {
            Camera part = camera;
            part.width = std::min(piece, camera.width - x);
            part.height = std::min(piece, camera.height - y);
            part.cx -= x;
            part.cy -= y;
            const auto start = std::chrono::steady_clock::now();
            STX_CHECK(drawPiece(part));
            frame.milliseconds +=
                std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                    .count();
            STX_CHECK(readPiece({x, y}, {part.width, part.height}, frame));
        }
    }
    if (settings_.splat == SplatRule::data) {
        const auto start = std::chrono::steady_clock::now();
        closePinholes(frame);
        silhouettes_->carve(frame, camera);
        frame.milliseconds +=
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                .count();
    }
    return frame;
}

}  // namespace

Result<std::unique_ptr<Renderer>> makeGpuSplatRenderer(const Bundle& bundle,
                                                       const RenderSettings& settings, int device,
                                                       Job& job, Pipeline pipeline) {
    STX_TRY(auto context, EglContext::create(device, EglContext::Profile::core));
    auto renderer =
        std::make_unique<GpuSplatRenderer>(std::move(context), settings, pipeline, job.limits);
    STX_CHECK(renderer->prepare(bundle, job));
    return std::unique_ptr<Renderer>(std::move(renderer));
}

}  // namespace stx::gpu
