#include "formats/imagesets/colmap.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "formats/files/messages.hpp"
#include "formats/files/named_files.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/poses.hpp"
#include "formats/imagesets/text_lines.hpp"

namespace stx::imagesets {
namespace {

struct Model {
    const char* name;
    std::size_t parameters;
    bool known = true;  ///< it can be undone here
};
/// In the order of COLMAP's numbers.
constexpr Model kModels[] = {{"SIMPLE_PINHOLE", 3},
                             {"PINHOLE", 4},
                             {"SIMPLE_RADIAL", 4},
                             {"RADIAL", 5},
                             {"OPENCV", 8},
                             {"OPENCV_FISHEYE", 8},
                             {"FULL_OPENCV", 12, false},
                             {"FOV", 5, false},
                             {"SIMPLE_RADIAL_FISHEYE", 4},
                             {"RADIAL_FISHEYE", 5},
                             {"THIN_PRISM_FISHEYE", 12, false},
                             {"RAD_TAN_THIN_PRISM_FISHEYE", 16, false}};

Error unknownModel(const std::string& model, const std::string& where) {
    return failAt(
               where, ErrorCode::invalidInput,
               "the camera model is {}; SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV and "
               "those three with _FISHEYE are known (COLMAP's image_undistorter makes PINHOLE of "
               "the others)",
               model)
        .value();
}

/// A camera that matters only where an image was taken by it.
ColmapCamera unknownCamera(const std::string& model, const std::string& where) {
    ColmapCamera camera;
    camera.unknown = unknownModel(model, where);
    return camera;
}

Result<ColmapCamera> cameraOf(const std::string& model, double width, double height,
                              const std::vector<double>& p, const std::string& where) {
    ColmapCamera c;
    STX_TRY(c.width, imageSide(width, "WIDTH", 65535, where));
    STX_TRY(c.height, imageSide(height, "HEIGHT", 65535, where));
    const bool oneFocal = model.starts_with("SIMPLE") || model.starts_with("RADIAL");
    std::size_t at = 0;
    c.fx = p[at++];
    c.fy = oneFocal ? c.fx : p[at++];
    c.cx = p[at++];
    c.cy = p[at++];
    c.lens.fisheye = model.ends_with("_FISHEYE");
    if (!model.ends_with("PINHOLE")) c.lens.k1 = p[at++];
    if (model.starts_with("RADIAL") || model.starts_with("OPENCV")) c.lens.k2 = p[at++];
    if (model == "OPENCV") {
        c.lens.p1 = p[at++];
        c.lens.p2 = p[at++];
    }
    if (model == "OPENCV_FISHEYE") {
        c.lens.k3 = p[at++];
        c.lens.k4 = p[at++];
    }
    for (const double v : p)
        if (!std::isfinite(v))
            return failAt(where, ErrorCode::invalidInput, "a parameter is not finite");
    if (!(c.fx > 0 && c.fy > 0))
        return failAt(where, ErrorCode::invalidInput,
                      "the focal lengths are {:g} and {:g}; both must be above 0", c.fx, c.fy);
    return c;
}

/// Little-endian numbers one after the other.
class Reader {
  public:
    explicit Reader(ByteSpan bytes) : bytes_(bytes) {}
    [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
    [[nodiscard]] std::string where() const { return fmt::format("byte {}", at_); }
    [[nodiscard]] bool has(std::uint64_t count) const { return count <= left(); }
    std::uint64_t u(int size) {
        std::uint64_t v = 0;
        for (int i = 0; i < size; ++i) v |= static_cast<std::uint64_t>(bytes_[at_++]) << (8 * i);
        return v;
    }
    double number() { return std::bit_cast<double>(u(8)); }
    void skip(std::uint64_t count) { at_ += static_cast<std::size_t>(count); }
    /// Up to the next NUL; nothing when there is none.
    std::optional<std::string> text() {
        std::string out;
        while (at_ < bytes_.size()) {
            const char c = static_cast<char>(bytes_[at_++]);
            if (c == 0) return out;
            out += c;
        }
        return std::nullopt;
    }

  private:
    ByteSpan bytes_;
    std::size_t at_ = 0;
};

tl::unexpected<Error> cutShort(const Reader& in, const char* what, std::uint64_t index,
                               std::uint64_t count) {
    return failAt(in.where(), ErrorCode::invalidInput, "the file is cut short in {} {} of {}", what,
                  index, count);
}

Result<ColmapCameras> camerasFromText(std::string_view text, const Limits& limits) {
    ColmapCameras cameras;
    for (const TextLine& line : linesOf(text)) {
        const auto words = line.words();
        STX_TRY(const auto id, numbersOf(words, 0, 1, line.where()));
        if (!(id[0] >= 0 && id[0] < 4294967296.0))
            return failAt(line.where(), ErrorCode::invalidInput, "{:g} is not a camera's number",
                          id[0]);
        if (words.size() < 2)
            return failAt(line.where(), ErrorCode::invalidInput,
                          "'CAMERA_ID MODEL WIDTH HEIGHT PARAMS...' is expected");
        const std::string model(words[1]);
        const auto known = std::ranges::find_if(
            kModels, [&](const Model& m) { return m.known && model == m.name; });
        auto& camera = cameras[static_cast<std::uint32_t>(id[0])];
        if (known == std::end(kModels)) {
            camera = unknownCamera(model.substr(0, 40), line.where());
        } else {
            STX_TRY(const auto size, numbersOf(words, 2, 2, line.where()));
            STX_TRY(const auto p, numbersOf(words, 4, known->parameters, line.where()));
            STX_TRY(camera, cameraOf(model, size[0], size[1], p, line.where()));
        }
        STX_CHECK(checkViewCount(cameras.size(), limits, line.where()));
    }
    return cameras;
}

Result<ColmapCameras> camerasFromBinary(ByteSpan bytes, const Limits& limits) {
    Reader in(bytes);
    if (!in.has(8)) return cutShort(in, "the number", 0, 0);
    const std::uint64_t count = in.u(8);
    STX_CHECK(checkViewCount(count, limits, "byte 0"));
    ColmapCameras cameras;
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::string where = fmt::format("camera {} at byte {}", i, bytes.size() - in.left());
        if (!in.has(24)) return cutShort(in, "camera", i, count);
        const auto id = static_cast<std::uint32_t>(in.u(4));
        const std::uint64_t model = in.u(4);
        const std::uint64_t width = in.u(8), height = in.u(8);
        // How long it is is not known either.
        if (model >= std::size(kModels))
            return tl::unexpected(unknownModel(fmt::format("number {}", model), where));
        if (!kModels[model].known && !in.has(8 * kModels[model].parameters))
            return tl::unexpected(unknownModel(kModels[model].name, where));
        if (!in.has(8 * kModels[model].parameters)) return cutShort(in, "camera", i, count);
        std::vector<double> p(kModels[model].parameters);
        for (double& v : p) v = in.number();
        if (kModels[model].known)
            STX_SET(cameras[id], cameraOf(kModels[model].name, static_cast<double>(width),
                                          static_cast<double>(height), p, where));
        else
            cameras[id] = unknownCamera(kModels[model].name, where);
    }
    return cameras;
}

Result<void> checkPose(const ColmapImage& image, const std::string& where) {
    for (int i = 0; i < 3; ++i)
        if (!std::isfinite(image.translation[i]))
            return failAt(where, ErrorCode::invalidInput, "the translation is not finite");
    if (auto r = rotationFromQuaternion(image.rotation, where); !r) return propagate(r);
    return {};
}

Result<std::vector<ColmapImage>> imagesFromText(std::string_view text, const Limits& limits) {
    std::vector<ColmapImage> images;
    bool points = false;  // each image has a second line, which may be empty
    for (const TextLine& line : linesOf(text, true)) {
        if (!line.text.empty() && line.text[0] == '#') continue;
        if (points) {
            // Its last word tells it from a line of an image, which ends in the image's name.
            const std::string_view last = line.lastWord();
            if (!last.empty() && !numberOf(last, ""))
                return failAt(
                    line.where(), ErrorCode::invalidInput,
                    "'{}' where a line of points is expected; behind each image comes one "
                    "with 'X Y POINT3D_ID' of each of its points, which may be empty",
                    last.substr(0, 40));
            points = false;
            continue;
        }
        const auto words = line.words();
        if (words.empty()) continue;
        STX_TRY(const auto n, numbersOf(words, 0, 9, line.where()));
        if (words.size() < 10)
            return failAt(line.where(), ErrorCode::invalidInput,
                          "the image's name is missing; 'IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID "
                          "NAME' is expected");
        if (!(n[8] >= 0 && n[8] < 4294967296.0))
            return failAt(line.where(), ErrorCode::invalidInput, "{:g} is not a camera's number",
                          n[8]);
        ColmapImage image;
        image.rotation = {n[2], n[3], n[4], n[1]};
        image.translation = {n[5], n[6], n[7]};
        image.camera = static_cast<std::uint32_t>(n[8]);
        image.name = line.text.substr(static_cast<std::size_t>(words[9].data() - line.text.data()));
        STX_CHECK(checkPose(image, line.where()));
        images.push_back(std::move(image));
        STX_CHECK(checkViewCount(images.size(), limits, line.where()));
        points = true;
    }
    return images;
}

Result<std::vector<ColmapImage>> imagesFromBinary(ByteSpan bytes, const Limits& limits) {
    Reader in(bytes);
    if (!in.has(8)) return cutShort(in, "the number", 0, 0);
    const std::uint64_t count = in.u(8);
    STX_CHECK(checkViewCount(count, limits, "byte 0"));
    std::vector<ColmapImage> images;
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::string where = fmt::format("image {} at byte {}", i, bytes.size() - in.left());
        if (!in.has(64)) return cutShort(in, "image", i, count);
        in.u(4);
        ColmapImage image;
        image.rotation.w = in.number();
        for (int k = 0; k < 3; ++k) image.rotation[k] = in.number();
        for (int k = 0; k < 3; ++k) image.translation[k] = in.number();
        image.camera = static_cast<std::uint32_t>(in.u(4));
        const auto name = in.text();
        if (!name || !in.has(8)) return cutShort(in, "image", i, count);
        image.name = *name;
        const std::uint64_t points = in.u(8);
        if (points > in.left() / 24) return cutShort(in, "image", i, count);
        in.skip(points * 24);
        STX_CHECK(checkPose(image, where));
        images.push_back(std::move(image));
    }
    return images;
}

}  // namespace

Result<ColmapCameras> parseColmapCameras(ByteSpan bytes, bool binary, const Limits& limits) {
    return binary ? camerasFromBinary(bytes, limits) : camerasFromText(textOf(bytes), limits);
}

Result<std::vector<ColmapImage>> parseColmapImages(ByteSpan bytes, bool binary,
                                                   const Limits& limits) {
    return binary ? imagesFromBinary(bytes, limits) : imagesFromText(textOf(bytes), limits);
}

namespace {

/// A model as its files have it, and where its images are.
struct Model3d {
    path base;   ///< has images/ and stereo/
    path model;  ///< has the files
    bool binary = false;
    bool ours = false;  ///< written by stx: depth maps have no mixed pixels
    ColmapCameras cameras;
    std::vector<ColmapImage> images;

    [[nodiscard]] path file(const char* stem) const {
        return model / fmt::format("{}{}", stem, binary ? ".bin" : ".txt");
    }
};

Result<Model3d> readModel(const path& given, const Limits& limits) {
    Model3d m;
    m.base = given;
    std::error_code ec;
    // One of its files is given in place of the folder.
    if (std::filesystem::is_regular_file(given, ec)) m.base = folderOf(given);
    const path folder = m.base;
    const auto hasModel = [&](const path& in) {
        for (const bool b : {true, false}) {
            const char* ending = b ? ".bin" : ".txt";
            if (std::filesystem::is_regular_file(in / fmt::format("cameras{}", ending), ec) &&
                std::filesystem::is_regular_file(in / fmt::format("images{}", ending), ec)) {
                m.model = in;
                m.binary = b;
                return true;
            }
        }
        return false;
    };
    if (!hasModel(folder / "sparse") && !hasModel(folder / "sparse/0") &&
        (hasModel(folder) || hasModel(folder / "0"))) {
        // The model's own folder is given, or sparse/: the images are beside it.
        for (const char* up : {"..", "../.."})
            if (!std::filesystem::is_directory(m.base / "images", ec)) m.base = folder / up;
        m.base = m.base.lexically_normal();
    }
    if (m.model.empty())
        return failAt(inQuotes(given.string()), ErrorCode::invalidInput,
                      "no COLMAP model was found in it; sparse/cameras.bin and images.bin, or "
                      ".txt, are expected (colmap writes them with its mapper or model_converter)");
    STX_TRY(const auto cameraBytes, readSetFile(m.file("cameras"), limits));
    STX_TRY(m.cameras, within(inQuotes(m.file("cameras").string()),
                              parseColmapCameras(cameraBytes, m.binary, limits)));
    m.ours = textOf(cameraBytes).starts_with(kWrittenByUs);
    STX_TRY(const auto imageBytes, readSetFile(m.file("images"), limits));
    STX_TRY(m.images, within(inQuotes(m.file("images").string()),
                             parseColmapImages(imageBytes, m.binary, limits)));
    // The file's order is that of the numbers that COLMAP gave; people expect that of the names.
    // Ours is that of the bundle.
    if (!m.ours)
        std::ranges::stable_sort(m.images, [](const ColmapImage& a, const ColmapImage& b) {
            return numbersInOrder(a.name, b.name);
        });
    return m;
}

/// The camera of an image, in our axes.
Result<SetView> viewOf(const Model3d& m, const ColmapImage& image, const std::string& place) {
    const auto found = m.cameras.find(image.camera);
    if (found == m.cameras.end())
        return failAt(place, ErrorCode::invalidInput,
                      "it was taken by camera {}, which the model's cameras do not have",
                      image.camera);
    const ColmapCamera& c = found->second;
    if (c.unknown)
        return within(inQuotes(m.file("cameras").string()),
                      Result<SetView>(tl::unexpected(*c.unknown)));
    SetView view;
    view.name = path(image.name).replace_extension().generic_string();
    STX_TRY(const glm::dmat3 rotation, rotationFromQuaternion(image.rotation, place));
    VisionCamera v;
    v.worldFromCamera = glm::transpose(rotation);
    v.centre = -(v.worldFromCamera * image.translation);
    v.fx = c.fx;
    v.fy = c.fy;
    v.cx = c.cx;
    v.cy = c.cy;
    v.width = c.width;
    v.height = c.height;
    view.camera = cameraFromVision(v);
    view.lens = c.lens;
    return view;
}

std::string placeOf(const Model3d& m, const ColmapImage& image) {
    return fmt::format("{}: image '{}'", inQuotes(m.file("images").string()), image.name);
}

}  // namespace

Result<std::vector<SetView>> colmapViews(const path& given, Job& job) {
    STX_TRY(const Model3d m, readModel(given, job.limits));
    std::vector<SetView> views;
    for (const ColmapImage& image : m.images) {
        STX_TRY(auto view, viewOf(m, image, placeOf(m, image)));
        rememberNamedFile(m.base / "images" / image.name);
        views.push_back(std::move(view));
    }
    return views;
}

Result<SetDescription> describeColmap(const path& given, const ImageSetOptions&, Job& job) {
    const std::string where = inQuotes(given.string());
    STX_TRY(const Model3d m, readModel(given, job.limits));
    SetDescription set;
    int without = 0;
    for (const ColmapImage& image : m.images) {
        const std::string place = placeOf(m, image);
        STX_TRY(auto view, viewOf(m, image, place));
        const std::string depth =
            firstThere(m.base, {fmt::format("stereo/depth_maps/{}.geometric.bin", image.name),
                                fmt::format("stereo/depth_maps/{}.photometric.bin", image.name)});
        if (depth.empty()) {
            ++without;
            continue;
        }
        STX_TRY(view.texture, sourceInside(m.base, "images/" + image.name, place, job.limits));
        STX_TRY(view.depth, sourceInside(m.base, depth, place, job.limits));
        view.depth.colmap = true;
        // COLMAP appends .png to the whole name; others replace the ending.
        const std::string mask = firstThere(m.base, {fmt::format("masks/{}.png", image.name),
                                                     fmt::format("masks/{}.png", view.name)});
        if (!mask.empty()) {
            STX_TRY(view.mask, sourceInside(m.base, mask, place, job.limits));
        }
        view.sensor = !m.ours;
        set.views.push_back(std::move(view));
    }
    if (without > 0 && !set.views.empty())
        job.note(fmt::format("{} of {} images have no depth map and are left out", without,
                             m.images.size()));
    if (set.views.empty())
        return failAt(where, ErrorCode::invalidInput,
                      "none of the {} images has a depth map; stereo/depth_maps/NAME.geometric.bin "
                      "is looked for (made by COLMAP's patch_match_stereo)",
                      m.images.size());
    return set;
}

}  // namespace stx::imagesets
