#include "lib/render/splat/gpu/gpu_splat.hpp"

#include <chrono>
#include <optional>

#include "lib/base/parallel.hpp"
#include "lib/render/outline/silhouettes.hpp"
#include "lib/render/splat/gpu/gpu_scene.hpp"
#include "lib/render/splat/pinholes.hpp"
#include "lib/render/splat/plan.hpp"

namespace stx::gpu {
namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Everything that lives in the context; destroyed while it is current.
struct Resources {
    GpuScene scene;
    std::unique_ptr<SplatPipeline> pipeline;
};

/// A frame under way.
struct Begun {
    Camera camera;
    int slot = 0;
    double milliseconds = 0;
};

class GpuSplatRenderer final : public Renderer {
  public:
    GpuSplatRenderer(std::shared_ptr<EglContext> context, const PageSet& set,
                     RenderSettings settings, Limits limits)
        : context_(std::move(context)),
          set_(set),
          silhouettes_(set),
          settings_(std::move(settings)),
          limits_(std::move(limits)) {}

    ~GpuSplatRenderer() override { destroyIn(*context_, resources_); }

    Result<void> prepare(Job& job);
    Result<Frame> render(const Camera& camera) override;
    void expect(const Camera& next) override { expected_ = next; }
    void lightFrom(const std::optional<Camera>& pose) override {
        Renderer::lightFrom(pose);
        begun_.reset();  // in another light
    }
    std::string backend() const override { return "gpu"; }
    std::string device() const override { return context_->device().name; }
    SplatCounts counts();

  private:
    [[nodiscard]] Result<void> checkSize(const Camera& camera) const;
    [[nodiscard]] bool inOnePiece(const Camera& camera) const {
        const int most = resources_->pipeline->largestPiece();
        return camera.width <= most && camera.height <= most;
    }
    [[nodiscard]] Frame emptyFrame(const Camera& camera) const;
    /// `largest`: splat::largestSplat() of the whole picture, of which `camera` may be a part.
    Result<Begun> begin(const Camera& camera, float largest, int slot);
    /// Begins the frame that is expected next, in a slot.
    void beginExpected(const std::optional<Camera>& next, int slot);
    /// Waits for a piece of the frame and copies it to where it belongs.
    Result<void> finish(const Begun& begun, glm::ivec2 at, Frame& frame);
    Result<void> renderWhole(const Camera& camera, const std::optional<Camera>& next, Frame& frame);
    Result<void> renderPieces(const Camera& camera, Frame& frame);

    std::shared_ptr<EglContext> context_;
    PageSet set_;
    Silhouettes silhouettes_;
    RenderSettings settings_;
    Limits limits_;
    std::unique_ptr<Resources> resources_;
    std::optional<Camera> expected_;
    std::optional<Begun> begun_;  ///< a frame under way before it was asked for
};

Result<void> GpuSplatRenderer::prepare(Job& job) {
    auto pipeline = settings_.pipeline;
    if (pipeline == GpuPipeline::compute)
        STX_CHECK(context_->requireModern("the compute pipeline", "--pipeline raster"));
    if (pipeline == GpuPipeline::automatic)
        pipeline = choosePipeline(context_->device(), context_->abilities()).pipeline;
    STX_TRY(auto current, context_->makeCurrent());
    resources_ = std::make_unique<Resources>();
    STX_TRY(
        resources_->scene,
        GpuScene::upload(set_, *context_, settings_.wantNormals(),
                         settings_.splat == SplatRule::data && settings_.does(Stage::nearer), job));
    const auto make = pipeline == GpuPipeline::compute ? makeComputeSplats : makeRasterSplats;
    STX_TRY(resources_->pipeline, make(*context_, resources_->scene, settings_, job));
    return {};
}

Result<void> GpuSplatRenderer::checkSize(const Camera& camera) const {
    STX_CHECK(camera.check());
    return limits_.checkAllocation(
        static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height),
        settings_.wantNormals() ? 48 : 20, "the frame");
}

Frame GpuSplatRenderer::emptyFrame(const Camera& camera) const {
    Frame frame;
    frame.linear = resources_->scene.linear;
    frame.colour = Image<glm::vec4>(camera.width, camera.height);
    frame.depth = Image<float>(camera.width, camera.height);
    if (settings_.wantNormals()) {
        frame.normal = Image<glm::vec3>(camera.width, camera.height);
        frame.albedo = Image<glm::vec4>(camera.width, camera.height);
    }
    return frame;
}

Result<Begun> GpuSplatRenderer::begin(const Camera& camera, float largest, int slot) {
    const auto start = Clock::now();
    SplatFrame frame = planSplatFrame(resources_->scene, settings_, camera, lightPose(camera),
                                      largest, resources_->pipeline->margin());
    STX_CHECK(resources_->pipeline->draw(frame, slot));
    return Begun{camera, slot, millisecondsSince(start)};
}

void GpuSplatRenderer::beginExpected(const std::optional<Camera>& next, int slot) {
    if (!next || !checkSize(*next) || !inOnePiece(*next)) return;
    // What fails here fails again, with a message, when the frame is asked for.
    if (auto begun = begin(*next, splat::largestSplat(*next), slot)) begun_ = std::move(*begun);
}

Result<void> GpuSplatRenderer::finish(const Begun& begun, glm::ivec2 at, Frame& frame) {
    const auto start = Clock::now();
    STX_TRY(const SplatPlanes planes, resources_->pipeline->map(begun.slot));
    frame.milliseconds += begun.milliseconds + millisecondsSince(start);
    const int width = begun.camera.width;
    const auto copy = [&](const auto* from, auto& image, int y) {
        std::copy_n(from + static_cast<std::size_t>(y) * width, width,
                    image.row(at.y + y).data() + at.x);
    };
    parallelFor(0, begun.camera.height, 32, [&](int y) {
        copy(planes.colour, frame.colour, y);
        copy(planes.depth, frame.depth, y);
        if (!planes.normal) return;
        copy(planes.normal, frame.normal, y);
        copy(planes.albedo, frame.albedo, y);
    });
    resources_->pipeline->unmap(begun.slot);
    return context_->check("reading the frame back");
}

Result<void> GpuSplatRenderer::renderWhole(const Camera& camera, const std::optional<Camera>& next,
                                           Frame& frame) {
    auto begun = std::exchange(begun_, std::nullopt);
    // A frame that nobody asks for is overwritten, in the order of the commands.
    if (!begun || begun->camera != camera)
        STX_SET(begun, begin(camera, splat::largestSplat(camera), 0));
    beginExpected(next, 1 - begun->slot);
    return finish(*begun, {0, 0}, frame);
}

Result<void> GpuSplatRenderer::renderPieces(const Camera& camera, Frame& frame) {
    begun_.reset();
    const float largest = splat::largestSplat(camera);
    const int piece = resources_->pipeline->largestPiece();
    for (int y = 0; y < camera.height; y += piece) {
        for (int x = 0; x < camera.width; x += piece) {
            Camera part = camera;
            part.width = std::min(piece, camera.width - x);
            part.height = std::min(piece, camera.height - y);
            part.cx -= x;
            part.cy -= y;
            STX_TRY(const Begun begun, begin(part, largest, 0));
            STX_CHECK(finish(begun, {x, y}, frame));
        }
    }
    return {};
}

Result<Frame> GpuSplatRenderer::render(const Camera& camera) {
    const auto next = std::exchange(expected_, std::nullopt);
    STX_CHECK(checkSize(camera));
    Frame frame = emptyFrame(camera);
    {
        STX_TRY(auto current, context_->makeCurrent());
        STX_CHECK(inOnePiece(camera) ? renderWhole(camera, next, frame)
                                     : renderPieces(camera, frame));
    }
    if (settings_.splat == SplatRule::data) {
        const auto start = Clock::now();
        if (settings_.does(Stage::closing))
            finishStage(settings_.log.get(), "closing", frame.colour,
                        [&] { closePinholes(frame, set_.pruned()); });
        if (settings_.does(Stage::coverage))
            finishStage(settings_.log.get(), "coverage", frame.colour,
                        [&] { silhouettes_.carve(frame, camera); });
        frame.milliseconds += millisecondsSince(start);
    }
    return frame;
}

SplatCounts GpuSplatRenderer::counts() {
    if (auto current = context_->makeCurrent()) return resources_->pipeline->counts();
    return {};
}

}  // namespace

PipelineChoice choosePipeline(const Device& device, const ContextAbilities& abilities) {
    if (!abilities.modern)
        return {GpuPipeline::raster, "no compute shaders: vertex texture fetch needs OpenGL 3.3"};
    if (device.software)
        return {GpuPipeline::compute,
                "a software driver sets up every point as a primitive; atomics skip that"};
    if (abilities.atomicInt64 || abilities.atomicFloat)
        return {GpuPipeline::compute,
                "atomics of 64 bits or floats outrun the rasteriser's tiny primitives"};
    return {GpuPipeline::raster,
            "the blending units add four sums at once; 32-bit atomics take one each"};
}

Result<std::unique_ptr<Renderer>> makeGpuSplatRenderer(const PageSet& set,
                                                       const RenderSettings& settings, int device,
                                                       Job& job) {
    const Lighting& lighting = settings.lighting;
    if (lighting.environment && lighting.specular != glm::vec3(0.0f) &&
        lighting.environment->glossTable().empty())
        return fail(ErrorCode::unsupported,
                    "splats on a GPU have gloss of an environment up to --shininess {}, not {}; "
                    "use --backend cpu or --mode surface",
                    EnvironmentLight::kMostTableShininess, lighting.shininess);
    STX_TRY(auto context, EglContext::create(device, EglContext::Profile::core));
    auto renderer =
        std::make_unique<GpuSplatRenderer>(std::move(context), set, settings, job.limits);
    STX_CHECK(renderer->prepare(job));
    return std::unique_ptr<Renderer>(std::move(renderer));
}

SplatCounts lastSplatCounts(Renderer& renderer) {
    if (auto* ours = dynamic_cast<GpuSplatRenderer*>(&renderer)) return ours->counts();
    return {};
}

}  // namespace stx::gpu
