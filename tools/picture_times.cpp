#include "tools/picture_times.hpp"

#include <cmath>

#include "tools/environment_options.hpp"
#include "tools/program.hpp"

namespace stx::tools {
namespace {

constexpr double kMostPictures = 1e6;
constexpr double kSameTime = 1e-9;  ///< seconds: sums of steps

Result<std::vector<double>> parseTimes(const std::string& text) {
    std::vector<double> numbers;
    std::size_t from = 0;
    while (from <= text.size()) {
        const auto colon = std::min(text.find(':', from), text.size());
        const auto number = parseNumbers(text.substr(from, colon - from), 1, "--times");
        if (!number || numbers.size() == 3) break;
        numbers.push_back((*number)[0]);
        from = colon + 1;
    }
    const bool fine = from > text.size() && numbers.size() >= 2 && numbers[0] >= 0 &&
                      numbers[1] >= numbers[0] && (numbers.size() < 3 || numbers[2] > 0);
    if (fine) return numbers;
    return fail(ErrorCode::usage,
                "--times is '{}'; all, or A:B or A:B:STEP in seconds with 0 <= A <= B and STEP "
                "above 0 is expected",
                text);
}

}  // namespace

Result<void> checkTime(const std::optional<double>& time) {
    if (!time || (*time >= 0 && std::isfinite(*time))) return {};
    return fail(ErrorCode::usage, "--time is {}; 0 s or more is expected", *time);
}

Result<std::size_t> momentOf(const std::optional<double>& time, const Timeline& timeline,
                             const char* whatIs, const std::string& input) {
    STX_CHECK(checkTime(time));
    if (whatIs && !time && timeline.moves())
        return fail(ErrorCode::usage,
                    "'{}' has {} frames, and {} of one moment; give --time T, in seconds", input,
                    timeline.count(), whatIs);
    return timeline.frameAt(time.value_or(0));
}

Result<std::vector<double>> timesOf(const TimeOptions& o, const Timeline& timeline) {
    if (o.time) {
        STX_CHECK(checkTime(o.time));
        return std::vector<double>{*o.time};
    }
    if (o.times.empty() || o.times == "all" || o.times == "cameras") return timeline.times;
    STX_TRY(const auto numbers, parseTimes(o.times));
    std::vector<double> times;
    if (numbers.size() == 2) {
        for (const double time : timeline.times)
            if (time >= numbers[0] - kSameTime && time <= numbers[1] + kSameTime)
                times.push_back(time);
        if (times.empty())
            return fail(ErrorCode::usage,
                        "--times is '{}', but no frame begins between; they begin between {:g} and "
                        "{:g} s (A:B:STEP takes what is shown then)",
                        o.times, timeline.times.front(), timeline.times.back());
        return times;
    }
    if ((numbers[1] - numbers[0]) / numbers[2] > kMostPictures)
        return fail(ErrorCode::usage, "--times is '{}', which are more than {:g} pictures", o.times,
                    kMostPictures);
    const auto steps =
        static_cast<std::int64_t>(std::floor((numbers[1] - numbers[0]) / numbers[2] + kSameTime));
    for (std::int64_t i = 0; i <= steps; ++i)
        times.push_back(numbers[0] + static_cast<double>(i) * numbers[2]);
    return times;
}

MovingPictures::MovingPictures(std::unique_ptr<Sequence> frames, RenderSettings settings,
                               Backend backend, int device, Job& job)
    : frames_(std::move(frames)),
      settings_(std::move(settings)),
      backend_(backend),
      device_(device),
      job_(job) {
    ahead_.limits = job.limits;
}

MovingPictures::~MovingPictures() {
    ahead_.cancelled = true;
    if (coming_.valid()) coming_.wait();
}

Result<Bundle> MovingPictures::bundleOf(std::size_t frame) {
    if (coming_.valid()) {
        auto bundle = coming_.get();
        if (comingFrame_ == frame) return bundle;
    }
    // Notes are those of the first frame: others say the same again.
    return frames_->frame(frame, frame_ ? ahead_ : job_);
}

Result<Renderer*> MovingPictures::at(double time, std::optional<double> next) {
    const std::size_t frame = timeline().frameAt(time);
    if (frame_ != frame) {
        STX_TRY(auto bundle, bundleOf(frame));
        frame_ = frame;
        views_.clear();
        for (const ReferenceView& view : bundle.views) views_.push_back(view.camera);
        points_ = bundle.pointCount();
        bounds_ = bundle.bounds ? *bundle.bounds : bundle.computeBounds();
        origin_ = bundle.origin;
        renderer_.reset();
        RenderSettings settings = settings_;
        // Frames share an environment, which takes a while to prepare.
        if (!settings.environment && bundle.environment && (settings.ownEnvironment || light_)) {
            if (own_ != bundle.environment) {
                STX_TRY(ownMap_, EnvironmentMap::make(*bundle.environment, job_.limits));
                own_ = bundle.environment;
                ownLight_ = nullptr;
            }
            if (settings.ownEnvironment) settings.environment = ownMap_;
        }
        if (light_ && !ownLight_) {
            const auto& map = settings.environment ? settings.environment : ownMap_;
            STX_TRY(ownLight_, environmentLight(map, settings.lighting, job_.limits));
        }
        if (light_) settings.lighting.environment = ownLight_;
        environment_ = settings.environment != nullptr;
        STX_TRY(renderer_, rendererOf(std::move(bundle), settings, job_, backend_, device_));
    }
    if (next) {
        const std::size_t later = timeline().frameAt(*next);
        if (later != frame && !coming_.valid()) {
            comingFrame_ = later;
            coming_ = std::async(std::launch::async,
                                 [this, later] { return frames_->frame(later, ahead_); });
        }
    }
    return renderer_.get();
}

}  // namespace stx::tools
