#include "formats/images/frames.hpp"
#include "formats/images/images.hpp"
#include "formats/stx/stx.hpp"
#include "lib/render/mesh/mesh_renderer.hpp"

namespace stx {
namespace {

/// A renderer together with what it draws from.
class KeptRenderer final : public Renderer {
  public:
    explicit KeptRenderer(Model model) : model_(std::move(model)) {}

    Result<void> make(Backend backend, const RenderSettings& settings, int device, Job& job) {
        if (const auto* atlas = std::get_if<Atlas>(&model_)) {
            STX_TRY(auto bundle, unpack(*atlas, job));
            model_ = std::move(bundle);
        }
        if (const auto* mesh = std::get_if<Mesh>(&model_)) {
            STX_CHECK(mesh->check());
            renderer_ = makeMeshRenderer(*mesh, settings, job);
            return {};
        }
        STX_TRY(renderer_, makeRenderer(backend, std::get<Bundle>(model_), settings, device, job));
        return {};
    }

    Result<Frame> render(const Camera& camera) override { return renderer_->render(camera); }
    void expect(const Camera& next) override { renderer_->expect(next); }
    std::string backend() const override { return renderer_->backend(); }
    std::string device() const override { return renderer_->device(); }

  private:
    Model model_;
    std::unique_ptr<Renderer> renderer_;
};

}  // namespace

Result<std::unique_ptr<Renderer>> rendererOf(Model model, const RenderSettings& settings, Job& job,
                                             Backend backend, int device) {
    auto renderer = std::make_unique<KeptRenderer>(std::move(model));
    STX_CHECK(renderer->make(backend, settings, device, job));
    return renderer;
}

Result<Frame> render(const Model& model, const Camera& camera, const RenderSettings& settings,
                     Job& job) {
    STX_CHECK(camera.check());
    STX_CHECK(job.limits.checkAllocation(static_cast<std::uint64_t>(camera.width) * camera.height,
                                         64, "the picture"));
    if (const auto* bundle = std::get_if<Bundle>(&model)) {
        STX_TRY(const auto renderer, makeRenderer(Backend::automatic, *bundle, settings, -1, job));
        return renderer->render(camera);
    }
    if (const auto* mesh = std::get_if<Mesh>(&model)) {
        STX_CHECK(mesh->check());
        return makeMeshRenderer(*mesh, settings, job)->render(camera);
    }
    STX_TRY(const auto bundle, unpack(std::get<Atlas>(model), job));
    STX_TRY(const auto renderer, makeRenderer(Backend::automatic, bundle, settings, -1, job));
    return renderer->render(camera);
}

Result<Picture> openPicture(const std::filesystem::path& path, Job& job) {
    STX_TRY(const auto bytes, readFile(path, job.limits));
    auto decoded = decodeImage(bytes, path.string(), job.limits);
    if (!decoded) return tl::unexpected(decoded.error().at(fmt::format("'{}'", path.string())));
    Picture picture;
    if (decoded->linear) picture.linear = rgbaFloatFrom(*decoded);
    picture.coded = rgba8From(*decoded);
    return picture;
}

Picture pictureOf(const Frame& frame, const std::optional<glm::vec3>& background) {
    return {rgba8From(frame, background), {}};
}

Result<void> save(const Frame& frame, const std::filesystem::path& target,
                  const PictureOptions& options, Job& job) {
    STX_CHECK(job.checkCancelled());
    FrameOptions file;
    file.background = options.background;
    file.jpegQuality = options.jpegQuality;
    file.noClobber = options.noClobber;
    file.camera = options.camera;
    return writeFrame(frame, target, file);
}

Result<Comparison> compare(const Picture& a, const Picture& b, const CompareSettings& settings,
                           Job& job) {
    if (a.isLinear() != b.isLinear())
        job.note("one picture is linear float, the other 8-bit: both are compared as 8-bit sRGB");
    if (a.isLinear() && b.isLinear()) return compare(a.linear, b.linear, settings);
    return compare(a.coded, b.coded, settings);
}

}  // namespace stx
