#include "formats/meshes/meshes.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "formats/files/deflate.hpp"
#include "formats/files/text_encoding.hpp"
#include "formats/images/images.hpp"
#include "formats/images/more_pictures.hpp"
#include "formats/meshes/readers.hpp"
#include "formats/meshes/vertex_colours.hpp"

namespace stx {
namespace {

enum class Format { none, gltf, glb, obj, ply, stl, draco, off, dae, fbx, spz };

std::string lowerCase(std::string text) {
    for (auto& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return text;
}

/// What the first bytes say for sure.
Format formatOfBytes(ByteSpan head) {
    auto text = textOf(head);
    if (text.starts_with("glTF")) return Format::glb;
    if (text.starts_with("DRACO")) return Format::draco;
    if (text.starts_with("Kaydara FBX Binary")) return Format::fbx;
    if (text.starts_with("ply") && text.size() > 3 &&
        (text[3] == '\n' || text[3] == '\r' || text[3] == ' '))
        return Format::ply;
    return Format::none;
}

bool isPacked(const std::filesystem::path& path) {
    return lowerCase(path.extension().string()) == ".gz";
}

Format formatOfEnding(const std::filesystem::path& path) {
    const auto ending = lowerCase((isPacked(path) ? path.stem() : path).extension().string());
    if (ending == ".gltf") return Format::gltf;
    if (ending == ".glb") return Format::glb;
    if (ending == ".obj") return Format::obj;
    if (ending == ".ply") return Format::ply;
    if (ending == ".stl") return Format::stl;
    if (ending == ".drc") return Format::draco;
    if (ending == ".off") return Format::off;
    if (ending == ".dae") return Format::dae;
    if (ending == ".fbx") return Format::fbx;
    if (ending == ".spz") return Format::spz;
    return Format::none;
}

/// For files without a telling ending: JSON with an asset, ASCII STL.
Format formatOfText(ByteSpan head) {
    const auto text = lowerCase(std::string(textOf(head)));
    const auto first = text.find_first_not_of(" \t\r\n");
    if (first != std::string_view::npos && text[first] == '{' &&
        text.find("\"asset\"") != std::string_view::npos)
        return Format::gltf;
    if (text.starts_with("solid ") && text.find("facet") != std::string_view::npos)
        return Format::stl;
    return Format::none;
}

Format formatOf(const std::filesystem::path& path, ByteSpan head) {
    if (const auto format = formatOfBytes(head); format != Format::none) return format;
    if (const auto format = formatOfEnding(path); format != Format::none) return format;
    return formatOfText(head);
}

/// The picture that belongs to an OBJ without materials: the only image in its folder whose name
/// begins with the same word (spot_texture.png for spot_triangulated.obj).
std::filesystem::path textureBeside(const std::filesystem::path& model) {
    const auto firstWord = [](const std::filesystem::path& p) {
        const auto stem = lowerCase(p.stem().string());
        return stem.substr(0, stem.find_first_of("_-. "));
    };
    const auto word = firstWord(model);
    if (word.size() < 3) return {};
    std::filesystem::path found;
    std::error_code error;
    for (std::filesystem::directory_iterator
             it(model.parent_path().empty() ? "." : model.parent_path(), error),
         end;
         !error && it != end; it.increment(error)) {
        const auto ending = lowerCase(it->path().extension().string());
        const bool isImage = ending == ".png" || ending == ".jpg" || ending == ".jpeg" ||
                             ending == ".tga" || ending == ".bmp" || ending == ".webp" ||
                             ending == ".tif" || ending == ".tiff";
        std::error_code ignored;
        if (!isImage || firstWord(it->path()) != word || !it->is_regular_file(ignored)) continue;
        if (!found.empty()) return {};
        found = it->path();
    }
    return found;
}

/// A picture that a model gets as its base colour texture.
struct Picture {
    std::string name;  ///< without its folder
    Bytes file;
    Rgba8Image pixels;
};

Result<Picture> readPicture(const std::filesystem::path& path, const Limits& limits) {
    Picture picture;
    picture.name = path.filename().string();
    STX_SET(picture.file, readFile(path, limits));
    STX_SET(picture.pixels, within(fmt::format("'{}'", path.string()),
                                   decodeRgba8(picture.file, picture.name, limits)));
    return picture;
}

/// Puts it where readers kept places for it (ModelFiles::replacesColour()).
Result<void> putPicture(const Picture& picture, Mesh& mesh, Job& job) {
    noteMorePictures(picture.file, picture.name, job);
    std::set<int> places;
    for (const auto& material : mesh.materials)
        if (material.baseColourTexture >= 0) places.insert(material.baseColourTexture);
    STX_CHECK(job.limits.checkAllocation(places.size() * picture.pixels.count(),
                                         sizeof(glm::u8vec4), "the copies of the texture"));
    for (const int place : places)
        mesh.textures[static_cast<std::size_t>(place)].pixels = picture.pixels;
    return {};
}

/// A model of which nobody says what colour it has is grey: white without shadows is a flat shape.
void giveGrey(Mesh& mesh, Job& job) {
    const bool hasColour =
        mesh.splats || !mesh.colours.empty() ||
        std::any_of(mesh.materials.begin(), mesh.materials.end(), [](auto& m) {
            return m.hasColour || m.baseColourTexture >= 0 || m.emissive != glm::vec3(0.0f);
        });
    if (hasColour) return;
    const glm::vec3 grey(kPlainGrey);
    for (auto& m : mesh.materials) m.baseColour = glm::vec4(grey, m.baseColour.a);
    // Loose points have no material.
    if (!mesh.points.empty()) mesh.colours.assign(mesh.positions.size(), glm::vec4(1.0f));
    for (const auto p : mesh.points) mesh.colours[p] = glm::vec4(grey, 1.0f);
    job.note(
        "the model has no colour: it is drawn in plain grey; lights show its form (stx render "
        "--light dir:-1,-1,-1)");
}

Result<Mesh> readFormat(Format format, ByteSpan bytes, const std::string& name, ModelFiles& files) {
    if (format == Format::glb && !textOf(bytes).starts_with("glTF"))
        return fail(
            ErrorCode::invalidInput,
            "a GLB file begins with 'glTF'; this one does not, so it is another kind of file");
    switch (format) {
        case Format::gltf:
        case Format::glb:
            return readGltf(bytes, files);
        case Format::draco:
            return readDraco(bytes, files);
        case Format::obj:
            return readWithAssimp(bytes, AssimpFormat::obj, name, files);
        case Format::ply:
            return readPly(bytes, files);
        case Format::stl:
            return readWithAssimp(bytes, AssimpFormat::stl, name, files);
        case Format::off:
            return readOff(bytes, files);
        case Format::dae:
            return readWithAssimp(bytes, AssimpFormat::dae, name, files);
        case Format::fbx:
            return readWithAssimp(bytes, AssimpFormat::fbx, name, files);
        case Format::spz:
            return readSpz(bytes, files.job());
        case Format::none:
            break;
    }
    return fail(
        ErrorCode::invalidInput,
        "the file is not a model that is known here: glTF, GLB, OBJ, PLY, STL, OFF, COLLADA "
        "(.dae), FBX, Draco (.drc) or SPZ");
}

}  // namespace

bool isMesh(const std::filesystem::path& path, ByteSpan head) {
    return formatOf(path, head.first(std::min<std::size_t>(head.size(), 4096))) != Format::none;
}

Result<Mesh> readMesh(const std::filesystem::path& path, Job& job, const MeshOptions& options) {
    STX_TRY(auto bytes, readFile(path, job.limits));
    return readMesh(std::move(bytes), path, job, options);
}

Result<Mesh> readMesh(Bytes bytes, const std::filesystem::path& file, Job& job,
                      const MeshOptions& options) {
    const auto where = fmt::format("'{}'", file.string());
    std::filesystem::path path = file;
    if (isPacked(file) && isGzip(bytes)) {
        STX_TRY(bytes, within(where, gunzip(bytes, job.limits)));
        path.replace_extension();
    }
    if (bytes.empty())
        return failAt(where, ErrorCode::invalidInput, "the file is empty; expected a model");
    if (const auto ending = formatOfEnding(path);
        ending == Format::obj || ending == Format::gltf || ending == Format::dae) {
        STX_CHECK(job.limits.checkAllocation(bytes.size(), 3, "the text"));
        if (auto text = utf8FromMarked(bytes)) bytes = std::move(*text);
    }
    const auto format =
        formatOf(path, ByteSpan(bytes).first(std::min<std::size_t>(bytes.size(), 4096)));
    const bool given = !options.texture.empty();
    auto texture = options.texture;
    if (!given && format == Format::obj && path != "-" &&
        textOf(bytes).find("mtllib") == std::string_view::npos)
        texture = textureBeside(path);
    std::optional<Picture> picture;
    if (!texture.empty()) {
        auto found = readPicture(texture, job.limits);
        if (found)
            picture = std::move(*found);
        else if (given)
            return tl::unexpected(found.error());
    }

    const auto folder =
        path.parent_path().empty() || path == "-" ? std::filesystem::path(".") : path.parent_path();
    ModelFiles files(folder, job, picture.has_value(), options.materials);
    auto mesh = readFormat(format, bytes, path.filename().string(), files);
    if (!mesh) return tl::unexpected(mesh.error().at(where));
    if (picture && !mesh->uvs.empty()) {
        STX_CHECK(putPicture(*picture, *mesh, job));
        if (!given)
            job.note(
                fmt::format("the model names no material; '{}' beside it is taken as its texture",
                            picture->name));
    } else if (given) {
        return failAt(where, ErrorCode::usage,
                      "the model has no texture coordinates, so the texture '{}' cannot be put on "
                      "it",
                      options.texture.string());
    }
    giveGrey(*mesh, job);
    return mesh;
}

}  // namespace stx
