#include "formats/imagesets/recognise.hpp"

#include <fstream>
#include <optional>

#include "formats/files/messages.hpp"
#include "formats/files/not_there.hpp"
#include "formats/photos/photo.hpp"
#include "formats/video/film.hpp"

namespace stx {
namespace imagesets {
namespace {

const std::vector<KindEntry>& entries() {
    static const std::vector<KindEntry> all = {
        {{"transforms", "transforms.json of NeRF, nerfstudio, instant-ngp and Blender"},
         describeTransforms},
        {{"miv", "camera list of MPEG's immersive video (TMIV) or RVS, with PNG or YUV files"},
         describeMiv},
        {{"msr", "MSR 3D Video: calibParams-*.txt with camN/; needs the depth range"}, describeMsr},
        {{"colmap", "COLMAP's dense workspace: sparse/, images/, stereo/depth_maps/"},
         describeColmap},
        {{"middlebury",
          "Middlebury stereo: calib.txt with PFM, or older ones with focal length and "
          "baseline"},
         describeMiddlebury},
        {{"tum", "TUM or ICL-NUIM RGB-D recording"}, describeRgbd},
        {{"7scenes", "Microsoft's 7-Scenes recording"}, describeSevenScenes},
        {{"open3d", "recording of Open3D or Redwood: color/, depth/, trajectory.log"},
         describeOpen3d},
        {{"exr", "OpenEXR pictures with Z: one part, several, several views"}, describeExr},
        {{"azure-kinect", "Azure Kinect's recording (.mkv); needs the module of video"},
         describeAzureKinect},
        {{"panorama", "a folder with an equirectangular picture and its depth"}, describePanorama},
        {{"photo",
          "one photograph with depth in it, as phones write them (HEIC, JPEG), or with --depth"},
         describePhoto},
        {{"cameras", "a folder with our own cameras.json"}, describeCamerasJson},
    };
    return all;
}

/// Whether the first list of a file is `frames`, as in transforms.json: a look at its beginning, as
/// such files can have megabytes of frames.
class BeginsWithFrames : public Json::json_sax_t {
  public:
    [[nodiscard]] bool found() const { return found_; }

    bool start_object(std::size_t) override { return depth_++ < 1 || key_ != "frames"; }
    bool end_object() override { return depth_-- > 0; }
    bool start_array(std::size_t) override {
        found_ = depth_ == 1 && key_ == "frames";
        return depth_++ > 0 && !found_;
    }
    bool end_array() override { return depth_-- > 0; }
    bool key(std::string& name) override {
        if (depth_ == 1) key_ = name;
        return true;
    }
    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(Json::number_integer_t) override { return true; }
    bool number_unsigned(Json::number_unsigned_t) override { return true; }
    bool number_float(Json::number_float_t, const std::string&) override { return true; }
    bool string(std::string&) override { return true; }
    bool binary(Json::binary_t&) override { return true; }
    bool parse_error(std::size_t, const std::string&, const Json::exception&) override {
        return false;
    }

  private:
    int depth_ = 0;
    std::string key_;
    bool found_ = false;
};

/// The kind of a JSON file by its keys; empty when it is something else.
Result<std::string> kindOfJson(const path& file) {
    Limits limits;
    limits.maxMemoryBytes = 256u << 20;
    STX_TRY(const auto bytes, readFile(file, limits));
    const auto* text = reinterpret_cast<const char*>(bytes.data());
    BeginsWithFrames look;
    (void)Json::sax_parse(text, text + bytes.size(), &look);
    if (look.found()) return std::string("transforms");
    STX_TRY(const Json json, within(inQuotes(file.string()), parseJson(bytes)));
    switch (jsonKindOf(json)) {
        case JsonKind::transforms:
            return std::string("transforms");
        case JsonKind::miv:
            return std::string("miv");
        case JsonKind::cameras:
            return std::string("cameras");
        case JsonKind::cameraPath:
        case JsonKind::none:
            break;
    }
    return std::string();
}

/// JPEG, PNG or HEIC, by its first bytes.
bool isPicture(const path& file) {
    std::ifstream in(file, std::ios::binary);
    char head[64] = {};
    in.read(head, sizeof(head));
    const auto bytes = std::as_bytes(std::span(head)).first(static_cast<std::size_t>(in.gcount()));
    const std::string_view text(head, bytes.size());
    return text.starts_with("\xff\xd8\xff") || text.starts_with("\x89PNG") || photos::isHeif(bytes);
}

}  // namespace

const KindEntry* kindNamed(std::string_view name) {
    for (const KindEntry& entry : entries())
        if (entry.kind.name == name) return &entry;
    return nullptr;
}

}  // namespace imagesets

const std::vector<ImageSetKind>& imageSetKinds() {
    static const std::vector<ImageSetKind> kinds = [] {
        std::vector<ImageSetKind> all;
        for (const auto& entry : imagesets::entries()) all.push_back(entry.kind);
        return all;
    }();
    return kinds;
}

Result<std::string> recogniseImageSet(const std::filesystem::path& path) {
    using namespace imagesets;
    namespace fs = std::filesystem;
    std::error_code ec;
    const std::string where = inQuotes(path.string());
    if (!fs::exists(path, ec)) return failAt(where, ErrorCode::io, "{}", whyNotThere(path));
    if (!fs::is_directory(path, ec)) {
        if (path.extension() == ".json") {
            STX_TRY(const std::string kind, kindOfJson(path));
            if (!kind.empty()) return kind;
        }
        const std::string name = path.filename().string();
        if (path.extension() == ".txt") {
            if (name.starts_with("calibParams")) return std::string("msr");
            if (name == "calib.txt") return std::string("middlebury");
            if (name == "groundtruth.txt" || name == "pose.txt" || name == "poses.txt")
                return std::string("tum");
        }
        if (name.ends_with(".gt.freiburg")) return std::string("tum");
        if (path.extension() == ".log") return std::string("open3d");
        if (path.extension() == ".exr") return std::string("exr");
        if (filmFormatOf(path) == "matroska") return std::string("azure-kinect");
        if (isPicture(path)) return std::string("photo");
        return failAt(
            where, ErrorCode::invalidInput,
            "this is not an image set: a .json with cameras, calib.txt, calibParams-*.txt, an "
            ".exr with Z, a photograph with depth, or a folder is expected");
    }
    if (fs::is_regular_file(path / "transforms.json", ec)) return std::string("transforms");
    const std::vector<std::string> files = filesIn(path);
    std::optional<Error> broken;
    for (const std::string& name : files) {
        if (fs::path(name).extension() != ".json") continue;
        const auto kind = kindOfJson(path / name);
        if (!kind && !broken) broken = kind.error();
        if (kind && (*kind == "miv" || (*kind == "cameras" && name == "cameras.json")))
            return *kind;
    }
    for (const std::string& name : files)
        if (name.starts_with("calibParams")) return std::string("msr");
    const auto has = [&](const char* name) { return fs::exists(path / name, ec); };
    if (has("sparse/cameras.bin") || has("sparse/cameras.txt") || has("sparse/0/cameras.bin") ||
        has("sparse/0/cameras.txt") || has("0/cameras.bin") || has("0/cameras.txt") ||
        ((has("cameras.bin") || has("cameras.txt")) && (has("images.bin") || has("images.txt"))))
        return std::string("colmap");
    if (has("calib.txt")) return std::string("middlebury");
    if ((has("rgb.txt") && has("depth.txt")) || has("associations.txt") || has("associated.txt") ||
        has("associate.txt") || ((has("color") || has("rgb")) && has("depth") && has("pose.txt")))
        return std::string("tum");
    if (has("depth") && (has("color") || has("image") || has("rgb")) &&
        !trajectoryLogIn(path).empty())
        return std::string("open3d");
    int pictures = 0, exr = 0, disparities = 0, depths = 0, depthArrays = 0;
    for (const std::string& name : files) {
        if (name.ends_with(".pose.txt")) return std::string("7scenes");
        if (name.ends_with(".gt.freiburg")) return std::string("tum");
        const std::string ending = fs::path(name).extension().string();
        exr += ending == ".exr";
        const bool picture = ending == ".png" || ending == ".jpg" || ending == ".exr" ||
                             ending == ".pgm" || ending == ".ppm" || ending == ".pfm";
        const bool array = ending == ".npy" || ending == ".npz";
        pictures += picture;
        depths += picture && name.find("depth") != std::string::npos;
        depthArrays += array && name.find("depth") != std::string::npos;
        disparities += picture && (name.starts_with("disp1.") || name.starts_with("disp2.") ||
                                   name.starts_with("disp5.") || name.starts_with("disp6."));
    }
    if (disparities > 0 && pictures > disparities) return std::string("middlebury");
    if ((pictures == 2 && depths == 1) || (pictures == 1 && depths == 0 && depthArrays == 1))
        return std::string("panorama");
    if (exr > 0) return std::string("exr");
    // A camera list that cannot be read is a likelier reason than none.
    if (broken) return tl::unexpected(*broken);
    return failAt(where, ErrorCode::invalidInput,
                  "no image set is recognised in this folder: transforms.json, cameras.json, "
                  "calib.txt, calibParams-*.txt, sparse/, pose.txt, groundtruth.txt, "
                  "trajectory.log or frame-*.pose.txt is expected");
}

}  // namespace stx
