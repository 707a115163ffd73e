#include "formats/mpeg4/mapping/scene_sequence.hpp"

#include <algorithm>
#include <optional>

#include "formats/mpeg4/mapping/background.hpp"
#include "formats/mpeg4/mapping/media_clock.hpp"
#include "formats/mpeg4/scene/events.hpp"
#include "formats/mpeg4/scene/interpolators.hpp"

namespace stx::mpeg4 {
namespace {

class SceneSequence : public Sequence {
  public:
    SceneSequence(Document document, SceneReadOptions options)
        : document_(std::move(document)),
          options_(std::move(options)),
          moments_(document_.frames, document_.sceneStream.timescale, options_.timesFromStart,
                   [this](const Node& node, double now) { return isActive(node, images_, now); }) {}

    Result<void> prepare(Job& job) {
        STX_TRY(images_, StreamImages::make(document_, options_.folder, job.limits));
        STX_TRY(timeline_, timelineOf(document_, images_, options_.timesFromStart, &job));
        // Of what stands still no picture is asked for twice.
        if (timeline_.moves()) images_.keepPictures(keptPictureBytes(job.limits));
        STX_TRY(const auto scene, sceneAtStart(document_, images_, options_.timesFromStart));
        start_ = ownClock(scene, job.limits).start;
        noteBrokenKeys(document_, job);
        // Once for all frames: it is what stands still.
        if (options_.pixels && options_.environment) {
            STX_TRY(environment_, environmentFromScene(document_, options_, job));
            options_.environment = false;
        }
        return {};
    }

    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(const Scene* scene, sceneAt(index, job.limits));
        STX_TRY(auto bundle, bundleOfMoment(document_, *scene, *shown_, images_, options_, job));
        setTime(bundle, index);
        bundle.environment = environment_;
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(const Scene* scene, sceneAt(index, job.limits));
        // Both live as long as this.
        const std::shared_ptr<void> nobody;
        STX_TRY(auto table, viewsOfMoment({nobody, &document_}, *scene, *shown_, {nobody, &images_},
                                          options_, false, job));
        setTime(table->about(), index);
        table->about().environment = environment_;
        return table;
    }

  private:
    /// With what it shows and the pictures of that moment.
    Result<const Scene*> sceneAt(std::size_t index, const Limits& limits) {
        const double now = timeline_.times[index] - start_;
        const double slack = timeline_.slack(timeline_.times[index]);
        STX_TRY(Scene * scene,
                moments_.at(now, ticksBegun(now, document_.sceneStream.timescale, slack), slack));
        images_.setTime(now, slack);
        if (!shown_ || !shown_->isStillOf(*scene)) {
            shown_.reset();
            STX_SET(shown_, shownScene(scene->root, limits));
        }
        scene->restructured = false;
        scene->changed.clear();
        return scene;
    }

    std::shared_ptr<const Environment> environment_;
    Document document_;
    SceneReadOptions options_;
    MovingScene moments_;
    StreamImages images_;
    std::optional<ShownScene> shown_;  ///< of the moment that was asked for last
    double start_ = 0;                 ///< of the film's clock
};

}  // namespace

std::uint64_t keptPictureBytes(const Limits& limits) {
    constexpr std::uint64_t kMost = 256u << 20;
    return std::min(kMost, limits.maxMemoryBytes / 4);
}

void noteBrokenKeys(const Document& document, Job& job) {
    for (const std::string& broken : brokenKeys(document.frames))
        job.note(broken +
                 "; a key for each keyValue, in ascending order, is expected: its motion may stop "
                 "or jump");
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
