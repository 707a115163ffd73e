#include "formats/imagesets/motion.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "formats/files/messages.hpp"

namespace stx::imagesets {
namespace {

/// A set in time lasts no longer, in seconds: nanoseconds that are taken for seconds still pass.
constexpr double kLongest = 1e15;

/// Times nearer than half of that are one moment: they are texts of six digits behind the point as
/// a rule, in seconds.
constexpr double kTick = 1e-6;

/// Of times in order.
bool oneMoment(double a, double b) {
    return b - a <= halfTick(kTick, b);
}

using Pose = std::tuple<double, double, double, double, double, double, double>;

Pose poseOf(const Camera& c) {
    return {c.position.x,    c.position.y,    c.position.z,   c.orientation.x,
            c.orientation.y, c.orientation.z, c.orientation.w};
}

/// The moment of a time, by number: the last that begins no later.
std::size_t momentNumber(double time, const std::vector<double>& moments) {
    return static_cast<std::size_t>(std::ranges::upper_bound(moments, time) - moments.begin()) - 1;
}

/// Whether views of which some have the same pose are those of one camera that moves and rests now
/// and then: one picture for each moment, no pose that comes back after another, and more poses
/// than half of the pictures. Where each camera stands still and took two pictures, there are no
/// more than half.
bool movesAndRests(const SetDescription& set, const std::vector<double>& moments,
                   std::size_t poses) {
    if (moments.size() != set.views.size() || 2 * poses <= set.views.size()) return false;
    std::vector<const SetView*> inTime;
    for (const SetView& view : set.views) inTime.push_back(&view);
    std::ranges::sort(inTime, {}, [](const SetView* view) { return *view->time; });
    std::size_t moves = 0;
    for (std::size_t i = 1; i < inTime.size(); ++i)
        moves += poseOf(inTime[i]->camera) != poseOf(inTime[i - 1]->camera);
    return moves + 1 == poses;
}

/// Which camera took each view.
struct Takers {
    std::vector<std::string> names;  ///< of each view
    /// Cameras of which only poses say that they are several, and some took one picture only: they
    /// may be one that moves. 0: none.
    std::size_t doubtful = 0;
};

Takers takersOf(const SetDescription& set, const std::vector<double>& moments) {
    Takers takers;
    if (std::ranges::any_of(set.views, [](const SetView& v) { return !v.taker.empty(); })) {
        for (const SetView& view : set.views)
            takers.names.push_back(view.taker.empty() ? "camera" : view.taker);
        return takers;
    }
    struct OfPose {
        std::size_t number, pictures;
    };
    std::map<Pose, OfPose> poses;  // numbers in order of appearance
    for (const SetView& view : set.views)
        ++poses.try_emplace(poseOf(view.camera), OfPose{poses.size(), 0}).first->second.pictures;
    if (poses.size() == 1 || movesAndRests(set, moments, poses.size())) {
        takers.names.assign(set.views.size(), "camera");
        return takers;
    }
    if (poses.size() < set.views.size()) {
        for (const SetView& view : set.views)
            takers.names.push_back(fmt::format("camera{}", poses.at(poseOf(view.camera)).number));
        if (std::ranges::any_of(poses, [](const auto& pose) { return pose.second.pictures == 1; }))
            takers.doubtful = poses.size();
        return takers;
    }
    // No pose comes twice: cameras move, as many as there are pictures of one moment.
    std::vector<std::size_t> ofMoment(moments.size());
    for (const SetView& view : set.views) {
        const std::size_t rank = ofMoment[momentNumber(*view.time, moments)]++;
        takers.names.push_back(rank == 0 ? "camera" : fmt::format("camera{}", rank));
    }
    return takers;
}

bool beginsLater(const SetView& view, double time) {
    return !oneMoment(time, *view.time);
}

}  // namespace

Timeline Motion::timeline() const {
    Timeline line;
    line.times = times;
    line.end = end;
    line.findTick();
    return line;
}

std::optional<std::size_t> Motion::pictureAt(const SetDescription& set, const Track& track,
                                             std::size_t frame) const {
    const auto usable = [&](std::size_t picture) { return !gone.contains(picture); };
    const auto next = std::ranges::partition_point(track.views, [&](std::size_t picture) {
        return !beginsLater(set.views[picture], times[frame]);
    });
    const auto last = std::find_if(std::make_reverse_iterator(next), track.views.rend(), usable);
    if (last != track.views.rend()) return *last;
    const auto first = std::find_if(next, track.views.end(), usable);
    if (first == track.views.end()) return std::nullopt;
    return *first;
}

bool Motion::nothingBegan(const SetDescription& set, std::size_t frame) const {
    return std::ranges::all_of(tracks, [&](const Track& track) {
        const auto picture = pictureAt(set, track, frame);
        return !picture || beginsLater(set.views[*picture], times[frame]);
    });
}

SetDescription Motion::moment(const SetDescription& set, std::size_t frame) const {
    SetDescription now;
    now.title = set.title;
    now.origin = set.origin;
    now.environment = set.environment;
    for (const Track& track : tracks) {
        SetView view = set.views[*pictureAt(set, track, frame)];
        view.name = track.name;
        view.absent = beginsLater(view, times[frame]);
        now.views.push_back(std::move(view));
    }
    return now;
}

Result<Motion> motionOf(const SetDescription& set, const ImageSetOptions& options) {
    Motion motion;
    const auto timed = static_cast<std::size_t>(
        std::ranges::count_if(set.views, [](const SetView& v) { return v.time.has_value(); }));
    if (timed == 0) {
        if (options.moving == true && set.frames == 1)
            return fail(ErrorCode::invalidInput,
                        "no picture has a time, so that none moves (--moving)");
        return motion;
    }
    // A recording from a moving camera: its pictures are views of a scene that stands still.
    const bool recording = !set.film && std::ranges::any_of(set.views, &SetView::sensor);
    if (!options.moving.value_or(!recording)) return motion;
    if (timed < set.views.size())
        return fail(ErrorCode::invalidInput,
                    "{} of {} pictures have a 'time'; either all have one or none", timed,
                    set.views.size());
    std::vector<double> times;
    for (const SetView& view : set.views) {
        if (!std::isfinite(*view.time))
            return fail(ErrorCode::invalidInput, "the time of '{}' is {}; seconds are expected",
                        view.name, *view.time);
        times.push_back(*view.time);
    }
    std::ranges::sort(times);
    times.erase(std::unique(times.begin(), times.end(), oneMoment), times.end());
    if (times.size() < 2) return motion;
    const double span = times.back() - times.front();
    if (!(span <= kLongest))
        return fail(ErrorCode::invalidInput,
                    "the times of the pictures span {:g}; seconds are expected, or take all as "
                    "views of one moment (--still)",
                    span);
    // Where the set does not tell, the last picture is shown as long as pictures are on average.
    motion.end = set.end && *set.end > times.back()
                     ? *set.end
                     : times.back() + span / static_cast<double>(times.size() - 1);
    motion.times = std::move(times);

    const auto [takers, doubtful] = takersOf(set, motion.times);
    motion.doubtfulCameras = doubtful;
    for (std::size_t i = 0; i < set.views.size(); ++i) {
        auto track = std::ranges::find(motion.tracks, takers[i], &Motion::Track::name);
        if (track == motion.tracks.end())
            track = motion.tracks.insert(track, Motion::Track{takers[i], {}});
        track->views.push_back(i);
    }
    for (Motion::Track& track : motion.tracks) {
        std::ranges::stable_sort(track.views, [&](std::size_t a, std::size_t b) {
            return *set.views[a].time < *set.views[b].time;
        });
        for (std::size_t i = 1; i < track.views.size(); ++i) {
            const SetView& view = set.views[track.views[i]];
            const SetView& before = set.views[track.views[i - 1]];
            if (momentNumber(*view.time, motion.times) == momentNumber(*before.time, motion.times))
                return fail(ErrorCode::invalidInput,
                            "'{}' and '{}' are both of camera '{}' at {:g} s; give each picture "
                            "its own time, or take all as views of one moment (--still)",
                            before.name, view.name, track.name, *view.time);
        }
    }
    return motion;
}

}  // namespace stx::imagesets
