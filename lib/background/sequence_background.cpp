#include "lib/background/sequence_background.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "lib/background/moving_cameras.hpp"
#include "lib/model/linear_views.hpp"
#include "lib/render/scene/page_set.hpp"

namespace stx {
namespace {

/// One view of the sequence; without a background when its camera moves.
struct CameraBackground {
    std::string name;
    Camera camera;
    std::optional<TemporalBackground> background;

    [[nodiscard]] bool remembers(int pass) const {
        return background && pass < background->passes();
    }
};

Result<void> addFrame(std::vector<CameraBackground>& cameras, const Bundle& bundle, double time,
                      int pass, Job& job) {
    if (bundle.views.size() != cameras.size())
        return fail(ErrorCode::invalidInput, "there are {} views where the first frame has {}",
                    bundle.views.size(), cameras.size());
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        CameraBackground& c = cameras[i];
        const ReferenceView& view = bundle.views[i];
        if (!c.remembers(pass)) continue;
        if (!sameCamera(view.camera, c.camera)) {
            c.background.reset();
            continue;
        }
        STX_CHECK(within(fmt::format("view '{}'", c.name), c.background->add(view, time, job)));
    }
    return {};
}

std::string backgroundName(const std::string& name, std::set<std::string>& taken) {
    std::string own = name + " background";
    for (int n = 2; !taken.insert(own).second; ++n) own = fmt::format("{} background {}", name, n);
    return own;
}

/// rememberBackgrounds() of frames, at least one, whose colours are of one kind.
Result<std::vector<BackgroundModel>> rememberOneKind(std::span<const double> times,
                                                     const FrameReader& read,
                                                     const TemporalBackgroundSettings& settings,
                                                     Job& job) {
    std::vector<CameraBackground> cameras;
    int passes = 1;
    std::set<std::string> names;
    const auto total = [&] { return static_cast<std::int64_t>(times.size()) * passes; };
    const auto anyStill = [&](int pass) {
        return cameras.empty() || std::any_of(cameras.begin(), cameras.end(),
                                              [&](const auto& c) { return c.remembers(pass); });
    };
    for (int pass = 0; pass < passes; ++pass) {
        for (std::size_t frame = 0; frame < times.size() && anyStill(pass); ++frame) {
            auto bundle = read(frame, job);
            if (!bundle) return propagate(bundle);
            // Background views that it has already are not pictures of this moment.
            std::erase_if(bundle->views, [](const ReferenceView& v) { return v.background; });
            if (cameras.empty()) {
                TemporalBackgroundSettings each = settings;
                each.maxMemoryBytes = (settings.maxMemoryBytes ? settings.maxMemoryBytes
                                                               : job.limits.maxMemoryBytes) /
                                      std::max<std::size_t>(bundle->views.size(), 1);
                for (const ReferenceView& view : bundle->views) {
                    STX_TRY(auto background, TemporalBackground::start(view, each, job));
                    passes = std::max(passes, background.passes());
                    names.insert(view.name);
                    cameras.push_back({view.name, view.camera, std::move(background)});
                }
            }
            STX_CHECK(within(fmt::format("frame {}", frame),
                             addFrame(cameras, *bundle, times[frame], pass, job)));
            job.progress(static_cast<std::int64_t>(times.size()) * pass +
                             static_cast<std::int64_t>(frame) + 1,
                         total(), "remembering");
        }
        for (CameraBackground& c : cameras)
            if (c.remembers(pass)) STX_CHECK(c.background->endPass(job));
    }
    std::vector<BackgroundModel> models;
    const auto take = [&](BackgroundModel model) {
        if (model.view.pointCount() == 0) {
            job.note(
                fmt::format("nothing stays behind what moves in view '{}'; it gets no "
                            "background",
                            model.view.name));
            return;
        }
        model.view.name = backgroundName(model.view.name, names);
        models.push_back(std::move(model));
    };
    std::vector<std::size_t> moving;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        if (!cameras[i].background) {
            moving.push_back(i);
            continue;
        }
        STX_TRY(auto model, cameras[i].background->finish(job));
        cameras[i].background.reset();
        take(std::move(model));
    }
    if (moving.empty()) return models;
    STX_TRY(auto fused, temporal::rememberMovingCameras(times, read, moving, settings, job));
    for (BackgroundModel& model : fused) take(std::move(model));
    return models;
}

}  // namespace

Result<std::vector<BackgroundModel>> rememberBackgrounds(std::span<const double> times,
                                                         const FrameReader& read,
                                                         const TemporalBackgroundSettings& settings,
                                                         Job& job) {
    if (times.empty())
        return fail(ErrorCode::invalidInput,
                    "the sequence has no frames; a background is made of at least two");
    // Which kinds there are shows while frames are read; linear light holds both.
    bool anyLinear = false, anyCoded = false;
    const FrameReader oneKind = [&](std::size_t frame, Job& part) -> Result<Bundle> {
        const bool known = anyLinear && anyCoded;
        STX_TRY(Bundle bundle, read(frame, part));
        for (const ReferenceView& view : bundle.views)
            if (!view.background) (view.texture.isLinear() ? anyLinear : anyCoded) = true;
        if (!anyLinear || !anyCoded) return bundle;
        if (!known) return fail(ErrorCode::failed, "colours are of two kinds");
        std::ranges::for_each(bundle.views, makeLinear);
        return bundle;
    };
    auto found = rememberOneKind(times, oneKind, settings, job);
    // Those before were taken as they are, so that all are taken again.
    if (!found && anyLinear && anyCoded) found = rememberOneKind(times, oneKind, settings, job);
    return found;
}

std::unique_ptr<Sequence> withBackgrounds(std::unique_ptr<Sequence> frames,
                                          std::vector<BackgroundModel> backgrounds) {
    auto added = std::make_shared<Bundle>();
    for (BackgroundModel& model : backgrounds) added->views.push_back(std::move(model.view));
    const Bounds more = added->computeBounds();
    return changed(std::move(frames), [added, more](Bundle& frame, Job&) -> Result<void> {
        std::erase_if(frame.views, [](const ReferenceView& view) { return view.background; });
        frame.views.insert(frame.views.end(), added->views.begin(), added->views.end());
        const auto linear = [](const ReferenceView& view) { return view.texture.isLinear(); };
        if (std::ranges::any_of(frame.views, linear))
            std::ranges::for_each(frame.views, makeLinear);
        if (frame.bounds && !more.empty()) {
            frame.bounds->add(more.min);
            frame.bounds->add(more.max);
        }
        return {};
    });
}

}  // namespace stx
