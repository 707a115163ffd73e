#include "formats/mpeg4/mapping/scene_timeline.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "formats/mpeg4/scene/interpolators.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"

namespace stx::mpeg4 {
namespace {

/// Moments a second where only interpolators move.
constexpr double kSmoothRate = 25;
/// Nodes of the scene that are walked for all moments together, so that a small hostile file cannot
/// keep us busy: as many as commands may cost, ten seconds.
constexpr std::int64_t kMaxVisits = 20'000'000;
/// Textures and clocks that are asked again in the time that one node is walked (0.5 and 0.05 us).
constexpr std::uint64_t kAskedPerVisit = 10;

/// Seconds, from `begin` and before `end`.
struct Span {
    double begin = 0, end = 0;
};

// Whether an interpolator or a command reaches what views are made of or are placed by is not
// asked: a moment at which nothing changes costs a frame and harms nothing.
class Moments {
  public:
    Moments(const Document& document, const StreamImages& images, bool timesFromStart)
        : document_(document),
          images_(images),
          scenes_(document.frames, document.sceneStream.timescale, timesFromStart,
                  [this](const Node& node, double now) { return isActive(node, images_, now); }) {}

    /// All moments, not sorted.
    Result<void> find() {
        const double sceneTick = 1.0 / document_.sceneStream.timescale;
        std::vector<double> commands, cuts;
        for (const CommandFrame& frame : document_.frames)
            commands.push_back(static_cast<double>(frame.time) / document_.sceneStream.timescale);
        begin = *std::ranges::min_element(commands);
        cuts = commands;
        for (const OdFrame& frame : document_.odFrames)
            descriptors_.push_back(static_cast<double>(frame.time) / document_.odStream.timescale);
        std::ranges::sort(descriptors_);
        cuts.insert(cuts.end(), descriptors_.begin(), descriptors_.end());
        std::erase_if(cuts, [&](double t) { return !(t >= begin && t <= kLatestMoment); });
        std::ranges::sort(cuts);
        cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
        if (document_.frames.size() > 1) coarsest = sceneTick;
        for (std::size_t i = 0; i < cuts.size(); ++i) {
            STX_TRY(const bool fits, goTo(cuts[i], i == 0));
            if (!fits) break;
            STX_CHECK(addMoments({cuts[i], i + 1 < cuts.size() ? cuts[i + 1] : kEver}));
        }
        times.insert(times.end(), commands.begin(), commands.end());
        if (coarsest == 0) coarsest = sceneTick;
        return {};
    }

    double begin = 0;  ///< of the scene
    std::set<std::string> lostEvents;
    std::vector<double> times;
    double end = 0;       ///< of what runs
    double coarsest = 0;  ///< seconds: the longest tick of a clock that something moves by

  private:
    /// Takes the scene and its streams as they are from a time on. False where commands do not fit
    /// the scene, of which the frames tell.
    Result<bool> goTo(double time, bool first) {
        std::vector<const ElementaryStream*> before;
        if (std::ranges::binary_search(descriptors_, time))
            for (const NodePtr& texture : textures_) before.push_back(images_.stream(*texture));
        const auto was = scenes_.structure();
        const std::uint32_t timescale = document_.sceneStream.timescale;
        auto scene = scenes_.at(ticksBegun(time, timescale, halfTick(1.0 / timescale, time)));
        if (!scene && first) return propagate(scene);
        if (!scene) return false;
        lostEvents.merge((*scene)->lostEvents);
        images_.setTime(time, halfTick(1.0 / document_.odStream.timescale, time));
        for (std::size_t i = 0; i < before.size(); ++i) {
            if (images_.stream(*textures_[i]) == before[i]) continue;
            times.push_back(time);
            break;
        }
        const auto is = scenes_.structure();
        if (first || was.views != is.views) STX_CHECK(findTextures(**scene));
        if (first || was.routes != is.routes) {
            clocks_ = clocksOf(**scene);
            visitsLeft_ -= static_cast<std::int64_t>((*scene)->routes.size());
        }
        asked_ += textures_.size() + clocks_.size();
        STX_CHECK(checkVisits());
        return true;
    }

    /// The images of DepthImages and OctreeImages, which may run.
    Result<void> findTextures(const Scene& scene) {
        textures_.clear();
        std::unordered_set<const Node*> seen;
        NodeList instances;
        const NodePtr root = withoutInstances(scene.root, visitsLeft_, instances);
        STX_CHECK(checkVisits());
        forEachNode(root, [&](const NodePtr& node) {
            if (!isDepthImage(*node)) return;
            const NodePtr& texture = node->get<NodePtr>("diTexture");
            if (!texture) return;
            for (const Node::SetField& field : texture->setFields)
                if (const auto* image = std::get_if<NodePtr>(&field.value);
                    image && *image && (*image)->info->find("url") >= 0 &&
                    seen.insert(image->get()).second)
                    textures_.push_back(*image);
        });
        return {};
    }

    [[nodiscard]] Result<void> checkVisits() const {
        if (visitsLeft_ - static_cast<std::int64_t>(asked_ / kAskedPerVisit) >= 0) return {};
        return fail(ErrorCode::unsupported,
                    "the commands restructure the scene too often (more than {} node visits)",
                    kMaxVisits);
    }

    struct Movie {
        const Node* texture;
        const Presentation* shown;
    };

    Result<void> addMoments(Span span) {
        std::vector<Movie> movies;
        std::vector<ClockRun> clocks, all;
        for (const NodePtr& texture : textures_) {
            const ElementaryStream* stream = images_.stream(*texture);
            if (!stream || stream->samples.size() < 2) continue;
            const Presentation& shown = images_.presentation(*stream);
            coarsest = std::max(coarsest, shown.tick);
            const auto run = runOfMovie(*texture, shown.duration);
            if (!run || shown.shown.size() < 2) continue;
            movies.push_back({texture.get(), &shown});
            if (run->end <= kLatestMoment || run->end == kEver) all.push_back(*run);
        }
        for (const NodePtr& clock : clocks_)
            if (const auto run = runOfClock(*clock)) {
                clocks.push_back(*run);
                all.push_back(*run);
            }
        const bool last = span.end == kEver;
        if (last) span.end = end = endOf(all, span.begin);
        std::vector<double> pictures;
        for (const Movie& movie : movies)
            if (!addChanges(*movie.texture, *movie.shown, span.begin, span.end, pictures) ||
                times.size() + pictures.size() > kMostMoments)
                return fail(ErrorCode::unsupported, "the presentation has more than {} moments",
                            kMostMoments);
        std::ranges::sort(pictures);
        for (const ClockRun& run : clocks) STX_CHECK(addSteps(run, span, last, pictures));
        times.insert(times.end(), pictures.begin(), pictures.end());
        return {};
    }

    /// Whether a picture begins less than a step from a time: it shows what has moved, too.
    static bool isNear(const std::vector<double>& pictures, double time, double slack) {
        const auto next = std::ranges::lower_bound(pictures, time);
        const double step = 1 / kSmoothRate - slack;
        return (next != pictures.end() && *next - time < step) ||
               (next != pictures.begin() && time - *std::prev(next) < step);
    }

    /// When all has ended that runs on from the last change of the scene.
    double endOf(const std::vector<ClockRun>& runs, double change) const {
        double ended = change;
        for (const ClockRun& run : runs)
            if (run.end != kEver) ended = std::max(ended, run.end);
        double until = ended;
        for (const ClockRun& run : runs) {
            if (run.end != kEver) continue;
            const double from = std::max(run.start, begin);
            const double slack = halfTick(coarsest, ended);
            // The change shows something from then on, other ends do not.
            const double cycles = std::max({1.0, std::ceil((ended - from - slack) / run.cycle),
                                            std::floor((change - from + slack) / run.cycle) + 1});
            if (const double full = from + cycles * run.cycle; full <= kLatestMoment)
                until = std::max(until, full);
        }
        return until;
    }

    /// The moments of a clock between those of pictures. Of one that ends, with the step that
    /// reaches the end, so that all last equally long. `last`: nothing changes after the span.
    Result<void> addSteps(const ClockRun& run, const Span& span, bool last,
                          const std::vector<double>& pictures) {
        const double slack = halfTick(coarsest, span.begin);
        if (run.start >= span.end || run.end <= span.begin + slack) return {};
        const double start = std::max(run.start, begin);
        const double until = std::min(run.end, span.end);
        const double first = std::ceil((std::max(start, span.begin) - start) * kSmoothRate - slack);
        const double steps = (until - start) * kSmoothRate;
        double i = first;
        for (; i < steps && times.size() <= kMostMoments; ++i)
            if (const double step = start + i / kSmoothRate; !isNear(pictures, step, slack))
                times.push_back(step);
        if (times.size() + pictures.size() > kMostMoments)
            return fail(ErrorCode::unsupported,
                        "a TimeSensor runs for {:g} s; that and what else moves are more than {} "
                        "moments",
                        until - std::max(start, span.begin), kMostMoments);
        if (run.end > span.end) return {};
        const double before = start + (i - 1) / kSmoothRate;
        if (before >= run.end - halfTick(coarsest, run.end)) return {};
        const double reached = start + i / kSmoothRate;
        times.push_back(last ? reached : std::min(reached, span.end));
        return {};
    }

    const Document& document_;
    StreamImages images_;
    SceneInTime scenes_;
    std::vector<double> descriptors_;  ///< when they change, ascending
    std::vector<NodePtr> textures_, clocks_;
    std::int64_t visitsLeft_ = kMaxVisits;
    std::uint64_t asked_ = 0;
};

}  // namespace

Result<Scene> sceneAtStart(const Document& document, StreamImages images, bool timesFromStart) {
    const std::uint32_t timescale = document.sceneStream.timescale;
    const std::uint64_t ticks = document.frames.front().time;
    const double now = static_cast<double>(ticks) / timescale;
    MovingScene moments(
        document.frames, timescale, timesFromStart,
        [&images](const Node& node, double time) { return isActive(node, images, time); });
    STX_TRY(Scene * scene, moments.at(now, ticks, halfTick(1.0 / timescale, now)));
    return std::move(*scene);
}

OwnClock ownClock(const Scene& scene, const Limits& limits) {
    OwnClock own;
    const auto shown = shownScene(scene.root, limits);
    if (!shown) return own;  // reading a frame gives the error
    std::optional<double> start;
    for (const ShownInfo& info : shown->infos) {
        const ViewNotes notes = ViewNotes::parse(info.text);
        if (!start) start = notes.start;
        if (!own.duration) own.duration = notes.duration;
    }
    own.start = start.value_or(0);
    return own;
}

bool isActive(const Node& node, StreamImages& images, double now) {
    // Clocks of commands are no finer than what halfTick() takes at most, or exact.
    const double slack = halfTick(1, now);
    if (node.is("TimeSensor")) {
        const auto run = runOfClock(node);
        return run && run->activeAt(now, slack);
    }
    if (!node.is("MovieTexture")) return false;
    images.setTime(now, slack);
    const ElementaryStream* stream = images.stream(node);
    if (!stream || stream->samples.size() < 2) return false;
    const auto run = runOfMovie(node, images.presentation(*stream).duration);
    return run && run->activeAt(now, slack);
}

Result<Timeline> timelineOf(const Document& document, const StreamImages& images,
                            bool timesFromStart, Job* job) {
    Moments moments(document, images, timesFromStart);
    STX_CHECK(moments.find());
    if (job != nullptr && !moments.lostEvents.empty())
        job->note(fmt::format("commands move nothing through these, which are not followed: {}",
                              fmt::join(moments.lostEvents, ", ")));
    Timeline line;
    std::vector<double>& times = line.times = std::move(moments.times);
    const double begin = moments.begin, end = moments.end, coarsest = moments.coarsest;
    std::erase_if(times, [&](double t) { return !(t >= begin && t <= kLatestMoment); });
    std::ranges::sort(times);
    times.erase(std::unique(times.begin(), times.end(),
                            [&](double a, double b) { return b - a <= halfTick(coarsest, b); }),
                times.end());
    if (times.empty() || times.front() > begin + halfTick(coarsest, begin))
        times.insert(times.begin(), begin);
    line.end = times.back();
    if (times.size() > 1) {
        const double step = times[times.size() - 1] - times[times.size() - 2];
        line.end = end > times.back() ? end : times.back() + step;
    }
    STX_TRY(const auto scene, sceneAtStart(document, images, timesFromStart));
    const OwnClock own = ownClock(scene, images.limits());
    if (own.duration) line.end = std::max(times.back(), times.front() + *own.duration);
    line.findTick();
    line.tick = std::max(line.tick, coarsest);
    if (own.start != 0) {
        for (double& time : times) time += own.start;
        line.end += own.start;
        // Where doubles are that coarse, neighbours may round to one.
        times.erase(std::unique(times.begin(), times.end()), times.end());
    }
    return line;
}

}  // namespace stx::mpeg4
