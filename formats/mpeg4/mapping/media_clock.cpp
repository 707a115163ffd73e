#include "formats/mpeg4/mapping/media_clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stx::mpeg4 {
namespace {

/// How a MovieTexture runs.
struct Run {
    double start = 0, stop = 0, speed = 1;
    bool loop = false;
};

Run runOf(const Node& texture) {
    Run run;
    if (!texture.is("MovieTexture")) return run;
    run.start = texture.get<double>("startTime");
    run.stop = texture.get<double>("stopTime");
    run.speed = static_cast<double>(texture.get<float>("speed"));
    run.loop = texture.get<bool>("loop");
    if (!std::isfinite(run.start)) run.start = 0;
    if (!std::isfinite(run.stop)) run.stop = 0;
    if (!std::isfinite(run.speed)) run.speed = 1;
    return run;
}

/// Times that went through ticks of two clocks differ by less.
constexpr double kSameTime = 1e-6;

}  // namespace

std::uint64_t ticksAt(double seconds, std::uint32_t timescale) {
    const double ticks = std::floor(seconds * timescale + 0.5);
    if (!(ticks > 0)) return 0;
    constexpr auto kLast = std::numeric_limits<std::uint64_t>::max();
    return ticks < static_cast<double>(kLast) ? static_cast<std::uint64_t>(ticks) : kLast;
}

std::size_t Presentation::sampleAt(double time) const {
    const auto next = std::upper_bound(shown.begin(), shown.end(), time + kSameTime,
                                       [](double t, const Shown& entry) { return t < entry.time; });
    return next == shown.begin() ? next->sample : std::prev(next)->sample;
}

Presentation presentationOf(const ElementaryStream& stream) {
    Presentation all;
    const double tick = 1.0 / std::max<std::uint32_t>(stream.timescale, 1);
    for (std::size_t i = 0; i < stream.samples.size(); ++i) {
        const Sample& sample = stream.samples[i];
        const double time = (static_cast<double>(sample.time) + sample.compositionOffset) * tick;
        all.shown.push_back({time, i});
        all.duration = std::max(all.duration, time + sample.duration * tick);
    }
    std::ranges::stable_sort(all.shown, {}, &Presentation::Shown::time);
    if (stream.edits.edits.empty()) return all;

    Presentation edited;
    const double editTick = 1.0 / std::max<std::uint32_t>(stream.edits.timescale, 1);
    for (const Edit& edit : stream.edits.edits) {
        const double from = edited.duration;
        const double length = static_cast<double>(edit.duration) * editTick;
        edited.duration += length;
        if (edit.mediaTime < 0) continue;
        const double media = static_cast<double>(edit.mediaTime) * tick;
        // The picture under way when the edit begins, and those that begin in it.
        const auto begun =
            std::ranges::upper_bound(all.shown, media + kSameTime, {}, &Presentation::Shown::time);
        auto entry = begun == all.shown.begin() ? begun : std::prev(begun);
        if (begun == all.shown.end() && all.duration <= media + kSameTime) continue;
        for (bool first = true;
             entry != all.shown.end() && entry->time < media + length - kSameTime; ++entry) {
            if (edited.shown.size() == kMostMoments) return all;
            edited.shown.push_back(
                {first ? from : from + std::max(0.0, entry->time - media), entry->sample});
            first = false;
        }
    }
    return edited.shown.empty() ? all : edited;
}

double mediaTimeOf(const Node& texture, double duration, double now) {
    const Run run = runOf(texture);
    const double speed = std::abs(run.speed);
    const bool backwards = run.speed < 0;
    if (speed == 0 || !(duration > 0)) return 0;
    double passed = now - run.start;
    if (run.stop > run.start) passed = std::min(passed, run.stop - run.start);
    if (passed < 0) return backwards ? duration : 0;
    const double cycle = duration / speed;
    if (run.loop) {
        passed = std::fmod(passed, cycle);
        if (cycle - passed < kSameTime) passed = 0;
    } else {
        passed = std::min(passed, cycle);
    }
    return backwards ? duration - passed * speed : passed * speed;
}

std::vector<double> changesOf(const Node& texture, const Presentation& stream, double& end) {
    const Run run = runOf(texture);
    std::vector<double> times;
    const double speed = std::abs(run.speed);
    if (speed == 0 || stream.shown.size() < 2) return times;
    double last = run.start + stream.duration / speed;
    if (run.stop > run.start) last = std::min(last, run.stop);
    for (std::size_t i = 0; i < stream.shown.size(); ++i) {
        const double until =
            i + 1 < stream.shown.size() ? stream.shown[i + 1].time : stream.duration;
        const double at = run.speed < 0 ? (stream.duration - until) : stream.shown[i].time;
        const double time = run.start + at / speed;
        if (time >= 0 && time < last - kSameTime) times.push_back(time);
    }
    std::ranges::sort(times);
    end = std::max(end, last);
    return times;
}

}  // namespace stx::mpeg4
