#include <algorithm>
#include <array>
#include <cmath>

#include "formats/exr/exr_file.hpp"
#include "formats/images/frames.hpp"
#include "formats/images/images.hpp"
#include "formats/panorama/panorama_files.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/srgb8.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// Level of compression: panoramas are large, and higher levels take longer than all else.
constexpr int kPngLevel = 2;

/// Premultiplied linear light in a direction.
glm::vec4 lightAt(const PanoramaImage& panorama, glm::dvec3 direction) {
    const glm::vec4 c = panorama.sample(direction);
    if (c.a <= 0) return c;
    return {linearByTable(c.r / c.a) * c.a, linearByTable(c.g / c.a) * c.a,
            linearByTable(c.b / c.a) * c.a, c.a};
}

/// Our direction of one in OpenEXR's axes.
glm::dvec3 fromExr(glm::dvec3 d) {
    return {-d.x, d.y, -d.z};
}

/// The direction of a pixel of an environment map in OpenEXR's axes (ImfEnvmap.h).
glm::dvec3 latLongDirection(int x, int y, int width, int height) {
    const double longitude = M_PI * (1 - 2.0 * x / std::max(1, width - 1));
    const double latitude = M_PI * (0.5 - static_cast<double>(y) / std::max(1, height - 1));
    return {std::cos(latitude) * std::sin(longitude), std::sin(latitude),
            std::cos(latitude) * std::cos(longitude)};
}

glm::dvec3 cubeDirection(int x, int y, int size) {
    // +X -X +Y -Y +Z -Z, one below the other: as the faces of VRML97 of the same names.
    constexpr std::array<PanoramaFace, 6> kFaces = {PanoramaFace::right, PanoramaFace::left,
                                                    PanoramaFace::top,   PanoramaFace::bottom,
                                                    PanoramaFace::back,  PanoramaFace::front};
    const double last = std::max(1, size - 1);
    return panoramaFaceDirection(kFaces[static_cast<std::size_t>(y / size)],
                                 {x / last, y % size / last});
}

Result<void> writeEnvmap(const PanoramaImage& panorama, const fs::path& path,
                         const PanoramaWriteOptions& options, Job& job) {
    const bool cube = options.faceSize > 0;
    const int width = cube ? options.faceSize : panorama.width();
    const int height = cube ? 6 * options.faceSize : panorama.height();
    ExrPart part;
    part.width = part.displayWidth = width;
    part.height = part.displayHeight = height;
    part.attributes["envmap"] = std::int64_t{cube ? 1 : 0};
    const char* rgba[] = {"R", "G", "B", "A"};
    for (const char* c : rgba) part.channels.push_back({c, ExrChannel::Type::half});
    STX_TRY(auto file, OutputFile::create(path, {.noClobber = options.noClobber}));
    STX_TRY(auto writer, ExrWriter::create(file, {part}));
    Image<glm::vec4> light;
    STX_CHECK(writer.writePart(0, [&](int top, int rows) {
        light = Image<glm::vec4>(width, rows);
        parallelFor(0, rows, [&](std::int64_t row) {
            const auto y = static_cast<int>(row);
            for (int x = 0; x < width; ++x)
                light.at(x, y) =
                    lightAt(panorama, fromExr(cube ? cubeDirection(x, top + y, width)
                                                   : latLongDirection(x, top + y, width, height)));
        });
        job.progress(top + rows, height, "writing");
        std::vector<ExrConstPixels> pixels;
        for (int c = 0; c < 4; ++c) pixels.push_back({rgba[c], &light.data()->x + c, 4});
        return pixels;
    }));
    STX_CHECK(writer.finish());
    return file.commit();
}

int faceSizeOf(const PanoramaImage& panorama, const PanoramaWriteOptions& options) {
    return options.faceSize > 0 ? options.faceSize : std::max(1, panorama.width() / 4);
}

Result<void> writeFaces(const PanoramaImage& panorama, const fs::path& path,
                        const PanoramaWriteOptions& options, Job& job) {
    const int size = faceSizeOf(panorama, options);
    const auto faces = panoramaFaces(panorama, size).pictures;
    std::vector<std::string> names;
    for (const char* face : kPanoramaFaceNames) names.push_back(std::string(face) + ".png");
    STX_TRY(auto folder, OutputFolder::create(path, {.noClobber = options.noClobber}, names));
    for (std::size_t f = 0; f < faces.size(); ++f) {
        STX_CHECK(job.checkCancelled());
        STX_TRY(const auto png, encodePng(size, size, 4, 8, faces[f].data(), true, kPngLevel));
        STX_CHECK(writeFile(folder.temporaryPath() / names[f], png));
        job.progress(static_cast<std::int64_t>(f) + 1, 6, "writing faces");
    }
    return folder.commit();
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

Result<void> checkPanoramaFormat(const fs::path& path) {
    if (panoramaFormat(path) != PanoramaFormat::scene) return {};
    return fail(
        ErrorCode::unsupported,
        "a panorama is not yet written as a scene's Background ('{}'); .png, .jpg, .tif, .exr "
        "and folders are possible",
        path.string());
}

Result<void> writePanorama(const PanoramaImage& panorama, const fs::path& path,
                           const PanoramaWriteOptions& options, Job& job) {
    switch (panoramaFormat(path)) {
        case PanoramaFormat::exr:
            return writeEnvmap(panorama, path, options, job);
        case PanoramaFormat::folder:
            return writeFaces(panorama, path, options, job);
        case PanoramaFormat::scene:
            return writePanoramaScene(panoramaFaces(panorama, faceSizeOf(panorama, options)), path,
                                      options, job);
        case PanoramaFormat::picture:
            break;
    }
    FrameOptions frame;
    frame.noClobber = options.noClobber;
    frame.jpegQuality = options.jpegQuality;
    frame.pngLevel = kPngLevel;
    const std::string ending = path.extension().string();
    if (ending.size() < 2 || (ending[1] != 'j' && ending[1] != 'J'))
        return writePicture(panorama.pixels, path, frame);
    // JPEG has no alpha: black where no picture looked.
    Rgba8Image opaque = panorama.pixels;
    for (auto& p : opaque.pixels())
        p = glm::u8vec4(glm::vec3(p) * (static_cast<float>(p.a) / 255.0f) + 0.5f, 255);
    return writePicture(opaque, path, frame);
}

}  // namespace stx
