// One photograph with depth: in the same file, as phones write them (formats/photos), or in a file
// beside it. The camera is at the origin and looks along -Z.

#include <algorithm>
#include <bit>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include "formats/files/messages.hpp"
#include "formats/files/not_there.hpp"
#include "formats/images/exif.hpp"
#include "formats/images/images.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/recognise.hpp"
#include "formats/imagesets/set_options.hpp"
#include "formats/imagesets/two_cameras.hpp"
#include "formats/photos/photo.hpp"
#include "lib/environment/environment_map.hpp"

namespace stx::imagesets {
namespace {

using photos::Photo;
using photos::PhotoDepthCode;
using photos::PhotoImage;
using photos::PhotoIntrinsics;

/// The main cameras of phones, as a 35 mm camera's focal length; where a file tells none.
constexpr double kUsualFocal35 = 26;
constexpr double kDiagonal35 = 43.266615;  ///< of 36x24 mm
/// A larger difference of fx and fy is of a matrix that is wrong: pixels of phones are square.
constexpr double kMostOblong = 0.02;

/// A focal length below this share of the picture's width (157 degrees across) is not in pixels:
/// phones' widest lens has 0.36, and one in widths (at most 9, of 300 mm) of a picture of 400
/// pixels would be 0.02.
constexpr double kShortestFocal = 0.1;

/// Endings of a depth picture beside its photo, in the order in which they are looked for.
constexpr const char* kDepthEndings[] = {"_depth.tiff", "_depth.tif", "_depth.exr",
                                         "_depth.pfm",  "_depth.png", "_depth.jpg"};

/// The file that --depth names, beside the photo or where stx runs.
path namedDepth(const path& picture, std::string name) {
    if (const auto at = name.find("{stem}"); at != std::string::npos)
        name.replace(at, 6, picture.stem().string());
    const path beside = folderOf(picture) / name;
    std::error_code ec;
    return std::filesystem::exists(beside, ec) ? beside : path(name);
}

/// The depth of a photo on its way, and what its values mean.
struct PhotoDepth {
    PictureSource source;  ///< where it is a file of its own
    PhotoDepthCode code;   ///< of integers
    double unit = 0;       ///< scene units of one step, where code does not matter
    bool assumed = false;  ///< its range is a guess
    int orientation = 1;   ///< of a file of its own: how to turn it, as EXIF counts
    std::string turned;    ///< what a person should know of that
};

/// A depth picture beside a photo. A JPEG may have coded its grey as colours, which are then off by
/// some levels: their luma is what was meant.
Result<StoredDepth> readBeside(const PictureSource& source, Job& job) {
    STX_TRY(const auto bytes, readFile(source.path, job.limits));
    const auto info = probeImage(bytes);
    if (!info || info->format != "jpeg") return readDepth(source, job);
    if (info->channels != 3) {
        STX_TRY(auto grey, readDepth(source, job));
        grey.lossy = true;
        return grey;
    }
    STX_TRY(const auto picture, decodeRgba8(bytes, source.name, job.limits));
    StoredDepth out;
    out.largest = 255;
    out.lossy = true;
    out.values = Image<float>(picture.width(), picture.height());
    constexpr double kMostColour = 8;  // levels, in the mean; a photograph has more
    double colour = 0;
    for (std::size_t i = 0; i < picture.count(); ++i) {
        const glm::ivec4 p = picture.data()[i];
        colour += std::max({p.r, p.g, p.b}) - std::min({p.r, p.g, p.b});
        out.values.data()[i] = static_cast<float>((299 * p.r + 587 * p.g + 114 * p.b + 500) / 1000);
    }
    if (colour > kMostColour * static_cast<double>(picture.count()))
        return failAt(inQuotes(source.name), ErrorCode::invalidInput,
                      "it is a picture in colours; depth is grey");
    return out;
}

Result<StoredDepth> storedDepth(const Photo& photo, const PhotoDepth& depth, Job& job) {
    if (!depth.source.name.empty()) {
        STX_TRY(auto beside, readBeside(depth.source, job));
        beside.values = turnedUpright(std::move(beside.values), depth.orientation);
        return beside;
    }
    STX_TRY(auto decoded, photos::decodeDepth(photo, job));
    return StoredDepth{std::move(decoded.values), (1 << decoded.bits) - 1};
}

/// What the integers of a picture beside a photo are. Errors (usage): nobody says, or an option
/// gives another meaning to floats, which are distances.
Result<void> readBesideCode(const path& file, const ImageSetOptions& options, int largest,
                            PhotoDepth& depth) {
    if (largest == 0) {
        const char* option = options.depthMin > 0                      ? "--depth-range"
                             : options.depthUnit > 0                   ? "--depth-unit"
                             : options.photo.nearIs != NearIs::unknown ? "--depth-near"
                                                                       : nullptr;
        if (option)
            return within(inQuotes(file.filename().string()), Result<void>(depthIsFloats(option)));
        return {};
    }
    if (options.depthUnit > 0) {
        depth.unit = options.depthUnit;
        return {};
    }
    if (options.photo.nearIs == NearIs::unknown)
        return failAt(inQuotes(file.filename().string()), ErrorCode::usage,
                      "the depth is a grey picture of {} bits, which does not tell whether white "
                      "or black is near; --depth-near white or black says it, --depth-unit what a "
                      "step is",
                      std::bit_width(static_cast<unsigned>(largest)));
    depth.code.zeroIsNear = options.photo.nearIs == NearIs::black;
    return {};
}

/// How depth of that size, as it is stored beside the photo, is turned: by its own orientation;
/// without one as depthTurnOf() says.
Result<void> findTurn(const Photo& photo, glm::ivec2 size, PhotoDepth& depth, Job& job) {
    STX_TRY(const auto bytes, readFile(depth.source.path, job.limits));
    if (const ExifNotes own = readExif(bytes); own.oriented) {
        depth.orientation = own.orientation;
        return {};
    }
    if (photo.orientation == 1) return {};
    const glm::ivec2 upright = photo.uprightSize(photo.colour);
    const bool sideways = upright != glm::ivec2(photo.colour.width, photo.colour.height);
    auto turn = depthTurnOf(size, upright, sideways, depth.source.name);
    if (turn.asPicture) depth.orientation = photo.orientation;
    depth.turned = std::move(turn.note);
    return {};
}

/// Depth beside the photo, with its code. `read` becomes its values.
Result<PhotoDepth> besideDepth(const path& file, const ImageSetOptions& options, Photo& photo,
                               std::optional<StoredDepth>& read, Job& job) {
    PhotoDepth depth;
    depth.source.path = file;
    depth.source.name = file.filename().string();
    STX_TRY(auto stored, readBeside(depth.source, job));
    STX_CHECK(findTurn(photo, stored.values.size(), depth, job));
    glm::ivec2 size = stored.values.size();
    // The photo's own turn is counted on its pictures' sizes.
    if ((depth.orientation >= 5) != (photo.orientation >= 5)) std::swap(size.x, size.y);
    photo.depth.width = size.x;
    photo.depth.height = size.y;
    STX_CHECK(readBesideCode(file, options, stored.largest, depth));
    const bool floats = stored.largest == 0;
    photo.accuracy = floats || depth.unit > 0 ? "absolute" : "relative";
    photo.coding = floats                  ? "distance"
                   : depth.unit > 0        ? "distance in steps"
                   : depth.code.zeroIsNear ? "black is near"
                                           : "white is near";
    stored.values = turnedUpright(std::move(stored.values), depth.orientation);
    read = std::move(stored);
    return depth;
}

/// Gives a range to a code without one, or the one that is asked for: of the ends of a code with a
/// scale, as its file has them, else of the values that the picture has: those in `read`, or it
/// becomes them.
Result<void> setRange(const Photo& photo, const ImageSetOptions& options, PhotoDepth& depth,
                      std::optional<StoredDepth>& read, Job& job) {
    const bool given = options.depthMin > 0;
    if (depth.code.scaled()) {
        if (given) depth.code.setRange(options.depthMin, options.depthMax);
        return {};
    }
    if (depth.unit > 0) return {};
    if (!read) STX_SET(read, storedDepth(photo, depth, job));
    if (read->largest == 0) return {};
    if (given)
        depth.code.setRange(options.depthMin, options.depthMax, read->values, read->largest,
                            read->lossy);
    else
        depth.code.assumeRange(read->values, read->largest, read->lossy);
    depth.assumed = !given;
    return {};
}

/// The camera of a photo of that size, upright; `from` is what it follows from, `notes` what a
/// person should know of it.
Camera cameraOfPhoto(const Photo& photo, glm::ivec2 size, const ImageSetOptions& options,
                     std::string& from, std::vector<std::string>& notes) {
    Camera camera;
    camera.width = size.x;
    camera.height = size.y;
    camera.cx = size.x * 0.5;
    camera.cy = size.y * 0.5;
    if (options.intrinsics[0] > 0) {
        const auto& k = options.intrinsics;
        camera.fx = k[0];
        camera.fy = k[1];
        camera.cx = k[2];
        camera.cy = k[3];
        from = "given";
        return camera;
    }
    if (options.photo.fovRad > 0) {
        camera.fx = camera.fy = size.y * 0.5 / std::tan(options.photo.fovRad * 0.5);
        from = "given";
        return camera;
    }
    if (photo.intrinsics) {
        const PhotoIntrinsics& k = *photo.intrinsics;
        const double shortest = kShortestFocal * size.x;
        const bool normalised = k.fx > 0 && k.fy > 0 && k.fx < shortest && k.fy < shortest;
        if (!normalised && k.fx > 0 && k.fy > 0 && std::abs(k.fx / k.fy - 1) <= kMostOblong) {
            camera.fx = k.fx;
            camera.fy = k.fy;
            camera.cx = k.cx;
            camera.cy = k.cy;
            from = "matrix";
            return camera;
        }
        if (normalised)
            notes.push_back(
                fmt::format("its intrinsic matrix is not used: fx {:.3g} and fy {:.3g} look "
                            "normalised, and pixels are expected",
                            k.fx, k.fy));
        else
            notes.push_back(
                fmt::format("its intrinsic matrix is not used: fx {:.0f} and fy {:.0f} differ by "
                            "more than {:g} %",
                            k.fx, k.fy, 100 * kMostOblong));
    }
    const double diagonal = std::hypot(size.x, size.y);
    from = photo.focal35 > 0 ? "focal35" : "assumed";
    if (photo.focal35 <= 0)
        notes.push_back(fmt::format(
            "it does not tell its focal length: that of phones, {:g} mm of a 35 mm camera, is "
            "assumed; --fov or --intrinsics give another",
            kUsualFocal35));
    camera.fx = camera.fy =
        (photo.focal35 > 0 ? photo.focal35 : kUsualFocal35) / kDiagonal35 * diagonal;
    return camera;
}

/// What a person should know of the depth.
void noteDepth(const Photo& photo, const PhotoDepth& depth, const ImageSetOptions& options,
               std::vector<std::string>& notes) {
    if (!depth.turned.empty()) notes.push_back(depth.turned);
    if (depth.assumed)
        notes.emplace_back(
            "its depth has no scale: from nearest to farthest 1 to 4 is assumed, with the median "
            "at 1; --depth-range NEAR,FAR gives another");
    if (photo.accuracy == "relative" && options.depthMin <= 0)
        notes.emplace_back(
            "its depth is relative: right for small moves to the side, not for distances, orbits "
            "and moves forward");
    if (photo.accuracy == "unscaled")
        notes.emplace_back("its depth tells no unit: distances are right but for one scale");
    if (photo.colourIs == "portrait")
        notes.emplace_back("the picture with the blurred background is used, as --colour-of says");
}

/// Depth that was read for its code, for the first who loads the view: decoding takes as long as
/// much of the rest.
class KeptDepth {
  public:
    explicit KeptDepth(std::optional<StoredDepth> depth) : depth_(std::move(depth)) {}
    [[nodiscard]] std::optional<StoredDepth> take() {
        const std::lock_guard lock(mutex_);
        return std::exchange(depth_, std::nullopt);
    }

  private:
    std::mutex mutex_;
    std::optional<StoredDepth> depth_;
};

/// The picture of a photo, upright. `deep`: see ImageSetOptions::deepColour.
Result<StoredColour> colourOf(const Photo& photo, const std::string& name, bool deep, Job& job) {
    if (photo.colour.coding == PhotoImage::Coding::heif) {
        std::string profile;
        STX_TRY(auto picture, photos::decodeColour(photo, profile, job));
        if (!profile.empty()) job.note(profile);
        return StoredColour{std::move(picture)};
    }
    STX_TRY(auto stored, colourOfFile(photo.colour.bytes, name, deep, job));
    if (auto* coded = stored.texture.rgba8())
        stored.texture = turnedUpright(std::move(*coded), photo.orientation);
    else
        stored.texture = turnedUpright(std::move(*stored.texture.rgbaFloat()), photo.orientation);
    // Most programs write alpha without cutting anything out.
    stored.alpha = stored.alpha && !isOpaque(stored.texture);
    return stored;
}

Result<StoredView> loadPhoto(const Photo& photo, const std::string& name, const PhotoDepth& depth,
                             KeptDepth& kept, bool wantsMatte, bool deep,
                             const std::vector<std::string>& notes, Job& job) {
    for (const std::string& note : notes) job.note(note);
    StoredView stored;
    auto values = kept.take();
    if (!values) STX_SET(values, storedDepth(photo, depth, job));
    stored.depth = std::move(values->values);
    stored.largest = values->largest;
    STX_TRY(auto colour, colourOf(photo, name, deep, job));
    stored.texture = std::move(colour.texture);
    stored.alpha = colour.alpha;
    if (wantsMatte && photo.matte.coding != PhotoImage::Coding::none) {
        if (auto matte = photos::decodeMatte(photo, job))
            stored.matte = std::move(*matte);
        else
            job.note("its portrait matte is not used: " + matte.error().text());
    }
    return stored;
}

/// The intrinsics that were given, if any. Errors (usage): two that do not agree, or impossible
/// ones.
Result<std::optional<PixelIntrinsics>> askedIntrinsics(const path& given,
                                                       const ImageSetOptions& options) {
    const std::string where = inQuotes(given.string());
    if (options.intrinsics[0] != 0 && options.photo.fovRad > 0)
        return failAt(where, ErrorCode::usage,
                      "--intrinsics and --fov both say what its camera is; give one of them");
    STX_TRY(const auto asked, within(where, givenIntrinsics(options)));
    if (asked && !(asked->x > 0 && asked->y > 0))
        return failAt(
            where, ErrorCode::usage,
            "the focal lengths of --intrinsics are {:g} and {:g}; two above 0 are expected",
            asked->x, asked->y);
    return asked;
}

/// A photo, and the file beside it that has its depth; empty: it has its own.
struct OpenedPhoto {
    std::shared_ptr<Photo> photo;
    path beside;
};
Result<OpenedPhoto> openGiven(const path& given, const ImageSetOptions& options, Job& job) {
    const std::string where = inQuotes(given.string());
    std::error_code ec;
    if (std::filesystem::is_directory(given, ec))
        return failAt(where, ErrorCode::invalidInput,
                      "a folder; a photograph with depth is one file (many: @LIST)");
    STX_TRY(auto bytes, readFile(given, job.limits));
    const auto file = std::make_shared<const Bytes>(std::move(bytes));
    photos::PhotoOptions wanted;
    wanted.portrait = options.photo.portrait;
    wanted.needsDepth = options.depthPattern.empty();
    auto opened = photos::openPhoto(file, wanted, job.limits);
    path beside;
    if (!wanted.needsDepth) {
        beside = namedDepth(given, options.depthPattern);
        if (!std::filesystem::exists(beside, ec))
            return failAt(inQuotes(beside.string()), ErrorCode::io, "{}", whyNotThere(beside));
    } else if (!opened && opened.error().code == ErrorCode::invalidInput) {
        // What lies beside a photo matters only where it has no depth itself.
        beside = depthBeside(given);
        if (!beside.empty()) {
            wanted.needsDepth = false;
            opened = photos::openPhoto(file, wanted, job.limits);
        }
    }
    if (!opened) return tl::unexpected(opened.error().at(where));
    return OpenedPhoto{std::make_shared<Photo>(std::move(*opened)), std::move(beside)};
}

}  // namespace

path depthBeside(const path& picture) {
    std::string stem = picture.stem().string();
    constexpr std::string_view kImage = "_image";
    if (stem.ends_with(kImage)) stem.resize(stem.size() - kImage.size());
    std::error_code ec;
    for (const char* ending : kDepthEndings) {
        path file = folderOf(picture) / (stem + ending);
        if (std::filesystem::is_regular_file(file, ec)) return file;
    }
    return {};
}

Result<SetDescription> describePhoto(const path& given, const ImageSetOptions& options, Job& job) {
    const std::string where = inQuotes(given.string());
    STX_TRY(const auto asked, askedIntrinsics(given, options));
    STX_TRY(const auto opened, openGiven(given, options, job));
    const auto& photo = opened.photo;
    const path& beside = opened.beside;

    PhotoDepth depth;
    depth.code = photo->code;
    std::optional<StoredDepth> read;
    SetView view;
    view.name = "photo";
    view.texture.path = given;
    view.texture.name = given.filename().string();
    view.depth.name = view.texture.name;
    // Depth beside it is turned, or not, by the sizes of both.
    if (photo->colour.width == 0) {
        Job aside;  // loading the picture gives the same notes
        aside.limits = job.limits;
        STX_TRY(const glm::ivec2 stored, within(where, imageSizeOf(view.texture, aside)));
        photo->colour.width = stored.x;
        photo->colour.height = stored.y;
    }
    if (!beside.empty()) {
        photo->format = "picture and depth";
        STX_TRY(depth, besideDepth(beside, options, *photo, read, job));
        view.depth = depth.source;
    } else if (options.depthUnit > 0 || options.photo.nearIs != NearIs::unknown) {
        return failAt(where, ErrorCode::usage,
                      "its depth is in the file, which says what its codes are; {} is of depth "
                      "beside a photo",
                      options.depthUnit > 0 ? "--depth-unit" : "--depth-near");
    }
    STX_CHECK(within(where, setRange(*photo, options, depth, read, job)));
    photo->code = depth.code;

    const glm::ivec2 size = photo->uprightSize(photo->colour);
    SetDescription set;
    std::vector<std::string> notes;
    view.camera = cameraOfPhoto(*photo, size, options, set.cameraFrom, notes);
    // Counted from the corner.
    if (asked) noteOddCentre(*asked - PixelIntrinsics(0, 0, 0.5, 0.5), size, job);
    noteDepth(*photo, depth, options, notes);
    view.stretched = beside.empty();
    const bool raises = options.refine.atImport(RefineStep::raise, true);
    const auto kept = std::make_shared<KeptDepth>(std::move(read));
    const bool deep = options.deepColour;
    view.load = [photo, depth, kept, raises, deep, notes](const SetView& own, Job& ownJob) {
        return loadPhoto(*photo, own.texture.name, depth, *kept, raises, deep, notes, ownJob);
    };
    view.distances = [code = depth.code, unit = depth.unit](Image<float>& values,
                                                            const Camera& camera, int largest,
                                                            Job& own) -> Result<void> {
        if (largest == 0) return {};
        if (unit > 0) return scaledIntegers(unit)(values, camera, largest, own);
        code.toDistances(values, camera, largest);
        return {};
    };
    set.photo = photo;
    set.views.push_back(std::move(view));
    return set;
}

}  // namespace stx::imagesets
