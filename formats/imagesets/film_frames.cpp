// Films as image sets: a colour and a depth film for each camera, matched by time.

#include "formats/imagesets/film_frames.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "formats/files/messages.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/patterns.hpp"
#include "formats/imagesets/pictures.hpp"
#include "formats/video/film.hpp"
#include "lib/base/counted.hpp"
#include "lib/model/sequence.hpp"

namespace stx::imagesets {
namespace {

bool isFilmName(const std::string& name) {
    std::string ending = path(name).extension().string();
    for (char& c : ending)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    constexpr std::string_view kEndings[] = {".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi"};
    return std::ranges::find(kEndings, ending) != std::end(kEndings);
}

/// The median distance of neighbours; 0 of one frame.
double stepOf(const std::vector<double>& times) {
    std::vector<double> steps;
    for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
    if (steps.empty()) return 0;
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    return *middle;
}

int nearest(const std::vector<double>& times, double time) {
    const auto next = std::ranges::lower_bound(times, time);
    if (next == times.begin()) return 0;
    const auto before = std::prev(next);
    const bool later = next != times.end() && *next - time < time - *before;
    return static_cast<int>((later ? next : before) - times.begin());
}

enum class TakenFor { colour, depth };

/// The track of a film that is taken for colour or depth. Depth is grey as a rule and colour is
/// not: of several tracks it is the only one of that kind, else the first. A note says which.
int trackFor(const Film& film, TakenFor use, Job& job) {
    const auto& tracks = film.tracks();
    const auto videos = std::ranges::count_if(tracks, &Film::Track::video);
    const bool grey = use == TakenFor::depth;
    const auto isOfKind = [grey](const Film::Track& track) {
        return track.video && track.pixels.starts_with("gray") == grey;
    };
    const bool onlyOne = std::ranges::count_if(tracks, isOfKind) == 1;
    if (videos > 1)
        job.note(fmt::format("{} has {} tracks of video; the {} is taken for {}",
                             inQuotes(film.path().string()), videos,
                             !onlyOne ? "first"
                             : grey   ? "grey one"
                                      : "one that is not grey",
                             grey ? "depth" : "colour"));
    if (videos < 2 || !onlyOne) return film.firstVideo();
    return static_cast<int>(std::ranges::find_if(tracks, isOfKind) - tracks.begin());
}

/// A film that the command names: in the folder of the cameras, or from where we are. What the
/// cameras' file puts into the name for {name} reaches nothing outside.
Result<std::shared_ptr<Film>> openNamed(const path& folder, const std::string& pattern,
                                        const Placeholders& words, TakenFor use, bool strict,
                                        Job& job) {
    const std::string name = filled(pattern, words);
    std::error_code ec;
    const path inFolder = (folder / name).lexically_normal();
    const path file = std::filesystem::exists(inFolder, ec) ? inFolder : path(name);
    if (pattern.find("{name}") != std::string::npos && !job.limits.allowOutside &&
        (words.name.find('/') != std::string::npos || words.name == ".."))
        return failAt(inQuotes(name), ErrorCode::invalidInput,
                      "the camera's name '{}' leads to another folder; give --allow-outside if it "
                      "may",
                      words.name);
    if (!std::filesystem::exists(file, ec))
        return failAt(inQuotes(name), ErrorCode::io, "it exists neither in '{}' nor where stx runs",
                      folder.string());
    STX_TRY(auto film, Film::open(file, job.limits));
    STX_CHECK(film->select(trackFor(*film, use, job), strict, job));
    return std::shared_ptr<Film>(std::move(film));
}

/// What the cameras' file says of the depth of one of its cameras; nothing: it does not.
Result<std::optional<Distances>> toldDistances(const Json& json, JsonKind kind, std::size_t i,
                                               const std::string& where,
                                               const ImageSetOptions& options) {
    if (kind == JsonKind::transforms) return transformsDistances(json, where);
    const Json& camera = json["cameras"][i];
    const std::string place = fmt::format("{}: cameras[{}]", where, i);
    if (kind == JsonKind::cameras) return camerasDistances(camera, options, place);
    return mivDistances(camera, place);
}

/// What depth is, for each of the file's cameras.
Result<std::vector<Distances>> distancesOf(const Json& json, std::size_t count,
                                           const std::string& where,
                                           const ImageSetOptions& options) {
    if (options.depthUnit > 0)
        return std::vector<Distances>(count, scaledIntegers(options.depthUnit));
    if (options.depthMax > 0)
        return std::vector<Distances>(
            count, normalisedDisparity(options.depthMin, options.depthMax, true));
    const JsonKind kind = jsonKindOf(json);
    std::vector<Distances> each;
    for (std::size_t i = 0; i < count; ++i) {
        STX_TRY(const auto told, toldDistances(json, kind, i, where, options));
        if (!told)
            return failAt(where, ErrorCode::invalidInput,
                          "it does not say what the values of depth are; give --depth-unit (scene "
                          "units of one step, 0.001 for millimetres in metres) or --depth-range");
        each.push_back(*told);
    }
    return each;
}

/// One film of colour and one of depth.
struct FilmPair {
    std::string name;
    std::shared_ptr<Film> colour, depth;
    std::vector<std::size_t> views;  ///< of the cameras' file: one, or the poses of one that moves
};

double firstPose(const FilmPair& pair, const std::vector<SetView>& views) {
    double first = std::numeric_limits<double>::infinity();
    for (const std::size_t v : pair.views) first = std::min(first, *views[v].time);
    return first;
}

/// Whether poses and frames are of one time. Poses that are all elsewhere are of another clock, and
/// count from the film's start.
bool sameClock(const FilmPair& pair, const std::vector<SetView>& views,
               const std::vector<FramePair>& frames) {
    double last = -std::numeric_limits<double>::infinity();
    for (const std::size_t v : pair.views) {
        if (!views[v].time) return true;
        last = std::max(last, *views[v].time);
    }
    const double slack = halfTick(0.001, last);
    return firstPose(pair, views) <= frames.back().time + slack &&
           last >= frames.front().time - slack;
}

/// The pose of a frame: one for all, one for each, or by its time, of the poses' clock.
Result<std::size_t> poseOf(const FilmPair& pair, const std::vector<SetView>& views,
                           std::size_t frame, std::size_t frames, double time,
                           const std::string& where) {
    if (pair.views.size() == 1) return pair.views[0];
    const bool timed =
        std::ranges::all_of(pair.views, [&](std::size_t v) { return views[v].time.has_value(); });
    if (timed) {
        std::size_t best = pair.views[0];
        double least = std::numeric_limits<double>::infinity();
        for (const std::size_t v : pair.views)
            if (const double away = std::abs(*views[v].time - time); away < least) {
                least = away;
                best = v;
            }
        return best;
    }
    if (pair.views.size() == frames) return pair.views[frame];
    return failAt(
        where, ErrorCode::invalidInput,
        "it has {} cameras for {} frames of '{}'; one camera, one for each frame, cameras "
        "with 'time', or names of films with {{name}} are expected",
        pair.views.size(), frames, pair.colour->path().filename().string());
}

}  // namespace

bool namesFilms(const ImageSetOptions& options) {
    return isFilmName(options.texturePattern) || isFilmName(options.depthPattern);
}

PictureSource frameOf(const std::shared_ptr<Film>& film, int frame) {
    PictureSource source;
    source.path = film->path();
    source.name = film->path().filename().string();
    source.film = film;
    source.frame = frame;
    return source;
}

Result<std::vector<FramePair>> pairFrames(const Film& colour, const Film& depth,
                                          const std::string& where, Job& job) {
    const auto &ct = colour.times(), &dt = depth.times();
    // Both may be rounded, to milliseconds as a rule.
    const double slack = std::max(stepOf(ct), stepOf(dt)) / 2 + 2 * halfTick(0.001, dt.back());
    std::vector<FramePair> pairs;
    for (int i = 0; i < depth.count(); ++i) {
        const double time = dt[static_cast<std::size_t>(i)];
        const int k = nearest(ct, time);
        if (std::abs(ct[static_cast<std::size_t>(k)] - time) <= slack)
            pairs.push_back({k, i, time});
    }
    if (pairs.size() < dt.size() && ct.size() == dt.size()) {
        job.note(
            fmt::format("{}: the films begin at {:.4g} s and {:.4g} s; their {} frames are "
                        "matched one by one",
                        where, ct.front(), dt.front(), ct.size()));
        pairs.clear();
        for (int i = 0; i < depth.count(); ++i)
            pairs.push_back({i, i, dt[static_cast<std::size_t>(i)]});
    }
    if (pairs.empty())
        return failAt(where, ErrorCode::invalidInput,
                      "no frame of depth ({:.4g} to {:.4g} s) is of the time of a frame of colour "
                      "({:.4g} to {:.4g} s)",
                      dt.front(), dt.back(), ct.front(), ct.back());
    if (pairs.size() < dt.size())
        job.note(
            fmt::format("{}: {} of {} frames of depth are left out, as no frame of colour is "
                        "of their time",
                        where, dt.size() - pairs.size(), dt.size()));
    std::set<int> shown;
    for (const FramePair& pair : pairs) shown.insert(pair.colour);
    if (shown.size() < ct.size())
        job.note(
            fmt::format("{}: {} of {} frames of colour are left out, as no frame of depth is "
                        "of their time",
                        where, ct.size() - shown.size(), ct.size()));
    return pairs;
}

void extendTo(std::optional<double>& end, const std::vector<FramePair>& frames, const Film& depth) {
    const double last = frames.back().time;
    if (depth.lastDuration() > 0) end = std::max(end.value_or(last), last + depth.lastDuration());
}

namespace {

Result<std::vector<SetView>> camerasOf(const Json& json, const std::string& where, Job& job) {
    switch (jsonKindOf(json)) {
        case JsonKind::transforms:
            return within(where, transformsViews(json, job));
        case JsonKind::miv:
            return within(where, mivViews(json, job));
        case JsonKind::cameras:
            return within(where, camerasJsonViews(json, job));
        default:
            return failAt(
                where, ErrorCode::invalidInput,
                "the cameras of films are those of a transforms.json, of MIV's list or of "
                "our cameras.json; this is none of them");
    }
}

/// The films of each view, or the one pair of all, opened.
Result<std::vector<FilmPair>> openPairs(const std::vector<SetView>& views, const path& folder,
                                        const ImageSetOptions& options, Job& job) {
    const bool each = options.texturePattern.find("{name}") != std::string::npos ||
                      options.depthPattern.find("{name}") != std::string::npos;
    std::vector<FilmPair> pairs;
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (!each && i > 0) {
            pairs[0].views.push_back(i);
            continue;
        }
        const SetView& view = views[i];
        const Placeholders words{view.name, view.camera.width, view.camera.height, options.frame};
        FilmPair pair;
        pair.name = !each && !view.taker.empty() ? view.taker : view.name;
        STX_TRY(pair.colour, openNamed(folder, options.texturePattern, words, TakenFor::colour,
                                       options.strict, job));
        STX_TRY(pair.depth, openNamed(folder, options.depthPattern, words, TakenFor::depth,
                                      options.strict, job));
        pair.views = {i};
        pairs.push_back(std::move(pair));
    }
    return pairs;
}

/// Turns depth as its colour is, where it does not say itself how it lies and its shape does.
void turnDepth(const FilmPair& pair, Job& job) {
    const Film::Track &colour = pair.colour->chosen(), &depth = pair.depth->chosen();
    if (colour.turn.none() || !depth.turn.none()) return;
    const DepthTurn turn =
        depthTurnOf({depth.width, depth.height}, {colour.width, colour.height},
                    colour.turn.sideways(), pair.depth->path().filename().string());
    if (turn.asPicture) pair.depth->turn(colour.turn);
    if (!turn.note.empty())
        job.note(fmt::format("{}: {}", inQuotes(pair.colour->path().string()), turn.note));
}

/// Adds the frames of a pair as views of a set, each with its pose.
Result<void> addFrames(const FilmPair& pair, const std::vector<SetView>& views,
                       const std::vector<Distances>& distances, const std::string& where, Job& job,
                       SetDescription& set) {
    const std::string films = fmt::format("{} and {}", inQuotes(pair.colour->path().string()),
                                          inQuotes(pair.depth->path().string()));
    STX_TRY(const auto frames, pairFrames(*pair.colour, *pair.depth, films, job));
    extendTo(set.end, frames, *pair.depth);
    double away = 0;
    if (pair.views.size() > 1 && !sameClock(pair, views, frames)) {
        away = frames.front().time - firstPose(pair, views);
        job.note(
            fmt::format("{}: the poses are not of the films' time, which begins at {:.12g} "
                        "s: they count from the first frame",
                        films, frames.front().time));
    }
    for (std::size_t k = 0; k < frames.size(); ++k) {
        STX_TRY(const std::size_t pose,
                poseOf(pair, views, k, frames.size(), frames[k].time - away, where));
        SetView view = views[pose];
        view.name = pair.name;
        view.taker = pair.name;
        view.time = frames[k].time;
        view.texture = frameOf(pair.colour, frames[k].colour);
        view.depth = frameOf(pair.depth, frames[k].depth);
        view.distances = distances[pose];
        view.planes.reset();
        set.views.push_back(std::move(view));
    }
    return {};
}

}  // namespace

Result<SetDescription> describeFilms(const path& given, const ImageSetOptions& options, Job& job) {
    if (options.texturePattern.empty() || options.depthPattern.empty())
        return fail(ErrorCode::usage,
                    "films come in pairs: give --texture and --depth, with the cameras' file as "
                    "input");
    std::error_code ec;
    const path file = std::filesystem::is_directory(given, ec) ? given / "transforms.json" : given;
    const std::string where = inQuotes(file.string());
    STX_TRY(const Json json, readJson(file, job.limits));
    STX_TRY(const auto views, camerasOf(json, where, job));
    if (views.empty()) return failAt(where, ErrorCode::invalidInput, "it has no camera");
    STX_TRY(const auto distances, distancesOf(json, views.size(), where, options));
    STX_TRY(const auto pairs, openPairs(views, folderOf(file), options, job));
    SetDescription set;
    set.title = pairs[0].colour->path().stem().string();
    set.film = true;
    STX_TRY(set.origin, originOf(json, where));
    std::uint64_t count = 0;
    for (const FilmPair& pair : pairs) count += static_cast<std::uint64_t>(pair.depth->count());
    STX_CHECK(checkViewCount(count, job.limits, where));
    for (const FilmPair& pair : pairs) {
        turnDepth(pair, job);
        STX_CHECK(addFrames(pair, views, distances, where, job, set));
    }
    return set;
}

}  // namespace stx::imagesets
