#include "formats/environment/environment_files.hpp"

#include <algorithm>
#include <cstring>

#include "formats/exr/environment_exr.hpp"
#include "formats/files/named_files.hpp"
#include "formats/files/not_there.hpp"
#include "formats/images/exif.hpp"
#include "formats/images/images.hpp"
#include "formats/mpeg4/mapping/background.hpp"
#include "formats/mpeg4/mapping/texture_images.hpp"
#include "formats/mpeg4/mpeg4.hpp"
#include "formats/photos/file_colours.hpp"
#include "formats/photos/photo.hpp"
#include "lib/environment/environment_map.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFileInFolder = "environment.exr";

std::string lower(std::string text) {
    for (char& c : text)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
    return text;
}

Result<Texture> readPicture(const fs::path& path, Job& job) {
    STX_TRY(const auto bytes, readFile(path, job.limits));
    if (photos::isHeif(bytes)) {
        std::string colours;
        STX_TRY(auto shown, photos::decodeAsShown(bytes, path.string(), job.limits, colours));
        if (!colours.empty()) job.note(colours);
        return Texture(std::move(shown));
    }
    STX_TRY(auto decoded, decodeImage(bytes, path.string(), job.limits));
    if (auto* light = std::get_if<std::vector<float>>(&decoded.values); light && decoded.linear)
        makeFinite(*light, decoded.channelNames, fmt::format("'{}'", path.string()), job);
    if (const std::string note = toRec709(decoded); !note.empty()) job.note(note);
    if (decoded.bits() == 16) job.note("16-bit colour is read as 8 bits");
    const int orientation = readExif(bytes).orientation;
    if (decoded.linear) return Texture(turnedUpright(rgbaFloatFrom(decoded), orientation));
    std::string note;
    Texture picture(turnedUpright(photos::srgb8From(decoded, bytes, note), orientation));
    if (!note.empty()) job.note(note);
    return picture;
}

/// The file of each face in a folder; empty where there is none.
Result<std::array<fs::path, 6>> faceFiles(const fs::path& folder) {
    std::array<fs::path, 6> files;
    std::error_code ec;
    std::vector<fs::path> entries;
    for (fs::directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec))
        if (it->is_regular_file(ec)) entries.push_back(it->path());
    std::ranges::sort(entries);
    for (const fs::path& entry : entries) {
        const std::string stem = lower(entry.stem().string());
        const std::string ending = lower(entry.extension().string());
        static constexpr std::array kEndings = {".png", ".jpg",  ".jpeg", ".exr",
                                                ".tif", ".tiff", ".webp", ".hdr"};
        if (std::ranges::find(kEndings, ending) == kEndings.end()) continue;
        for (std::size_t f = 0; f < 6; ++f) {
            const std::string name = kCubeFaceNames[f];
            if (stem != name && !stem.ends_with("_" + name)) continue;
            if (!files[f].empty())
                return failAt(fmt::format("'{}'", folder.string()), ErrorCode::invalidInput,
                              "both '{}' and '{}' could be the face {}; leave one",
                              files[f].filename().string(), entry.filename().string(), name);
            files[f] = entry;
        }
    }
    return files;
}

Result<std::shared_ptr<const Environment>> openFolder(const fs::path& folder, Job& job) {
    std::error_code ec;
    if (fs::exists(folder / kFileInFolder, ec)) {
        rememberNamedFile(folder / kFileInFolder);
        return readEnvironmentExr(folder / kFileInFolder, job);
    }
    STX_TRY(const auto files, faceFiles(folder));
    const std::string where = fmt::format("'{}'", folder.string());
    auto environment = std::make_shared<Environment>();
    environment->pictures.resize(6);
    std::string missing;
    for (std::size_t f = 0; f < 6; ++f) {
        STX_CHECK(job.checkCancelled());
        if (files[f].empty()) {
            missing += (missing.empty() ? "" : ", ") + std::string(kCubeFaceNames[f]);
            continue;
        }
        rememberNamedFile(files[f]);
        STX_TRY(Texture picture, readPicture(files[f], job));
        if (picture.width() != picture.height())
            return failAt(fmt::format("'{}'", files[f].string()), ErrorCode::invalidInput,
                          "it has {}x{} pixels; a face of an environment is square",
                          picture.width(), picture.height());
        environment->pictures[f] = std::move(picture);
    }
    if (environment->pictureCount() == 0)
        return failAt(where, ErrorCode::invalidInput,
                      "it holds no environment: pictures named front, back, left, right, top and "
                      "bottom, or {}, are expected",
                      kFileInFolder);
    if (!missing.empty())
        job.note(fmt::format("{}: faces without a picture show nothing: {}", where, missing));
    STX_CHECK(within(where, environment->check()));
    int least = job.limits.maxImageSide, most = 0;
    for (const Texture& picture : environment->pictures) {
        if (picture.empty()) continue;
        least = std::min(least, picture.width());
        most = std::max(most, picture.width());
    }
    if (least < most)
        job.note(
            fmt::format("{}: its faces differ in size, from {} to {} pixels; each is kept as "
                        "it is",
                        where, least, most));
    return std::shared_ptr<const Environment>(std::move(environment));
}

Result<std::shared_ptr<const Environment>> openScene(const fs::path& path, Job& job) {
    STX_TRY(const auto document, readMpeg4(path, job));
    mpeg4::SceneReadOptions options;
    options.folder = folderOf(path);
    STX_TRY(auto environment, within(fmt::format("'{}'", path.string()),
                                     mpeg4::environmentFromScene(document, options, job)));
    if (!environment)
        return failAt(fmt::format("'{}'", path.string()), ErrorCode::invalidInput,
                      "the scene has no Background, so no environment");
    return environment;
}

bool isExrFile(ByteSpan head) {
    static constexpr unsigned char kMagic[] = {0x76, 0x2f, 0x31, 0x01};
    return head.size() >= 4 && std::memcmp(head.data(), kMagic, 4) == 0;
}

Rgba8Image codedPicture(const Texture& picture, Job& job) {
    bool clamped = false;
    auto coded = mpeg4::rgba8FromTexture(picture, clamped);
    Rgba8Loss{.linear = picture.isLinear(), .clipped = clamped}.note(job);
    return coded;
}

Result<Bytes> encoded(const Rgba8Image& image, int jpegQuality, Job& job) {
    const bool solid = isOpaque(Texture(image));
    if (jpegQuality == 0) return mpeg4::colourPng(image, !solid);
    if (!solid) job.note("JPEG has no alpha: what the environment does not show is black");
    Rgba8Image opaque = image;
    for (glm::u8vec4& p : opaque.pixels())
        p = glm::u8vec4(glm::vec4(glm::vec3(p) * (static_cast<float>(p.a) / 255.0f), 255.0f) +
                        glm::vec4(0.5f, 0.5f, 0.5f, 0.0f));
    return mpeg4::colourJpeg(opaque, jpegQuality);
}

Result<void> saveFaces(const Environment& environment, const fs::path& target,
                       const EnvironmentSaveOptions& options, Job& job) {
    STX_TRY(const Environment flat, flattened(environment, job.limits));
    STX_TRY(const Environment cube,
            asCube(flat, options.faceSize > 0 ? options.faceSize : cubeSizeOf(flat), job.limits));
    std::vector<std::string> names;
    for (const char* face : kCubeFaceNames)
        for (const char* ending : {"png", "jpg"})
            names.push_back(fmt::format("{}.{}", face, ending));
    STX_TRY(auto folder, OutputFolder::create(target, {.noClobber = options.noClobber}, names));
    for (std::size_t f = 0; f < 6; ++f) {
        STX_CHECK(job.checkCancelled());
        if (cube.pictures[f].empty()) continue;
        STX_TRY(const auto bytes,
                encoded(codedPicture(cube.pictures[f], job), options.jpegQuality, job));
        STX_CHECK(writeFile(
            folder.temporaryPath() /
                fmt::format("{}.{}", kCubeFaceNames[f], options.jpegQuality > 0 ? "jpg" : "png"),
            bytes));
    }
    return folder.commit();
}

}  // namespace

Result<std::shared_ptr<const Environment>> openEnvironment(const fs::path& path, Job& job) {
    std::error_code ec;
    const std::string where = fmt::format("'{}'", path.string());
    if (!fs::exists(path, ec)) return failAt(where, ErrorCode::io, "{}", whyNotThere(path));
    if (fs::is_directory(path, ec)) return openFolder(path, job);
    STX_TRY(auto source, ByteSource::open(path));
    Bytes head(static_cast<std::size_t>(std::min<std::uint64_t>(source.size(), 4096)));
    STX_CHECK(within(where, source.read(0, head)));
    if (isExrFile(head)) return readEnvironmentExr(path, job);
    // HEIC begins as an MP4 does.
    const bool scene = mpeg4ContainerOf(ByteSpan(head)) || mpeg4ContainerOf(path);
    if (scene && !photos::isHeif(head)) return openScene(path, job);
    STX_TRY(Texture picture, readPicture(path, job));
    if (picture.width() != 2 * picture.height())
        return failAt(where, ErrorCode::invalidInput,
                      "it has {}x{} pixels; a picture all around is twice as wide as high (six "
                      "faces are a folder with front, back, left, right, top and bottom in it)",
                      picture.width(), picture.height());
    auto environment = std::make_shared<Environment>();
    environment->layout = Environment::Layout::equirectangular;
    environment->pictures.push_back(std::move(picture));
    return std::shared_ptr<const Environment>(std::move(environment));
}

Result<void> saveEnvironment(const Environment& environment, const fs::path& target,
                             const EnvironmentSaveOptions& options, Job& job) {
    STX_CHECK(environment.check());
    if (options.faceSize < 0 || options.faceSize > job.limits.maxImageSide)
        return fail(ErrorCode::usage, "faces of {} pixels; 1 to {} are possible", options.faceSize,
                    job.limits.maxImageSide);
    if (options.jpegQuality < 0 || options.jpegQuality > 100)
        return fail(ErrorCode::usage,
                    "the quality of JPEG is {}; 1 to 100, or 0 (PNG), is expected",
                    options.jpegQuality);
    const OutputFile::Options output{.noClobber = options.noClobber};
    const std::string ending = lower(target.extension().string());
    if (ending.empty()) return saveFaces(environment, target, options, job);
    Environment sized = environment;
    if (options.faceSize > 0) STX_SET(sized, asCube(environment, options.faceSize, job.limits));
    if (ending == ".exr") return writeEnvironmentExr(sized, target, job, output);
    if (mpeg4ContainerOf(target)) {
        mpeg4::SceneWriteOptions scene;
        if (options.jpegQuality > 0) {
            scene.texture = mpeg4::SceneWriteOptions::Texture::jpeg;
            scene.jpegQuality = options.jpegQuality;
        }
        STX_TRY(const auto document, mpeg4::sceneFromEnvironment(sized, scene, job));
        Mpeg4WriteOptions write;
        write.output = output;
        return writeMpeg4(document, target, job, write);
    }
    const bool jpeg = ending == ".jpg" || ending == ".jpeg";
    if (!jpeg && ending != ".png")
        return fail(ErrorCode::usage,
                    "'{}' ends in '{}'; an environment is written as .png, .jpg, .exr, .mp4, .bt, "
                    ".xmt, or into a folder (no ending)",
                    target.string(), ending);
    STX_TRY(const Environment flat, flattened(environment, job.limits));
    const glm::ivec2 size = equirectangularSizeOf(flat);
    STX_TRY(const Environment around, asEquirectangular(flat, size.x, size.y, job.limits));
    const int quality = options.jpegQuality > 0 ? options.jpegQuality : 92;
    STX_TRY(const auto bytes,
            encoded(codedPicture(around.pictures.at(0), job), jpeg ? quality : 0, job));
    return writeFile(target, bytes, output);
}

}  // namespace stx
