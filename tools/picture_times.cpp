#include "tools/picture_times.hpp"

#include <cmath>

#include "lib/render/factory.hpp"
#include "tools/camera_options.hpp"
#include "tools/drawn_views.hpp"
#include "tools/environment_options.hpp"
#include "tools/program.hpp"

namespace stx::tools {
namespace {

constexpr double kMostPictures = 1e6;
constexpr double kWholeSteps = 1e-9;  ///< of a step: what a division of two times loses

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
    const bool fine = from > text.size() && numbers.size() >= 2 && numbers[1] >= numbers[0] &&
                      (numbers.size() < 3 || numbers[2] > 0);
    if (fine) return numbers;
    return fail(ErrorCode::usage,
                "--times is '{}'; all, or A:B or A:B:STEP in seconds with A <= B and STEP above "
                "0 is expected",
                text);
}

/// The simplest fraction between two numbers above 0, by their continued fractions.
std::pair<double, double> simplestBetween(double low, double high) {
    const double whole = std::floor(low);
    if (whole == low && whole > 0) return {whole, 1};
    if (whole + 1 <= high) return {whole + 1, 1};
    const auto [top, bottom] = simplestBetween(1 / (high - whole), 1 / (low - whole));
    return {whole * top + bottom, top};
}

/// A rate as a fraction: a whole number, that of a film for television (24000/1001), or the
/// simplest; within the share `exact` of the rate.
std::pair<int, int> rateOf(double rate, double exact) {
    // Of a rate: what 23.976, 29.97 and 59.94 are off, 1e-6, and single precision.
    constexpr double kWritten = 3e-6;
    exact = std::max(exact, kWritten);
    const double whole = std::round(rate), television = std::round(rate * 1.001);
    if (whole >= 1 && std::abs(rate - whole) <= exact * rate) return {static_cast<int>(whole), 1};
    if (television >= 1 && std::abs(rate * 1.001 - television) <= exact * rate)
        return {static_cast<int>(television * 1000), 1001};
    const auto [top, bottom] = simplestBetween(rate * (1 - exact), rate * (1 + exact));
    constexpr double kLargest = 1e9;
    return {static_cast<int>(std::clamp(top, 1.0, kLargest)),
            static_cast<int>(std::clamp(bottom, 1.0, kLargest))};
}

/// How far from it the rate of a steady film can be, as a share: its times are rounded, as those of
/// milliseconds show, or written with some digits.
double exactnessOf(const Timeline& line, double rate) {
    // Seconds: six digits behind the point, or seven.
    double off = 5e-7;
    for (std::size_t i = 0; i < line.count(); ++i)
        off = std::max(
            off, std::abs(line.times[i] - line.times.front() - static_cast<double>(i) / rate));
    return 2 * off / (line.times.back() - line.times.front());
}

}  // namespace

Result<std::size_t> momentOf(const std::optional<double>& time, const Timeline& timeline,
                             const char* whatIs, const std::string& input, Job& job) {
    if (whatIs && !time && timeline.moves())
        return fail(ErrorCode::usage,
                    "'{}' has {} frames, and {} of one moment; give --time T, in seconds", input,
                    timeline.count(), whatIs);
    if (!time) return std::size_t{0};
    if (!timeline.moves())
        job.noteUnused({"--time"}, "of films", fmt::format("'{}' does not move", input));
    noteOutside({*time}, timeline, job);
    return timeline.frameAt(*time);
}

Result<std::vector<double>> timesOf(const TimeOptions& o, const Timeline& timeline) {
    if (o.time) return std::vector<double>{*o.time};
    if (o.times.empty() || o.times == "all" || o.times == "cameras") return timeline.times;
    STX_TRY(const auto numbers, parseTimes(o.times));
    std::vector<double> times;
    if (numbers.size() == 2) {
        for (const double time : timeline.times)
            if (time >= numbers[0] - timeline.slack(time) &&
                time <= numbers[1] + timeline.slack(time))
                times.push_back(time);
        if (times.empty())
            return fail(ErrorCode::usage,
                        "--times is '{}', but no frame begins between; they begin between {:.12g} "
                        "and {:.12g} s (A:B:STEP takes what is shown then)",
                        o.times, timeline.times.front(), timeline.times.back());
        return times;
    }
    if ((numbers[1] - numbers[0]) / numbers[2] > kMostPictures)
        return fail(ErrorCode::usage, "--times is '{}', which are more than {:g} pictures", o.times,
                    kMostPictures);
    const auto steps =
        static_cast<std::int64_t>(std::floor((numbers[1] - numbers[0]) / numbers[2] + kWholeSteps));
    for (std::int64_t i = 0; i <= steps; ++i)
        times.push_back(numbers[0] + static_cast<double>(i) * numbers[2]);
    return times;
}

std::pair<int, int> streamRateOf(const Timeline& line, const char* what, Job& job) {
    if (const double rate = line.rate(); rate > 0) return rateOf(rate, exactnessOf(line, rate));
    const double mean =
        static_cast<double>(line.count() - 1) / (line.times.back() - line.times.front());
    double shortest = mean > 0 ? 1 / mean : 0, longest = shortest;
    for (std::size_t i = 0; i + 1 < line.count(); ++i) {
        shortest = std::min(shortest, line.durationOf(i));
        longest = std::max(longest, line.durationOf(i));
    }
    constexpr double kOfMean = 1e-4;  ///< a mean needs no more digits than people read
    const auto written = rateOf(mean, kOfMean);
    job.note(
        fmt::format("{} last {:.4g} to {:.4g} s, and a stream has one rate: "
                    "the mean, {:.6g} frames a second, is written; --fps gives another",
                    what, shortest, longest, static_cast<double>(written.first) / written.second));
    return written;
}

MovingPictures::MovingPictures(std::unique_ptr<Sequence> frames, RenderSettings settings,
                               Backend backend, int device, std::filesystem::path folder, Job& job)
    : frames_(std::move(frames)),
      settings_(std::move(settings)),
      backend_(backend),
      device_(device),
      folder_(std::move(folder)),
      job_(job) {
    ahead_.workFor(job);
}

MovingPictures::~MovingPictures() {
    ahead_.cancelled = true;
    if (coming_.valid()) coming_.wait();
}

Result<MovingPictures::FrameViews> MovingPictures::read(std::size_t frame, Job& job) {
    FrameViews out;
    if (!fits_) {
        STX_TRY(auto table, frames_->views(frame, job));
        const PeakMemory& drawing = drawingMemory(settings_);
        if (!table->whole() && memoryOfAll(*table, drawing) > job.limits.maxMemoryBytes) {
            STX_TRY(out.bundle,
                    viewsToDraw(*table, drawing, std::vector<bool>(table->count(), true), folder_,
                                out.spool, job));
            return out;
        }
        fits_ = true;
        STX_TRY(out.bundle, wholeBundle(std::move(table), job));
        return out;
    }
    STX_TRY(out.bundle, frames_->frame(frame, job));
    return out;
}

Result<MovingPictures::FrameViews> MovingPictures::viewsOf(std::size_t frame) {
    if (coming_.valid()) {
        auto views = coming_.get();
        if (comingFrame_ == frame) return views;
    }
    // Notes are those of the first frame: others say the same again.
    return read(frame, frame_ ? ahead_ : job_);
}

Result<Renderer*> MovingPictures::at(double time, std::optional<double> next) {
    const std::size_t frame = timeline().frameAt(time);
    if (frame_ != frame) {
        if (!fits_) {  // there is room for one
            renderer_.reset();
            spooled_.reset();
        }
        STX_TRY(auto shown, viewsOf(frame));
        Bundle& bundle = shown.bundle;
        frame_ = frame;
        views_.clear();
        for (const ReferenceView& view : bundle.views) views_.push_back(view.camera);
        moved_ = movedCameras(bundle.views);
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
        if (shown.spool) {
            spooled_.emplace(std::move(shown));
            STX_TRY(renderer_, makeRenderer(backend_, spooled_->bundle, *spooled_->spool, settings,
                                            device_, job_));
        } else {
            STX_TRY(renderer_, rendererOf(std::move(bundle), settings, job_, backend_, device_));
        }
    }
    if (next && fits_) {
        const std::size_t later = timeline().frameAt(*next);
        if (later != frame && !coming_.valid()) {
            comingFrame_ = later;
            coming_ = std::async(std::launch::async, [this, later] { return read(later, ahead_); });
        }
    }
    return renderer_.get();
}

}  // namespace stx::tools
