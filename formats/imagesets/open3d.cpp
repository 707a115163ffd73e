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
#include "lib/base/whole_number.hpp"

namespace stx::imagesets {
namespace {

/// What Open3D takes where no file tells: PrimeSense's default.
constexpr double kPrimeSense[4] = {525, 525, 319.5, 239.5};

struct LoggedPose {
    std::size_t frame = 0;  ///< in the order of the files' names
    glm::dmat3 rotation = glm::dmat3(1.0);
    glm::dvec3 centre = glm::dvec3(0.0);
    std::string where;
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
            STX_TRY(const auto n, numbersOf(words, 0, 4, line.where()));
            const auto r = static_cast<int>(row);
            for (int column = 0; column < 3; ++column)
                pose.rotation[column][r] = n[static_cast<std::size_t>(column)];
            pose.centre[r] = n[3];
        }
        poses.push_back(std::move(pose));
    }
    return poses;
}

/// fx fy cx cy: given, else those of a JSON in the folder, else the usual ones, with a note.
Result<std::array<double, 4>> intrinsicsOf(const path& folder, const ImageSetOptions& options,
                                           Job& job) {
    std::array<double, 4> k;
    std::copy_n(options.intrinsics, 4, k.begin());
    if (k[0] != 0) return k;
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
        return std::array{m[0].get<double>(), m[4].get<double>(), m[6].get<double>(),
                          m[7].get<double>()};
    }
    std::copy_n(kPrimeSense, 4, k.begin());
    job.note(
        fmt::format("the set does not tell its intrinsics; PrimeSense's usual ones are used "
                    "(fx {:g}, fy {:g}, cx {:g}, cy {:g}); others with --intrinsics",
                    k[0], k[1], k[2], k[3]));
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
    STX_TRY(const auto bytes, readFile(folder / log, job.limits));
    STX_TRY(const auto poses, within(logWhere, parseLog(textOf(bytes))));
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
    STX_TRY(const auto k, intrinsicsOf(folder, options, job));
    if (k[0] == 0 || k[1] == 0)
        return failAt(where, ErrorCode::invalidInput, "the focal lengths are {:g} and {:g}", k[0],
                      k[1]);
    SetDescription set;
    std::optional<glm::ivec2> size;
    std::vector<bool> posed(colours.size(), false);
    for (const LoggedPose& pose : poses) {
        if (pose.frame >= colours.size())
            return failAt(logWhere + ": " + pose.where, ErrorCode::invalidInput,
                          "a pose of frame {}, but there are {} pictures", pose.frame,
                          colours.size());
        posed[pose.frame] = true;
        SetView view;
        view.name = path(colours[pose.frame]).stem().string();
        STX_CHECK(findPictures(folder, colourFolder + "/" + colours[pose.frame],
                               "depth/" + depths[pose.frame], where, job.limits, view));
        if (!size) {
            STX_TRY(size, within(where, imageSizeOf(view.texture, job)));
        }
        VisionCamera v;
        STX_TRY(v.worldFromCamera,
                repairRotation(pose.rotation, k[0], logWhere + ": " + pose.where, job));
        v.centre = pose.centre;
        v.fx = k[0];
        v.fy = k[1];
        // They count from the first pixel's centre.
        v.cx = k[2] + 0.5;
        v.cy = k[3] + 0.5;
        v.width = size->x;
        v.height = size->y;
        view.camera = cameraFromVision(v);
        view.distances = scaledIntegers(unitOf(options, kMillimetre));
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
