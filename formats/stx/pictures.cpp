#include <algorithm>
#include <cmath>

#include "formats/files/messages.hpp"
#include "formats/images/exif.hpp"
#include "formats/images/frames.hpp"
#include "formats/images/images.hpp"
#include "formats/images/more_pictures.hpp"
#include "formats/photos/file_colours.hpp"
#include "formats/photos/photo.hpp"
#include "formats/stx/stx.hpp"
#include "lib/base/parallel.hpp"
#include "lib/metrics/background_colour.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/texture.hpp"
#include "lib/render/compose/environment_behind.hpp"
#include "lib/render/factory.hpp"
#include "lib/render/mesh/mesh_renderer.hpp"

namespace stx {
namespace {

/// The renderer of a model that outlives it.
Result<std::unique_ptr<Renderer>> borrow(const Model& model, const RenderSettings& settings,
                                         Backend backend, int device, Job& job) {
    if (const auto* bundle = std::get_if<Bundle>(&model))
        return makeRenderer(backend, *bundle, settings, device, job);
    if (const auto* atlas = std::get_if<Atlas>(&model))
        return makeRenderer(backend, *atlas, settings, device, job);
    const auto& mesh = std::get<Mesh>(model);
    STX_CHECK(mesh.check());
    STX_CHECK(settings.check());
    auto renderer = makeMeshRenderer(mesh, settings, job);
    if (settings.environment) renderer = withEnvironment(std::move(renderer), settings.environment);
    return renderer;
}

constexpr double kWhite16 = 65535;

/// sRGB codes of 16 bits, as floats of 0..1.
RgbaFloatImage codes16From(const RgbaFloatImage& linear) {
    RgbaFloatImage codes(linear.width(), linear.height());
    const auto code = [](float v) {
        constexpr auto kWhite = static_cast<float>(kWhite16);
        return std::round(kWhite * std::clamp(v, 0.0f, 1.0f)) / kWhite;
    };
    parallelFor(0, linear.height(), 16, [&](int y) {
        for (int x = 0; x < linear.width(); ++x) {
            const glm::vec4 c = linear.at(x, y);
            codes.at(x, y) = {code(srgbFromLinear(c.r)), code(srgbFromLinear(c.g)),
                              code(srgbFromLinear(c.b)), code(c.a)};
        }
    });
    return codes;
}

RgbaFloatImage spread(const Rgba8Image& coded) {
    RgbaFloatImage codes(coded.width(), coded.height());
    for (std::size_t i = 0; i < codes.count(); ++i)
        codes.data()[i] = glm::vec4(coded.data()[i]) / 255.0f;
    return codes;
}

/// A renderer together with what it draws from.
class KeptRenderer final : public Renderer {
  public:
    explicit KeptRenderer(std::shared_ptr<const Model> model) : model_(std::move(model)) {}

    Result<void> make(const RenderSettings& settings, Backend backend, int device, Job& job) {
        STX_TRY(renderer_, borrow(*model_, settings, backend, device, job));
        return {};
    }

    Result<Frame> render(const Camera& camera) override { return renderer_->render(camera); }
    void expect(const Camera& next) override { renderer_->expect(next); }
    void lightFrom(const std::optional<Camera>& pose) override { renderer_->lightFrom(pose); }
    void reuse(Frame&& frame) override { renderer_->reuse(std::move(frame)); }
    std::string backend() const override { return renderer_->backend(); }
    std::string device() const override { return renderer_->device(); }

  private:
    std::shared_ptr<const Model> model_;
    std::unique_ptr<Renderer> renderer_;
};

}  // namespace

Result<std::unique_ptr<Renderer>> rendererOf(Model model, const RenderSettings& settings, Job& job,
                                             Backend backend, int device) {
    return rendererOf(std::make_shared<const Model>(std::move(model)), settings, job, backend,
                      device);
}

Result<std::unique_ptr<Renderer>> rendererOf(std::shared_ptr<const Model> model,
                                             const RenderSettings& settings, Job& job,
                                             Backend backend, int device) {
    auto renderer = std::make_unique<KeptRenderer>(std::move(model));
    STX_CHECK(renderer->make(settings, backend, device, job));
    return renderer;
}

Result<Frame> render(const Model& model, const Camera& camera, const RenderSettings& settings,
                     Job& job) {
    STX_CHECK(camera.check());
    STX_CHECK(job.limits.checkAllocation(static_cast<std::uint64_t>(camera.width) * camera.height,
                                         64, "the picture"));
    STX_TRY(const auto renderer, borrow(model, settings, Backend::automatic, -1, job));
    return renderer->render(camera);
}

Result<Picture> openPicture(const std::filesystem::path& path, Job& job) {
    STX_TRY(const auto bytes, readFile(path, job.limits));
    Picture picture;
    std::string colours;  // what is to be said of them
    if (photos::isHeif(bytes)) {
        STX_TRY(picture.coded, photos::decodeAsShown(bytes, path.string(), job.limits, colours));
        if (!colours.empty()) job.note(colours);
        return picture;
    }
    noteMorePictures(bytes, path.string(), job);
    if (const auto info = probeImage(bytes); info && !(info->format == "png" && info->bits > 8)) {
        STX_TRY(picture.coded, photos::decodeAsShown(bytes, path.string(), job.limits, colours));
        if (!colours.empty()) job.note(fmt::format("{}: {}", inQuotes(path.string()), colours));
        return picture;
    }
    STX_TRY(auto decoded, decodeImage(bytes, path.string(), job.limits));
    colours = toRec709(decoded);
    const auto pixels = static_cast<std::uint64_t>(decoded.width) * decoded.height;
    const std::uint64_t bytesEach =
        static_cast<std::uint64_t>(decoded.channels) * decoded.bits() / 8;
    RgbaFloatImage& floats = decoded.linear ? picture.linear : picture.fine;
    const bool wanted = decoded.bits() > 8;
    STX_CHECK(
        within(inQuotes(path.string()),
               job.limits.checkAllocation(pixels, bytesEach + (wanted ? 20 : 4), "the picture")));
    picture.pictures = decoded.pictures;
    for (const std::string& name : decoded.channelNames)
        if (name != "R" && name != "G" && name != "B" && name != "A" && name != "Y")
            picture.others.push_back(name);
    if (wanted) floats = photos::srgbFloatFrom(decoded, bytes, colours);
    picture.coded = photos::srgb8From(decoded, bytes, colours);
    if (!colours.empty()) job.note(fmt::format("{}: {}", inQuotes(path.string()), colours));
    const int orientation = readExif(bytes).orientation;
    if (wanted) floats = turnedUpright(std::move(floats), orientation);
    picture.coded = turnedUpright(std::move(picture.coded), orientation);
    return picture;
}

PicturePair::PicturePair(const Picture& a, const Picture& b) : a_(a), b_(b) {
    linear_ = a.isLinear() && b.isLinear();
    if (linear_) {
        first_ = &a.linear;
        second_ = &b.linear;
    } else if (!(a.fine.empty() && b.fine.empty())) {
        const auto codes = [&](const Picture& picture) {
            if (!picture.fine.empty()) return &picture.fine;
            made_ = picture.isLinear() ? codes16From(picture.linear) : spread(picture.coded);
            return &std::as_const(made_);
        };
        first_ = codes(a);
        second_ = codes(b);
    }
}

CompareSettings PicturePair::settings(CompareSettings asked) const {
    if (linear_)
        for (int c = 0; c < 3; ++c) asked.background[c] = linearFromSrgb(asked.background[c]);
    return asked;
}

Result<Rgba8Image> PicturePair::errorPicture(const CompareSettings& asked, double gain) const {
    const CompareSettings own = settings(asked);
    if (!first_) return stx::errorPicture(a_.coded, b_.coded, own, gain);
    return stx::errorPicture(*first_, *second_, own, gain);
}

double inCodes16(double difference) {
    return std::round(100 * kWhite16 * difference) / 100;
}

Picture pictureOf(const Frame& frame, const std::optional<glm::vec3>& background) {
    return {rgba8From(frame, background)};
}

Result<void> save(const Frame& frame, const std::filesystem::path& target,
                  const PictureOptions& options, Job& job) {
    STX_CHECK(job.checkCancelled());
    if (target == "-")
        return fail(ErrorCode::usage,
                    "'-' is standard output, which is the program's; a name that ends in .png, "
                    ".jpg, .tif, .webp or .exr is expected");
    if (options.jpegQuality < 1 || options.jpegQuality > 100)
        return fail(ErrorCode::usage, "the quality of JPEG is {}; 1 to 100 is expected",
                    options.jpegQuality);
    if (options.background) STX_CHECK(metrics::checkBackground(*options.background));
    FrameOptions file;
    file.background = options.background;
    file.jpegQuality = options.jpegQuality;
    file.noClobber = options.noClobber;
    file.camera = options.camera;
    file.origin = options.origin;
    return writeFrame(frame, target, file);
}

Result<Comparison> compare(const Picture& a, const Picture& b, const CompareSettings& settings,
                           Job& job) {
    STX_CHECK(job.checkCancelled());
    // As it was given: the floats have it in linear light.
    STX_CHECK(metrics::checkBackground(settings.background));
    // A picture of floats or of 16 bits makes one of the other, too.
    const auto isWide = [](const Picture& picture) {
        return picture.isLinear() || !picture.fine.empty();
    };
    STX_CHECK(checkPeak(isWide(a) || isWide(b) ? peak::kComparedLinear : peak::kCompared,
                        std::max({a.coded.count(), a.linear.count(), a.fine.count()}), 0, 0,
                        job.limits));
    const PicturePair pair(a, b);
    if (a.isLinear() != b.isLinear()) {
        const int bits = pair.codes16() ? 16 : 8;
        job.note(fmt::format(
            "one picture is linear float, the other {}-bit: both are compared as {}-bit sRGB", bits,
            bits));
    }
    const CompareSettings own = pair.settings(settings);
    if (!pair.first()) return compare(a.coded, b.coded, own, &job);
    STX_TRY(auto found, compare(*pair.first(), *pair.second(), own, &job));
    if (pair.codes16()) {
        found.worst.difference = inCodes16(found.worst.difference);
        found.white = kWhite16;
    }
    return found;
}

}  // namespace stx
