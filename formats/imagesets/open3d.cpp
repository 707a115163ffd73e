// Recordings as Open3D and Redwood have them: color/ (or image/, rgb/), depth/ in millimetres, a
// trajectory of blocks of five lines (three numbers, then 4x4 camera to world, y down, z forward),
// and a JSON whose intrinsic_matrix goes by columns.

#include <algorithm>

#include <fmt/ranges.h>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/imagesets/poses.hpp"
#include "formats/imagesets/set_options.hpp"
#include "formats/imagesets/text_lines.hpp"
#include "formats/imagesets/two_cameras.hpp"
#include "lib/base/whole_number.hpp"

namespace stx::imagesets {
namespace {

/// What Open3D takes where no file tells: PrimeSense's default.
constexpr PixelIntrinsics kPrimeSense{525, 525, 319.5, 239.5};

struct LoggedPose {
    std::size_t frame = 0;  ///< in the order of the files' names
    glm::dmat3 rotation = glm::dmat3(1.0);
    glm::dvec3 centre = glm::dvec3(0.0);
    std::string where;
    bool lost = false;  ///< tracking was
};

Result<std::vector<LoggedPose>> parseLog(std::string_view text) {
    constexpr std::size_t kBlock = 5;
    const auto lines = linesOf(text);
    if (lines.size() % kBlock != 0)
        return fail(ErrorCode::invalidInput,
                    "{} lines; blocks of 5 are expected: three numbers, then 4 rows of 4",
                    lines.size());
    std::vector<LoggedPose> poses;
    for (std::size_t at = 0; at < lines.size(); at += kBlock) {
        LoggedPose pose;
        pose.where = lines[at].where();
        const auto head = lines[at].words();
        const auto frame = head.empty() ? std::nullopt : wholeNumber<std::size_t>(head[0]);
        if (head.size() != 3 || !frame)
            return failAt(pose.where, ErrorCode::invalidInput,
                          "three numbers are expected, the first that of the frame, from 0");
        pose.frame = *frame;
        for (std::size_t row = 0; row < 3; ++row) {
            const auto& line = lines[at + 1 + row];
            const auto words = line.words();
            if (words.size() != 4)
                return failAt(line.where(), ErrorCode::invalidInput,
                              "{} numbers; a row of 4 is expected", words.size());
            STX_TRY(const auto n, numbersOf(words, 0, 4, line.where(), Numbers::any));
            pose.lost = pose.lost || !isTracked(n);
            const auto r = static_cast<int>(row);
            for (int column = 0; column < 3; ++column)
                pose.rotation[column][r] = n[static_cast<std::size_t>(column)];
            pose.centre[r] = n[3];
        }
        pose.lost = pose.lost || pose.rotation == glm::dmat3(0.0);
        poses.push_back(std::move(pose));
    }
    return poses;
}

/// What a file tells of the camera.
struct ToldIntrinsics {
    PixelIntrinsics k;
    std::optional<glm::ivec2> size;  ///< of its pictures
    std::string where;
};

/// Those of a JSON in the folder; nothing: there is none.
Result<std::optional<ToldIntrinsics>> toldIntrinsics(const path& folder, Job& job) {
    for (const std::string& name : filesIn(folder)) {
        if (path(name).extension() != ".json") continue;
        STX_TRY(const Json json, readJson(folder / name, job.limits));
        if (!json.is_object() || !json.contains("intrinsic_matrix")) continue;
        ToldIntrinsics told;
        told.where = inQuotes((folder / name).string());
        STX_TRY(const auto m, needNumbers(json, "intrinsic_matrix", 9, told.where));
        if (m[1] != 0 || m[2] != 0 || m[3] != 0 || m[5] != 0 || m[8] != 1)
            return failAt(told.where, ErrorCode::invalidInput,
                          "'intrinsic_matrix' is [{:g}]; a matrix by columns, [fx, 0, 0, 0, fy, 0, "
                          "cx, cy, 1], is expected, or give --intrinsics",
                          fmt::join(m, ", "));
        told.k = {m[0], m[4], m[6], m[7]};
        if (told.k.x == 0 || told.k.y == 0)
            return failAt(told.where, ErrorCode::invalidInput,
                          "the focal lengths are {:g} and {:g}; give others with --intrinsics",
                          told.k.x, told.k.y);
        if (json.contains("width") || json.contains("height")) {
            STX_TRY(const double width, needNumber(json, "width", told.where));
            STX_TRY(const double height, needNumber(json, "height", told.where));
            glm::ivec2& size = told.size.emplace();
            STX_TRY(size.x, imageSide(width, "width", 65535, told.where));
            STX_TRY(size.y, imageSide(height, "height", 65535, told.where));
        }
        return told;
    }
    return std::nullopt;
}

/// Scene units of a step of depth, by the `depth_scale` (steps in one unit) that Open3D writes
/// beside the intrinsics; nothing: no file has one.
Result<std::optional<double>> depthUnitBeside(const path& folder, Job& job) {
    for (const std::string& name : filesIn(folder)) {
        if (path(name).extension() != ".json") continue;
        STX_TRY(const Json json, readJson(folder / name, job.limits));
        if (!json.is_object() || !json.contains("intrinsic_matrix")) continue;
        const std::string where = inQuotes((folder / name).string());
        STX_TRY(const auto scale, findNumber(json, "depth_scale", where));
        if (!scale) continue;
        if (!(*scale > 0))
            return failAt(where, ErrorCode::invalidInput,
                          "'depth_scale' is {:g}; the steps of depth in one scene unit, above 0, "
                          "are expected, or give --depth-unit",
                          *scale);
        if (1 / *scale != kMillimetre)
            job.note(
                fmt::format("{}: depth is in steps of {:g} scene units, as its depth_scale "
                            "says; others with --depth-unit",
                            where, 1 / *scale));
        return 1 / *scale;
    }
    return std::nullopt;
}

/// Of pictures of this size: given, else told, else the usual ones.
Result<PixelIntrinsics> intrinsicsOf(const path& folder, glm::ivec2 size,
                                     const ImageSetOptions& options, const std::string& where,
                                     Job& job) {
    STX_TRY(const auto asked, within(where, givenIntrinsics(options)));
    if (asked) {
        noteOddCentre(*asked, size, job);
        return *asked;
    }
    STX_TRY(const auto told, toldIntrinsics(folder, job));
    if (!told) return usualIntrinsics("PrimeSense's usual ones", kPrimeSense, size, job);
    const glm::ivec2 of = told->size.value_or(size);
    if (of == size) return told->k;
    if (!sameShape(of, size))
        return failAt(told->where, ErrorCode::invalidInput,
                      "it is of pictures of {}x{}, but the set's have {}x{} pixels; give their own "
                      "with --intrinsics",
                      of.x, of.y, size.x, size.y);
    const PixelIntrinsics k = scaledTo(size, told->k, of);
    job.note(
        fmt::format("{}: the intrinsics are scaled from {}x{} to the pictures' {}x{} (fx {:g}, fy "
                    "{:g}, cx {:g}, cy {:g}); others with --intrinsics",
                    told->where, of.x, of.y, size.x, size.y, k.x, k.y, k.z, k.w));
    return k;
}

}  // namespace

std::string trajectoryLogIn(const path& folder) {
    std::string found = firstThere(folder, {"trajectory.log", "odometry.log"});
    if (found.empty())
        for (const std::string& name : filesIn(folder))
            if (name.ends_with("-traj.txt") || path(name).extension() == ".log") found = name;
    return found;
}

Result<SetDescription> describeOpen3d(const path& given, const ImageSetOptions& options, Job& job) {
    std::error_code ec;
    const bool isFolder = std::filesystem::is_directory(given, ec);
    const path folder = isFolder ? given : folderOf(given);
    const std::string where = inQuotes(given.string());
    const std::string log = isFolder ? trajectoryLogIn(folder) : given.filename().string();
    if (log.empty())
        return failAt(where, ErrorCode::io,
                      "no trajectory was found in it; trajectory.log, odometry.log or *-traj.txt "
                      "is expected");
    const std::string logWhere = inQuotes((folder / log).string());
    STX_TRY(const auto bytes, readSetFile(folder / log, job.limits));
    STX_TRY(const auto poses, within(logWhere, parseLog(textOf(bytes))));
    const auto lost = std::ranges::count(poses, true, &LoggedPose::lost);
    STX_CHECK(
        noteLost(static_cast<std::size_t>(lost), poses.size(), logWhere, options.strict, job));
    std::string colourFolder = "rgb";
    for (const char* name : {"image", "color"})
        if (std::filesystem::is_directory(folder / name, ec)) colourFolder = name;
    const auto colours = filesIn(folder / colourFolder), depths = filesIn(folder / "depth");
    if (colours.empty() || colours.size() != depths.size())
        return failAt(where, ErrorCode::invalidInput,
                      "{} pictures in {}/ and {} in depth/; as many are expected, in the order of "
                      "their names",
                      colours.size(), colourFolder, depths.size());
    STX_CHECK(
        checkViewCount(poses.size() / static_cast<std::size_t>(options.every), job.limits, where));
    PixelIntrinsics k(0);
    double unit = kMillimetre;
    if (options.depthUnit == 0) {
        STX_TRY(const auto found, depthUnitBeside(folder, job));
        unit = found.value_or(kMillimetre);
    }
    SetDescription set;
    std::optional<glm::ivec2> size;
    std::vector<bool> posed(colours.size(), false);
    for (const LoggedPose& pose : poses) {
        if (pose.frame >= colours.size())
            return failAt(logWhere + ": " + pose.where, ErrorCode::invalidInput,
                          "a pose of frame {}, but there are {} pictures", pose.frame,
                          colours.size());
        if (pose.lost) continue;
        posed[pose.frame] = true;
        SetView view;
        view.name = path(colours[pose.frame]).stem().string();
        STX_CHECK(findPictures(folder, colourFolder + "/" + colours[pose.frame],
                               "depth/" + depths[pose.frame], where, job.limits, view));
        if (!size) {
            STX_TRY(size, within(where, imageSizeOf(view.texture, job)));
            STX_TRY(k, intrinsicsOf(folder, *size, options, where, job));
        }
        VisionCamera v;
        STX_TRY(v.worldFromCamera,
                repairRotation(pose.rotation, k.x, logWhere + ": " + pose.where, job));
        v.centre = pose.centre;
        v.fx = k.x;
        v.fy = k.y;
        // They count from the first pixel's centre.
        v.cx = k.z + 0.5;
        v.cy = k.w + 0.5;
        v.width = size->x;
        v.height = size->y;
        view.camera = cameraFromVision(v);
        view.distances = sensorsOrFloats(options, unit);
        view.sensor = true;
        set.views.push_back(std::move(view));
    }
    if (const auto without = std::ranges::count(posed, false); without > 0)
        job.note(fmt::format("{} of {} pictures {} no pose in '{}' and {} left out", without,
                             posed.size(), without == 1 ? "has" : "have", log,
                             without == 1 ? "is" : "are"));
    return set;
}

}  // namespace stx::imagesets
