// TUM's RGB-D recordings and those of ICL-NUIM: 16-bit depth of 5000 steps a metre, poses camera to
// world with y down and z forward.

#include "formats/imagesets/rgbd.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <queue>
#include <tuple>

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

constexpr double kMetre = 1.0 / 5000;
/// What TUM's own tools take for the same moment, seconds.
constexpr double kSameTime = 0.02;

struct Intrinsics {
    PixelIntrinsics k;
    Lens lens;
    std::string_view whose;  ///< of pictures of 640x480, published; empty: told of these pictures
};

/// Those of a text file: four numbers, with a lens nine as TUM lists its cameras, or a matrix.
Result<Intrinsics> intrinsicsIn(const path& file, Job& job) {
    STX_TRY(const auto n, numbersIn(file, job.limits));
    if (n.size() == 4) return Intrinsics{{n[0], n[1], n[2], n[3]}, {}, {}};
    if (n.size() == 9) {
        const bool lastRow = n[6] == 0 && n[7] == 0 && n[8] == 1;
        if (lastRow && n[1] == 0 && n[3] == 0) return Intrinsics{{n[0], n[4], n[2], n[5]}, {}, {}};
        Lens lens;
        lens.k1 = n[4];
        lens.k2 = n[5];
        lens.p1 = n[6];
        lens.p2 = n[7];
        lens.k3 = n[8];
        // A matrix by columns has 0 in the place of fy.
        if (!lastRow && n[0] != 0 && n[1] != 0)
            return Intrinsics{{n[0], n[1], n[2], n[3]}, lens, {}};
    }
    return failAt(
        inQuotes(file.string()), ErrorCode::invalidInput,
        "{} numbers that are not a camera; 'fx fy cx cy', 'fx fy cx cy k1 k2 p1 p2 k3' or "
        "the matrix 'fx 0 cx 0 fy cy 0 0 1' is expected, or give --intrinsics",
        n.size());
}

/// Given, else in a file, else those published for the recording.
Result<Intrinsics> findIntrinsics(const path& folder, bool icl, const ImageSetOptions& options,
                                  const std::string& where, Job& job) {
    STX_TRY(const auto asked, within(where, givenIntrinsics(options)));
    if (asked) return Intrinsics{*asked, {}, {}};
    const std::string file = firstThere(folder, {"intrinsics.txt", "calibration.txt", "camera.txt",
                                                 "camera_intrinsics.txt", "camera-intrinsics.txt"});
    if (!file.empty()) return intrinsicsIn(folder / file, job);
    const std::string name = std::filesystem::absolute(folder).lexically_normal().string();
    const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
    if (icl) return Intrinsics{{481.2, -480.0, 319.5, 239.5}, {}, "ICL-NUIM's published ones"};
    if (has("freiburg1"))
        return Intrinsics{{517.3, 516.5, 318.6, 255.3},
                          {0.2624, -0.9531, 1.1633, -0.0054, 0.0026, 0},
                          "TUM's freiburg1 published ones"};
    if (has("freiburg2"))
        return Intrinsics{{520.9, 521.0, 325.1, 249.7},
                          {0.2312, -0.7849, 0.9172, -0.0033, -0.0001, 0},
                          "TUM's freiburg2 published ones"};
    if (has("freiburg3"))
        return Intrinsics{{535.4, 539.2, 320.1, 247.6}, {}, "TUM's freiburg3 published ones"};
    return Intrinsics{{525, 525, 319.5, 239.5}, {}, "the usual Kinect's published ones"};
}

struct TimedName {
    double time;
    std::string name;
};

Result<std::vector<TimedName>> readList(const path& folder, const std::string& file, Job& job) {
    STX_TRY(const auto bytes, readSetFile(folder / file, job.limits));
    const std::string where = inQuotes((folder / file).string());
    std::vector<TimedName> out;
    for (const TextLine& line : linesOf(textOf(bytes))) {
        const auto words = line.words();
        if (words.size() < 2)
            return failAt(where + ": " + line.where(), ErrorCode::invalidInput,
                          "'time file' is expected");
        STX_TRY(const double time, within(where, numberOf(words[0], line.where())));
        out.push_back({time, std::string(words[1])});
    }
    std::sort(out.begin(), out.end(), [](auto& a, auto& b) { return a.time < b.time; });
    return out;
}

/// A view's files and pose before the images are looked at.
struct Frame {
    double time;
    std::string texture, depth;
    TimedPose pose;
};

/// Colour and depth images of the same moment, each used once at most: the nearest pair first, as
/// TUM's associate.py pairs them. Two that are nearest are neighbours among those left in the order
/// of time.
std::vector<Frame> associate(const std::vector<TimedName>& colours,
                             const std::vector<TimedName>& depths) {
    struct Shot {
        double time;
        const TimedName* image;
        bool isDepth;
        std::size_t before, after;  // neighbours among those left, and an end on each side
        const TimedName* depth;     // of a colour image that has one
        bool left = true;
    };
    std::vector<Shot> shots(1);
    for (const TimedName& c : colours) shots.push_back({c.time, &c, false, 0, 0, nullptr});
    for (const TimedName& d : depths) shots.push_back({d.time, &d, true, 0, 0, nullptr});
    std::stable_sort(shots.begin() + 1, shots.end(),
                     [](auto& a, auto& b) { return a.time < b.time; });
    const std::size_t end = shots.size();
    shots.push_back({});
    for (std::size_t i = 1; i <= end; ++i) {
        shots[i].before = i - 1;
        shots[i - 1].after = i;
    }
    using Pair = std::tuple<double, std::size_t, std::size_t>;  // seconds apart; shots
    std::priority_queue<Pair, std::vector<Pair>, std::greater<>> pairs;
    const auto add = [&](std::size_t a, std::size_t b) {
        if (a == 0 || b == end || shots[a].isDepth == shots[b].isDepth) return;
        const double apart = shots[b].time - shots[a].time;
        if (apart <= kSameTime) pairs.emplace(apart, a, b);
    };
    for (std::size_t i = 1; i + 1 < end; ++i) add(i, i + 1);
    while (!pairs.empty()) {
        const auto [apart, a, b] = pairs.top();
        pairs.pop();
        if (!shots[a].left || !shots[b].left) continue;
        shots[a].left = shots[b].left = false;
        shots[shots[a].isDepth ? b : a].depth = shots[shots[a].isDepth ? a : b].image;
        const std::size_t before = shots[a].before, after = shots[b].after;
        shots[before].after = after;
        shots[after].before = before;
        add(before, after);
    }
    std::vector<Frame> frames;
    for (const Shot& shot : shots)
        if (shot.depth) frames.push_back({shot.time, shot.image->name, shot.depth->name, {}});
    return frames;
}

Result<std::vector<TimedPose>> readTrajectory(const path& folder, const std::string& file,
                                              bool strict, Job& job) {
    STX_TRY(const auto bytes, readSetFile(folder / file, job.limits));
    const std::string where = inQuotes((folder / file).string());
    STX_TRY(auto poses, within(where, parseTrajectory(textOf(bytes))));
    const auto lost = std::ranges::count(poses, true, &TimedPose::lost);
    STX_CHECK(noteLost(static_cast<std::size_t>(lost), poses.size(), where, strict, job));
    return poses;
}

/// The file in the folder with its poses; empty: there is none.
std::string trajectoryIn(const path& folder) {
    std::string found = firstThere(folder, {"groundtruth.txt", "pose.txt", "poses.txt",
                                            "trajectory.txt", "CameraTrajectory.txt"});
    if (found.empty())
        for (const std::string& name : filesIn(folder))
            if (name.ends_with(".gt.freiburg")) found = name;
    return found;
}

/// Files named by a number (`17.png`), by that number.
std::vector<std::pair<int, std::string>> numbered(const path& folder, const std::string& under) {
    std::vector<std::pair<int, std::string>> out;
    for (const std::string& name : filesIn(folder / under)) {
        const std::string stem = path(name).stem().string();
        if (const auto number = wholeNumber<int>(stem); number && *number >= 0)
            out.emplace_back(*number, fmt::format("{}/{}", under, name));
    }
    std::sort(out.begin(), out.end());
    return out;
}

using PosesByNumber = std::map<std::int64_t, const TimedPose*>;

/// Poses by the numbers that their lines begin with; empty: they have none, or times.
PosesByNumber posesByNumber(const std::vector<TimedPose>& poses) {
    constexpr double kMost = 1e9;  // seconds of a clock since 1970 are more
    PosesByNumber out;
    for (const TimedPose& pose : poses) {
        if (!pose.timed || pose.time != std::floor(pose.time) || !(std::abs(pose.time) < kMost))
            return {};
        out.emplace(static_cast<std::int64_t>(pose.time), &pose);
    }
    return out;
}

/// What is added to a picture's number to get that of its pose; nothing: the lines do not begin
/// with numbers of pictures. It is 0, but where pictures count from 0 and poses from 1, as
/// ICL-NUIM's, or the other way round, or where no number is that of a picture.
std::optional<std::int64_t> shiftToPoses(const std::vector<std::pair<int, std::string>>& pictures,
                                         const PosesByNumber& poses) {
    if (poses.empty()) return std::nullopt;
    const auto found = [&](std::int64_t shift) {
        return std::ranges::count_if(
            pictures, [&](const auto& p) { return poses.contains(p.first + shift); });
    };
    const std::int64_t counted = poses.begin()->first - pictures.front().first;
    const auto asTheyAre = found(0), shifted = found(counted);
    const bool shifts = shifted > asTheyAre && (std::abs(counted) == 1 || asTheyAre == 0);
    // Numbers of something else hit pictures by chance.
    if (2 * std::max(asTheyAre, shifted) < static_cast<std::ptrdiff_t>(pictures.size()))
        return std::nullopt;
    return shifts ? counted : 0;
}

/// color/N, depth/N and a line for each in pose.txt: by the number that the line begins with, else
/// the lines are those of the pictures from the first on, one for each number.
Result<std::vector<Frame>> framesByNumber(const path& folder, const std::string& colourFolder,
                                          const std::string& trajectory, bool strict, Job& job) {
    STX_TRY(const auto poses, readTrajectory(folder, trajectory, strict, job));
    const auto colours = numbered(folder, colourFolder);
    const auto depths = numbered(folder, "depth");
    const std::string where = inQuotes(folder.string());
    if (colours.empty() || depths.empty())
        return failAt(where, ErrorCode::io,
                      "no {}/N.png was found in it; pictures and depth images are expected as "
                      "{}/N.png and depth/N.png, or rgb.txt and depth.txt with their times",
                      colours.empty() ? colourFolder : "depth", colourFolder);
    const std::string poseWhere = inQuotes((folder / trajectory).string());
    const PosesByNumber ofNumbers = posesByNumber(poses);
    const auto shift = shiftToPoses(colours, ofNumbers);
    const int first = colours.front().first, last = colours.back().first;
    if (!shift && poses.size() > static_cast<std::size_t>(last - first) + 1)
        job.note(
            fmt::format("{}: {} poses for pictures {} to {}, and no numbers of pictures in its "
                        "lines: the first pose is taken for picture {}",
                        poseWhere, poses.size(), first, last, first));
    std::vector<Frame> frames;
    std::size_t without = 0;
    for (const auto& [number, name] : colours) {
        const auto depth = std::find_if(depths.begin(), depths.end(),
                                        [&, n = number](auto& d) { return d.first == n; });
        if (depth == depths.end())
            return failAt(where, ErrorCode::io, "'{}' has no depth image of the same number", name);
        const TimedPose* pose = nullptr;
        if (shift) {
            const auto of = ofNumbers.find(number + *shift);
            if (of != ofNumbers.end()) pose = of->second;
        } else {
            const auto line = static_cast<std::size_t>(number - first);
            if (line >= poses.size())
                return failAt(poseWhere, ErrorCode::invalidInput,
                              "{} poses, but there are images up to number {}", poses.size(), last);
            pose = &poses[line];
        }
        without += pose ? 0 : 1;
        if (pose && !pose->lost)
            frames.push_back({static_cast<double>(number), name, depth->second, *pose});
    }
    if (without > 0) {
        const std::string found =
            fmt::format("{} of {} pictures {} no pose of {} number", without, colours.size(),
                        without == 1 ? "has" : "have", without == 1 ? "its" : "their");
        if (strict) return failAt(poseWhere, ErrorCode::invalidInput, "{}", found);
        job.note(
            fmt::format("{}: {} and {} left out", poseWhere, found, without == 1 ? "is" : "are"));
    }
    return frames;
}

Result<std::vector<Frame>> framesByTime(const path& folder, const std::string& trajectory,
                                        bool strict, Job& job) {
    std::vector<Frame> frames;
    const std::string list =
        firstThere(folder, {"associations.txt", "associate.txt", "associated.txt"});
    if (!list.empty()) {
        STX_TRY(const auto bytes, readSetFile(folder / list, job.limits));
        const std::string where = inQuotes((folder / list).string());
        for (const TextLine& line : linesOf(textOf(bytes))) {
            const auto words = line.words();
            if (words.size() < 4)
                return failAt(where + ": " + line.where(), ErrorCode::invalidInput,
                              "'time colour time depth' is expected");
            STX_TRY(const double time, within(where, numberOf(words[0], line.where())));
            frames.push_back({time, std::string(words[1]), std::string(words[3]), {}});
            // ICL-NUIM's list has them the other way round.
            if (frames.back().texture.starts_with("depth"))
                std::swap(frames.back().texture, frames.back().depth);
        }
    } else {
        STX_TRY(const auto colours, readList(folder, "rgb.txt", job));
        STX_TRY(const auto depths, readList(folder, "depth.txt", job));
        frames = associate(colours, depths);
        if (frames.size() < colours.size())
            job.note(
                fmt::format("{} of {} colour images have no depth within {} s and are left out",
                            colours.size() - frames.size(), colours.size(), kSameTime));
    }
    STX_TRY(auto poses, readTrajectory(folder, trajectory, strict, job));
    std::erase_if(poses, [](const TimedPose& pose) { return pose.lost; });
    std::sort(poses.begin(), poses.end(), [](auto& a, auto& b) { return a.time < b.time; });
    std::vector<Frame> posed;
    for (Frame& frame : frames) {
        const auto pose = poseAt(poses, frame.time, kSameTime);
        if (!pose) continue;
        frame.pose = *pose;
        posed.push_back(std::move(frame));
    }
    if (posed.size() < frames.size())
        job.note(fmt::format("{} of {} images have no pose within {} s and are left out",
                             frames.size() - posed.size(), frames.size(), kSameTime));
    return posed;
}

}  // namespace

Result<std::vector<TimedPose>> parseTrajectory(std::string_view text) {
    std::vector<TimedPose> poses;
    for (const TextLine& line : linesOf(text)) {
        const auto words = line.words();
        if (words.size() != 7 && words.size() != 8)
            return failAt(
                line.where(), ErrorCode::invalidInput,
                "{} numbers; 't tx ty tz qx qy qz qw', or the same without t, is expected",
                words.size());
        const std::size_t first = words.size() - 7;
        STX_TRY(const auto n, numbersOf(words, first, 7, line.where(), Numbers::any));
        TimedPose pose;
        pose.time = static_cast<double>(poses.size());
        if (first == 1) {
            STX_TRY(pose.time, numberOf(words[0], line.where()));
            pose.timed = true;
        }
        const bool noTurn = n[3] == 0 && n[4] == 0 && n[5] == 0 && n[6] == 0;
        pose.lost = noTurn || !isTracked(n);
        if (pose.lost) {
            poses.push_back(pose);
            continue;
        }
        pose.position = {n[0], n[1], n[2]};
        const double length = std::hypot(std::hypot(n[3], n[4]), std::hypot(n[5], n[6]));
        if (!(length > 0.9 && length < 1.1))
            return failAt(line.where(), ErrorCode::invalidInput,
                          "the quaternion has the length {:g}; 1 is expected", length);
        pose.orientation = glm::normalize(glm::dquat(n[6], n[3], n[4], n[5]));
        poses.push_back(pose);
    }
    return poses;
}

std::optional<TimedPose> poseAt(const std::vector<TimedPose>& poses, double time, double gap) {
    const auto after = std::lower_bound(poses.begin(), poses.end(), time,
                                        [](const TimedPose& p, double t) { return p.time < t; });
    const TimedPose* b = after != poses.end() && after->time - time <= gap ? &*after : nullptr;
    const TimedPose* a = after != poses.begin() && time - std::prev(after)->time <= gap
                             ? &*std::prev(after)
                             : nullptr;
    if (!a && !b) return std::nullopt;
    if (!a || !b) return a ? *a : *b;
    const double span = b->time - a->time;
    const double t = span > 0 ? (time - a->time) / span : 0;
    return TimedPose{time, glm::mix(a->position, b->position, t),
                     glm::slerp(a->orientation, b->orientation, t)};
}

Result<SetDescription> describeRgbd(const path& given, const ImageSetOptions& options, Job& job) {
    std::error_code ec;
    const bool isFolder = std::filesystem::is_directory(given, ec);
    const path folder = isFolder ? given : folderOf(given);
    const std::string where = inQuotes(given.string());
    const std::string trajectory = isFolder ? trajectoryIn(folder) : given.filename().string();
    if (trajectory.empty())
        return failAt(where, ErrorCode::io,
                      "no trajectory was found in it; groundtruth.txt, pose.txt, trajectory.txt or "
                      "*.gt.freiburg is expected");
    const bool timed =
        !firstThere(folder, {"rgb.txt", "associations.txt", "associate.txt", "associated.txt"})
             .empty();
    const bool icl = !timed || trajectory.ends_with(".gt.freiburg");
    const std::string colourFolder =
        std::filesystem::is_directory(folder / "color", ec) ? "color" : "rgb";
    STX_TRY(auto frames,
            timed ? framesByTime(folder, trajectory, options.strict, job)
                  : framesByNumber(folder, colourFolder, trajectory, options.strict, job));
    if (frames.empty())
        return failAt(where, ErrorCode::invalidInput,
                      "no colour image has both a depth image and a pose of its time");
    STX_CHECK(
        checkViewCount(frames.size() / static_cast<std::size_t>(options.every), job.limits, where));
    STX_TRY(const Intrinsics found, findIntrinsics(folder, icl, options, where, job));
    PixelIntrinsics k = found.k;
    if (k.x == 0 || k.y == 0)
        return failAt(where, ErrorCode::invalidInput, "the focal lengths are {:g} and {:g}", k.x,
                      k.y);
    std::optional<DepthCamera> depth;

    SetDescription set;
    std::optional<glm::ivec2> size;
    for (const Frame& frame : frames) {
        SetView view;
        view.name = path(frame.texture).stem().string();
        if (timed) {
            view.time = frame.time;
            view.taker = "camera";  // one, even where it rests
        }
        STX_CHECK(findPictures(folder, frame.texture, frame.depth, where, job.limits, view));
        if (view.missing) {
            set.views.push_back(std::move(view));
            continue;
        }
        if (!size) {
            STX_TRY(size, within(where, imageSizeOf(view.texture, job)));
            // Damaged depth is an error where it is read.
            const glm::ivec2 depthSize = imageSizeOf(view.depth, job).value_or(*size);
            if (!found.whose.empty()) k = usualIntrinsics(found.whose, k, *size, job);
            if (options.intrinsics[0] != 0) noteOddCentre(k, *size, job);
            // Published recordings have their depth on the pixels of the pictures.
            KnownDepthCamera known;
            known.camera = {k.x, k.y, k.z + 0.5, k.w + 0.5, glm::dmat3(1.0), glm::dvec3(0.0)};
            STX_TRY(depth, depthCameraOf(options, known, *size, depthSize, where, job));
        }
        VisionCamera v;
        v.worldFromCamera = glm::mat3_cast(frame.pose.orientation);
        v.centre = frame.pose.position;
        v.fx = k.x;
        v.fy = k.y;
        // These sets count from the first pixel's centre.
        v.cx = k.z + 0.5;
        v.cy = k.w + 0.5;
        v.width = size->x;
        v.height = size->y;
        if (v.leftHanded())
            job.note(
                "the set's world is left-handed (fx or fy is negative); its z axis is negated");
        view.camera = cameraFromVision(v);
        if (depth) view.depthCamera = cameraBeside(v, *depth);
        view.lens = found.lens;
        view.distances = sensorsOrFloats(options, kMetre);
        view.sensor = true;
        set.views.push_back(std::move(view));
    }
    return set;
}

}  // namespace stx::imagesets
