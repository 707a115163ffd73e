#include "lib/background/moving_cameras.hpp"

#include <algorithm>

#include "lib/background/background_vote.hpp"
#include "lib/background/key_background.hpp"
#include "lib/background/key_views.hpp"
#include "lib/base/median.hpp"
#include "lib/base/parallel.hpp"
#include "lib/registration/refine_poses.hpp"

namespace stx::temporal {
namespace {

/// Moments that key views are chosen from.
constexpr std::size_t kCandidates = 64;
/// Poses that move by more pixels when they are registered were not exact; less is noise.
constexpr double kInexact = 0.5;
/// A pose that moves by more of the picture's width has gone astray: it stays as given.
constexpr double kAstray = 0.05;
/// Frames beside the key views that tell whether poses are exact.
constexpr std::size_t kProbes = 4;

/// A camera's picture of one moment.
struct Moment {
    std::size_t frame = 0, view = 0;
};

/// The way from one pose to another, in the first one's axes.
Camera carried(const Camera& camera, const Camera& from, const Camera& to) {
    Camera out = camera;
    const glm::dquat turn = to.orientation * glm::conjugate(from.orientation);
    out.orientation = glm::normalize(turn * camera.orientation);
    out.position = to.position + turn * (camera.position - from.position);
    return out;
}

class MovingCameras {
  public:
    MovingCameras(std::span<const double> times, const FrameReader& read,
                  std::span<const std::size_t> views, const TemporalBackgroundSettings& settings,
                  Job& job)
        : times_(times), read_(read), views_(views), settings_(settings), job_(job) {}

    Result<std::vector<BackgroundModel>> run();

  private:
    /// The pictures of a frame, of all cameras that move.
    Result<std::vector<ReferenceView>> pictures(std::size_t frame);
    Result<void> choose();
    /// Whether poses must be registered; if so, key views are.
    Result<void> registerKeys();
    /// The pose of a picture among the key views'.
    Result<Camera> poseOf(const ReferenceView& view, const Moment& moment);
    Result<void> see(std::vector<KeyBackground>& keys, std::size_t first, DepthNoise& noise);
    Result<void> carve(std::vector<KeyBackground>& keys, const DepthNoise& noise);
    void progress() {
        ++done_;
        job_.progress(done_, std::max(done_, total_), "remembering");
    }

    std::span<const double> times_;
    const FrameReader& read_;
    std::span<const std::size_t> views_;
    const TemporalBackgroundSettings& settings_;
    Job& job_;

    std::vector<Moment> candidates_;
    std::vector<Glimpse> glimpses_;
    std::vector<int> chosen_;          ///< numbers of candidates
    std::vector<ReferenceView> keys_;  ///< their pictures, with registered poses
    std::vector<Camera> keyCameras_;   ///< their poses as given
    bool registers_ = false;
    double middle_ = 1;          ///< a distance that is usual in the scene
    std::vector<Camera> poses_;  ///< registered, of frame * views + view; width 0 = not yet
    std::int64_t points_ = 0, places_ = 0;
    std::int64_t done_ = 0, total_ = 0;
};

Result<std::vector<ReferenceView>> MovingCameras::pictures(std::size_t frame) {
    STX_CHECK(job_.checkCancelled());
    STX_TRY(Bundle bundle, read_(frame, job_));
    std::erase_if(bundle.views, [](const ReferenceView& v) { return v.background; });
    std::vector<ReferenceView> out;
    for (const std::size_t view : views_) {
        if (view >= bundle.views.size())
            return fail(ErrorCode::invalidInput, "frame {}: it has {} views, those before had more",
                        frame, bundle.views.size());
        ReferenceView& v = bundle.views[view];
        const auto where = [&](tl::unexpected<Error> e) {
            return tl::unexpected(
                e.value().at(fmt::format("view '{}'", v.name)).at(fmt::format("frame {}", frame)));
        };
        if (auto ok = v.checkHeader(); !ok) return where(tl::unexpected(ok.error()));
        if (v.camera.orthographic)
            return where(fail(ErrorCode::unsupported,
                              "an orthographic camera moves; only perspective ones are fused"));
        if (!keys_.empty() && v.texture.isLinear() != keys_[0].texture.isLinear())
            return where(fail(ErrorCode::invalidInput,
                              "linear and sRGB colours are mixed; one kind is expected"));
        out.push_back(std::move(v));
    }
    return out;
}

Result<void> MovingCameras::choose() {
    const std::size_t perView = std::max<std::size_t>(2, kCandidates / views_.size());
    const std::size_t count = std::min(times_.size(), perView);
    total_ = static_cast<std::int64_t>(count + 2 * times_.size());
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t frame = count > 1 ? i * (times_.size() - 1) / (count - 1) : 0;
        STX_TRY(const auto views, pictures(frame));
        for (std::size_t k = 0; k < views.size(); ++k) {
            candidates_.push_back({frame, k});
            glimpses_.push_back(glimpseOf(views[k]));
        }
        progress();
    }
    chosen_ = chooseKeys(glimpses_, settings_.keyViews);
    // In the order of time: what follows does not depend on what adds most.
    std::sort(chosen_.begin(), chosen_.end());
    for (const int number : chosen_) {
        const Moment& m = candidates_[number];
        STX_TRY(auto views, pictures(m.frame));
        keyCameras_.push_back(views[m.view].camera);
        keys_.push_back(std::move(views[m.view]));
    }
    return {};
}

Result<void> MovingCameras::registerKeys() {
    Bundle probe;
    probe.views = keys_;
    for (std::size_t i = 0; i < chosen_.size() && i < kProbes; ++i) {
        const auto next = static_cast<std::size_t>(chosen_[i]) + views_.size();
        if (next >= candidates_.size()) continue;
        STX_TRY(auto views, pictures(candidates_[next].frame));
        probe.views.push_back(std::move(views[candidates_[next].view]));
    }
    for (std::size_t i = 0; i < probe.views.size(); ++i) probe.views[i].name = fmt::format("{}", i);
    std::vector<float> distances;
    const Glimpse& first = glimpses_[chosen_[0]];
    for (const float d : first.depth.pixels())
        if (hasPoint(d)) distances.push_back(d);
    middle_ = medianOf(std::move(distances), 1.0f);
    STX_TRY(const PoseRefinement refined, refinePoses(probe, {}, job_));
    const double pixels = (refined.maxTurn + refined.maxShift / middle_) * first.camera.fx;
    registers_ = pixels > kInexact && pixels < kAstray * first.camera.width &&
                 refined.after.relative <= refined.before.relative;
    if (!registers_) return {};
    for (std::size_t i = 0; i < keys_.size(); ++i) keys_[i].camera = probe.views[i].camera;
    poses_.resize(times_.size() * views_.size());
    job_.note(
        fmt::format("poses of moving cameras disagree by {:.1f} pixels; they are registered "
                    "over what stands still",
                    pixels));
    return {};
}

Result<Camera> MovingCameras::poseOf(const ReferenceView& view, const Moment& moment) {
    if (!registers_) return view.camera;
    Camera& known = poses_[moment.frame * views_.size() + moment.view];
    if (known.width > 0) return known;
    // The key view that it shares most with, as the poses given say.
    const Glimpse glimpse = glimpseOf(view);
    std::size_t best = 0;
    std::int64_t most = -1;
    for (std::size_t k = 0; k < keys_.size(); ++k) {
        const std::int64_t shared = sharedPoints(glimpse, glimpses_[chosen_[k]]);
        if (shared <= most) continue;
        most = shared;
        best = k;
    }
    Bundle pair;
    pair.views = {keys_[best], view};
    pair.views[0].name = "key";
    pair.views[1].name = "frame";
    pair.views[1].camera = carried(view.camera, keyCameras_[best], keys_[best].camera);
    known = pair.views[1].camera;
    STX_TRY(const PoseRefinement refined, refinePoses(pair, {}, job_));
    const double pixels = (refined.maxTurn + refined.maxShift / middle_) * view.camera.fx;
    if (pixels < kAstray * view.camera.width)
        known = carried(pair.views[1].camera, pair.views[0].camera, keys_[best].camera);
    return known;
}

Result<void> MovingCameras::see(std::vector<KeyBackground>& keys, std::size_t first,
                                DepthNoise& noise) {
    std::vector<FrameGauge> lights(keys.size());
    std::uint32_t number = 0;
    for (std::size_t frame = 0; frame < times_.size(); ++frame) {
        STX_TRY(const auto views, pictures(frame));
        for (std::size_t k = 0; k < views.size(); ++k, ++number) {
            STX_TRY(const Camera camera, poseOf(views[k], {frame, k}));
            for (std::size_t i = 0; i < keys.size(); ++i)
                lights[i] = keys[i].measure(views[k], camera, noise);
            noise.update();
            const WarpFrame warped = warpFrame(views[k], camera, noise);
            parallelFor(0, keys.size(), [&](std::size_t i) {
                keys[i].see(warped, lights[i], noise, number,
                            static_cast<float>(times_[frame] - times_[0]));
            });
            if (first > 0) continue;
            points_ += views[k].pointCount();
            places_ += static_cast<std::int64_t>(views[k].depth.count());
        }
        progress();
    }
    return {};
}

Result<void> MovingCameras::carve(std::vector<KeyBackground>& keys, const DepthNoise& noise) {
    const bool emptyIsFar = !fillsFrame(points_, static_cast<double>(places_));
    for (std::size_t frame = 0; frame < times_.size(); ++frame) {
        STX_TRY(const auto views, pictures(frame));
        for (std::size_t k = 0; k < views.size(); ++k) {
            STX_TRY(const Camera camera, poseOf(views[k], {frame, k}));
            const WarpFrame carving = carveFrame(views[k], camera, emptyIsFar);
            for (KeyBackground& key : keys) key.carve(carving, noise);
        }
        progress();
    }
    return {};
}

Result<std::vector<BackgroundModel>> MovingCameras::run() {
    STX_CHECK(choose());
    std::vector<BackgroundModel> models;
    if (keys_.empty()) return models;
    STX_CHECK(registerKeys());
    // Key views that fit into memory together.
    Limits limits = job_.limits;
    if (settings_.maxMemoryBytes)
        limits.maxMemoryBytes = std::min(limits.maxMemoryBytes, settings_.maxMemoryBytes);
    std::uint64_t largest = 1;
    for (const ReferenceView& key : keys_)
        largest = std::max<std::uint64_t>(
            largest,
            key.depth.count() * (key.texture.isLinear() ? KeyBackground::kBytesPerLinearPixel
                                                        : KeyBackground::kBytesPerPixel));
    STX_CHECK(limits.checkAllocation(1, largest, "a key view of the background"));
    const std::size_t together =
        std::min<std::size_t>(keys_.size(), limits.maxMemoryBytes / largest);
    const auto rounds = static_cast<std::int64_t>((keys_.size() + together - 1) / together);
    total_ += 2 * (rounds - 1) * static_cast<std::int64_t>(times_.size());
    for (std::size_t first = 0; first < keys_.size(); first += together) {
        std::vector<KeyBackground> keys;
        for (std::size_t i = first; i < std::min(first + together, keys_.size()); ++i)
            keys.emplace_back(keys_[i], settings_.support);
        DepthNoise noise;
        STX_CHECK(see(keys, first, noise));
        STX_CHECK(carve(keys, noise));
        for (KeyBackground& key : keys)
            models.push_back(
                key.finish(static_cast<int>(times_.size() * views_.size()), times_[0], noise));
    }
    return models;
}

}  // namespace

Result<std::vector<BackgroundModel>> rememberMovingCameras(
    std::span<const double> times, const FrameReader& read, std::span<const std::size_t> views,
    const TemporalBackgroundSettings& settings, Job& job) {
    return MovingCameras(times, read, views, settings, job).run();
}

}  // namespace stx::temporal
