#include <algorithm>
#include <initializer_list>

#include "formats/any/open.hpp"
#include "formats/any/sequences.hpp"
#include "formats/environment/environment_files.hpp"
#include "formats/images/frames.hpp"
#include "formats/panorama/panorama_files.hpp"
#include "lib/environment/environment_map.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// Level of compression: panoramas are large. Level 2 takes more than twice the time for files that
/// are a twentieth smaller.
constexpr int kPngLevel = 1;

Result<void> writeEquirectangular(const Rgba8Image& panorama, const fs::path& path,
                                  const PanoramaWriteOptions& options) {
    FrameOptions frame;
    frame.noClobber = options.noClobber;
    frame.jpegQuality = options.jpegQuality;
    frame.pngLevel = kPngLevel;
    const std::string ending = path.extension().string();
    if (ending.size() < 2 || (ending[1] != 'j' && ending[1] != 'J'))
        return writePicture(panorama, path, frame);
    // JPEG has no alpha: black where no picture looked.
    Rgba8Image opaque = panorama;
    for (auto& p : opaque.pixels())
        p = glm::u8vec4(glm::vec3(p) * (static_cast<float>(p.a) / 255.0f) + 0.5f, 255);
    return writePicture(opaque, path, frame);
}

std::shared_ptr<Environment> environmentOf(Rgba8Image panorama) {
    auto environment = std::make_shared<Environment>();
    environment->layout = Environment::Layout::equirectangular;
    environment->pictures.emplace_back(std::move(panorama));
    return environment;
}

}  // namespace

PanoramaFormat panoramaFormat(const fs::path& path) {
    std::string ending = path.extension().string();
    for (char& c : ending)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    const auto is = [&](std::initializer_list<const char*> endings) {
        return std::find(endings.begin(), endings.end(), ending) != endings.end();
    };
    if (path == "-" || is({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp"}))
        return PanoramaFormat::picture;
    if (ending == ".exr") return PanoramaFormat::exr;
    if (is({".mp4", ".bt", ".xmt"})) return PanoramaFormat::scene;
    return PanoramaFormat::folder;
}

int panoramaFaceSize(const fs::path& path, int width, int faceSize) {
    const PanoramaFormat format = panoramaFormat(path);
    if (format == PanoramaFormat::picture) return 0;
    return faceSize > 0 || format == PanoramaFormat::exr ? faceSize : std::max(1, width / 4);
}

Result<void> writePanorama(PanoramaImage panorama, const fs::path& path,
                           const PanoramaWriteOptions& options, Job& job) {
    if (panoramaFormat(path) == PanoramaFormat::picture)
        return writeEquirectangular(panorama.pixels, path, options);
    EnvironmentSaveOptions save;
    save.faceSize = panoramaFaceSize(path, panorama.width(), options.faceSize);
    save.noClobber = options.noClobber;
    return saveEnvironment(*environmentOf(std::move(panorama.pixels)), path, save, job);
}

Result<void> writePanoramaInto(PanoramaImage panorama, const fs::path& bundle, const fs::path& path,
                               const PanoramaWriteOptions& options, Job& job) {
    STX_TRY(auto frames, openSequence(bundle, {}, job));
    auto environment = environmentOf(std::move(panorama.pixels));
    if (options.faceSize > 0)
        STX_SET(*environment, asCube(*environment, options.faceSize, job.limits));
    frames = changed(std::move(frames), [environment](Bundle& frame, Job&) -> Result<void> {
        frame.environment = environment;
        return {};
    });
    SaveOptions save;
    save.noClobber = options.noClobber;
    return saveSequence(*frames, path, save, job);
}

}  // namespace stx
