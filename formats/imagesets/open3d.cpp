// Recordings as Open3D and Redwood have them: color/ (or image/, rgb/), depth/ in millimetres, a
// trajectory of blocks of five lines (three numbers, then 4x4 camera to world, y down, z forward),
// and a JSON whose intrinsic_matrix goes by columns.

#include <algorithm>

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

/// Those of a JSON in the folder; nothing: there is none.
Result<std::optional<PixelIntrinsics>> toldIntrinsics(const path& folder, Job& job) {
    for (const std::string& name : filesIn(folder)) {
        if (path(name).extension() != ".json") continue;
        STX_TRY(const Json json, readJson(folder / name, job.limits));
        if (!json.is_object() || !json.contains("intrinsic_matrix")) continue;
        const Json& m = json["intrinsic_matrix"];
        const bool sound = m.is_array() && m.size() == 9 &&
                           std::ranges::all_of(m, [](const Json& v) { return v.is_number(); });
        if (!sound)
            return failAt(inQuotes((folder / name).string()), ErrorCode::invalidInput,
                          "'intrinsic_matrix' is not a list of 9 numbers");
        return PixelIntrinsics(m[0].get<double>(), m[4].get<double>(), m[6].get<double>(),
                               m[7].get<double>());
    }
    return std::nullopt;
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
    STX_TRY(const auto asked, within(where, givenIntrinsics(options)));
    auto told = asked;
    if (!told) {
        STX_TRY(told, toldIntrinsics(folder, job));
    }
    if (told && (told->x == 0 || told->y == 0))
        return failAt(where, ErrorCode::invalidInput, "the focal lengths are {:g} and {:g}",
                      told->x, told->y);
    PixelIntrinsics k(0);
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
            k = told ? *told : usualIntrinsics("PrimeSense's usual ones", kPrimeSense, *size, job);
            if (asked) noteOddCentre(k, *size, job);
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
        view.distances = sensorsOrFloats(options, kMillimetre);
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
