#include "formats/mpeg4/mapping/scene_sequence.hpp"

#include <algorithm>
#include <unordered_set>

#include "formats/mpeg4/mapping/background.hpp"
#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/mapping/view_notes.hpp"
#include "formats/mpeg4/scene/interpolators.hpp"
#include "formats/mpeg4/scene/scene_walk.hpp"

namespace stx::mpeg4 {
namespace {

/// Moments a second where only interpolators move.
constexpr double kSmoothRate = 25;
/// Decoded pictures that are kept, at most.
constexpr std::uint64_t kCacheBytes = 256u << 20;

/// Nodes that hold images of DepthImages and OctreeImages, wherever commands bring them; their
/// times as the scene has them then.
std::vector<NodePtr> texturesOf(const Document& document, bool timesFromStart) {
    std::vector<NodePtr> textures;
    std::unordered_set<const Node*> seen;
    for (const CommandFrame& frame : document.frames)
        for (const Command& command : frame.commands)
            forEachNode(command, [&](const NodePtr& node) {
                if (node->info->find("diTexture") < 0) return;
                const NodePtr& texture = node->get<NodePtr>("diTexture");
                if (!texture) return;
                for (const Node::SetField& field : texture->setFields)
                    if (const auto* image = std::get_if<NodePtr>(&field.value);
                        image && *image && seen.insert(image->get()).second) {
                        textures.push_back(*image);
                        if (timesFromStart || frame.time == 0 || !(*image)->is("MovieTexture"))
                            continue;
                        textures.back() = std::make_shared<Node>(**image);
                        shiftTimes(*textures.back(), static_cast<double>(frame.time) /
                                                         document.sceneStream.timescale);
                    }
            });
    return textures;
}

/// What a film's own clock shows when the presentation begins.
double startOf(const Scene& scene, const Limits& limits) {
    const auto shown = shownScene(scene.root, limits);
    if (!shown) return 0;  // what is wrong is told when a frame is read
    for (const ShownInfo& info : shown->infos)
        if (const auto start = ViewNotes::parse(info.text).start) return *start;
    return 0;
}

class SceneSequence : public Sequence {
  public:
    SceneSequence(Document document, SceneReadOptions options)
        : document_(std::move(document)),
          options_(std::move(options)),
          moments_(document_.frames,
                   options_.timesFromStart ? 0 : document_.sceneStream.timescale) {}

    Result<void> prepare(Job& job) {
        STX_TRY(images_, StreamImages::make(document_, options_.folder, job.limits));
        STX_TRY(timeline_, timelineOf(document_, images_, options_.timesFromStart));
        // Of what stands still no picture is asked for twice.
        if (timeline_.moves())
            images_.keepPictures(
                std::min<std::uint64_t>(kCacheBytes, job.limits.maxMemoryBytes / 4));
        STX_TRY(const auto scene, composeScene(document_.frames, document_.frames.front().time));
        start_ = startOf(scene, job.limits);
        // Once for all frames: it is what stands still.
        if (options_.pixels && options_.environment) {
            STX_TRY(environment_, environmentFromScene(document_, options_, job));
            options_.environment = false;
        }
        return {};
    }

    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(const Scene* scene, sceneAt(index));
        STX_TRY(auto bundle, bundleOfMoment(document_, *scene, images_, options_, job));
        setTime(bundle, index);
        bundle.environment = environment_;
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(const Scene* scene, sceneAt(index));
        // Both live as long as this.
        const std::shared_ptr<void> nobody;
        STX_TRY(auto table, viewsOfMoment({nobody, &document_}, *scene, {nobody, &images_},
                                          options_, false, job));
        setTime(table->about(), index);
        table->about().environment = environment_;
        return table;
    }

  private:
    /// With the pictures of that moment.
    Result<const Scene*> sceneAt(std::size_t index) {
        const double now = timeline_.times[index] - start_;
        const double slack = timeline_.slack(timeline_.times[index]);
        STX_TRY(Scene * scene,
                moments_.at(ticksBegun(now, document_.sceneStream.timescale, slack)));
        applyInterpolators(*scene, now);
        images_.setTime(now, slack);
        return scene;
    }

    std::shared_ptr<const Environment> environment_;
    Document document_;
    SceneReadOptions options_;
    SceneInTime moments_;
    StreamImages images_;
    double start_ = 0;  ///< of the film's clock
};

}  // namespace

// Whether an interpolator or a command reaches what views are made of or are placed by is not
// asked: a moment at which nothing changes costs a frame and harms nothing.
Result<Timeline> timelineOf(const Document& document, const StreamImages& images,
                            bool timesFromStart) {
    Timeline line;
    std::vector<double>& times = line.times;
    double end = 0, coarsest = 0;
    std::uint64_t most = document.frames.size();
    for (const NodePtr& texture : texturesOf(document, timesFromStart)) {
        const ElementaryStream* stream = images.stream(*texture);
        if (!stream || stream->samples.size() < 2) continue;
        const Presentation& shown = images.presentation(*stream);
        const auto changes = changesOf(*texture, shown, end);
        coarsest = std::max(coarsest, shown.tick);
        most += changes.size();
        if (most > kMostMoments)
            return fail(ErrorCode::unsupported, "the presentation has more than {} moments",
                        kMostMoments);
        times.insert(times.end(), changes.begin(), changes.end());
    }
    for (const CommandFrame& frame : document.frames)
        times.push_back(static_cast<double>(frame.time) / document.sceneStream.timescale);
    if (document.frames.size() > 1 || coarsest == 0)
        coarsest = std::max(coarsest, 1.0 / document.sceneStream.timescale);
    const double begin =
        static_cast<double>(document.frames.front().time) / document.sceneStream.timescale;
    const bool pictures = end > 0;
    STX_TRY(const auto scene, composeScene(document.frames, document.frames.front().time));
    for (const ClockSpan& span : clockSpans(scene)) {
        if (!pictures) {
            const double steps = (span.end - span.begin) * kSmoothRate;
            if (times.size() + steps > static_cast<double>(kMostMoments))
                return fail(ErrorCode::unsupported,
                            "a TimeSensor runs for {:g} s; that and what else moves are more than "
                            "{} moments",
                            span.end - span.begin, kMostMoments);
            int i = 0;
            for (; i < steps; ++i) times.push_back(span.begin + i / kSmoothRate);
            // The end is held, so it is a moment; at the step that reaches it, so that all last
            // equally long.
            if (span.stops && times.back() < span.end - halfTick(coarsest, span.end))
                times.push_back(span.begin + i / kSmoothRate);
        }
        end = std::max(end, pictures ? end : span.end);
    }
    if (end > kLatestMoment) end = 0;
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
    line.findTick();
    line.tick = std::max(line.tick, coarsest);
    if (const double own = startOf(scene, images.limits()); own != 0) {
        for (double& time : times) time += own;
        line.end += own;
        // Where doubles are that coarse, neighbours may round to one.
        times.erase(std::unique(times.begin(), times.end()), times.end());
    }
    return line;
}

Result<std::unique_ptr<Sequence>> sequenceFromScene(Document document,
                                                    const SceneReadOptions& options, Job& job) {
    if (document.frames.empty())
        return fail(ErrorCode::invalidInput, "the presentation has no scene");
    auto sequence = std::make_unique<SceneSequence>(std::move(document), options);
    STX_CHECK(sequence->prepare(job));
    return sequence;
}

}  // namespace stx::mpeg4
