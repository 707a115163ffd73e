#include "formats/mpeg4/mapping/media_clock.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace stx::mpeg4 {
namespace {

/// How a MovieTexture runs.
struct Run {
    double start = 0, stop = 0, speed = 1;
    double loopsUntil = 0;
};

Run usable(const Node::EndedRun& fields) {
    Run run{fields.start, fields.stop, static_cast<double>(fields.speed), fields.loopsUntil};
    if (!std::isfinite(run.start)) run.start = 0;
    if (!std::isfinite(run.stop)) run.stop = 0;
    if (!std::isfinite(run.speed)) run.speed = 1;
    return run;
}

/// The run that a texture's startTime began or will begin.
Run runOf(const Node& texture) {
    if (!texture.is("MovieTexture")) return {};
    const Node::EndedRun fields{texture.get<double>("startTime"), texture.get<double>("stopTime"),
                                texture.get<float>("speed"), loopsUntil(texture)};
    // One that has ended runs no further by what was changed since, but for its loop.
    const bool over =
        texture.ended && texture.ended->start == fields.start && fields.loopsUntil != kEver;
    return usable(over ? *texture.ended : fields);
}

/// The run whose picture a texture shows: until the next begins, that of the last.
Run shownRun(const Node& texture, double now) {
    const Run run = runOf(texture);
    return texture.ended && now < run.start ? usable(*texture.ended) : run;
}

std::optional<ClockRun> clockOf(const Run& run, double duration) {
    const double cycle = duration / std::abs(run.speed);
    if (run.speed == 0 || !(cycle > 0)) return {};
    return ClockRun(run.start, cycle, run.stop, run.loopsUntil);
}

}  // namespace

std::uint64_t ticksAt(double seconds, std::uint32_t timescale) {
    const double ticks = std::floor(seconds * timescale + 0.5);
    if (!(ticks > 0)) return 0;
    constexpr auto kLast = std::numeric_limits<std::uint64_t>::max();
    return ticks < static_cast<double>(kLast) ? static_cast<std::uint64_t>(ticks) : kLast;
}

Result<void> checkTicks(const Timeline& film, std::uint32_t timescale) {
    const auto& times = film.times;
    const auto ticks = [&](double time) { return ticksAt(time - film.start(), timescale); };
    for (std::size_t i = 1; i < times.size(); ++i)
        if (ticks(times[i]) <= ticks(times[i - 1]))
            return fail(ErrorCode::unsupported,
                        "frames {} and {} are at {:.12g} and {:.12g} s, and the clock of an MPEG-4 "
                        "film has {} ticks a second, so that one would be lost; write .exr",
                        i - 1, i, times[i - 1], times[i], timescale);
    return {};
}

std::uint64_t ticksBegun(double seconds, std::uint32_t timescale, double slack) {
    // Half a tick at most, so that a time that is a tick is not taken for the next.
    const double most = std::min(slack * timescale, 0.499);
    return ticksAt(std::floor(seconds * timescale + most) / timescale, timescale);
}

std::size_t Presentation::sampleAt(double time, double slack) const {
    const auto next = std::upper_bound(shown.begin(), shown.end(), time + slack,
                                       [](double t, const Shown& entry) { return t < entry.time; });
    return next == shown.begin() ? next->sample : std::prev(next)->sample;
}

Presentation presentationOf(const ElementaryStream& stream) {
    Presentation all;
    const double tick = 1.0 / std::max<std::uint32_t>(stream.timescale, 1);
    all.tick = tick;
    for (std::size_t i = 0; i < stream.samples.size(); ++i) {
        const Sample& sample = stream.samples[i];
        const double time = (static_cast<double>(sample.time) + sample.compositionOffset) * tick;
        all.shown.push_back({time, i});
        all.duration = std::max(all.duration, time + sample.duration * tick);
    }
    std::ranges::stable_sort(all.shown, {}, &Presentation::Shown::time);
    if (stream.edits.edits.empty()) return all;

    // A text may delay the track of a file: its edits, too.
    const double delay =
        stream.samples.empty() ? 0 : static_cast<double>(stream.samples[0].time) * tick;
    Presentation edited;
    edited.duration = delay;
    const double editTick = 1.0 / std::max<std::uint32_t>(stream.edits.timescale, 1);
    edited.tick = std::max(tick, editTick);
    for (const Edit& edit : stream.edits.edits) {
        const double from = edited.duration;
        const double media = static_cast<double>(edit.mediaTime) * tick + delay;
        double length = static_cast<double>(edit.duration) * editTick;
        // Of a last edit, 0 is all that is left of the stream.
        if (edit.duration == 0 && edit.mediaTime >= 0 && &edit == &stream.edits.edits.back())
            length = std::max(0.0, all.duration - media);
        edited.duration += length;
        if (edit.mediaTime < 0) continue;
        const double slack = halfTick(edited.tick, media);
        // The picture under way when the edit begins, and those that begin in it.
        const auto begun =
            std::ranges::upper_bound(all.shown, media + slack, {}, &Presentation::Shown::time);
        auto entry = begun == all.shown.begin() ? begun : std::prev(begun);
        if (begun == all.shown.end() && all.duration <= media + slack) continue;
        for (bool first = true; entry != all.shown.end() && entry->time < media + length - slack;
             ++entry) {
            if (edited.shown.size() == kMostMoments) return all;
            edited.shown.push_back(
                {first ? from : from + std::max(0.0, entry->time - media), entry->sample});
            first = false;
            if (edit.rate == 0) break;  // one picture, for all of the edit
        }
    }
    return edited.shown.empty() ? all : edited;
}

double mediaTimeOf(const Node& texture, double duration, double now, double slack) {
    const Run shown = shownRun(texture, now + slack);
    const auto run = clockOf(shown, duration);
    if (!run) return 0;
    const double speed = duration / run->cycle;
    const bool backwards = shown.speed < 0;
    if (now < run->start) return backwards ? duration : 0;
    const double ended = run->end - run->start;
    double passed = std::min(now - run->start, ended);
    // A cycle that ends goes over to the next, but the last stays at its end.
    const double inCycle = std::fmod(passed, run->cycle);
    const bool atEnd = passed > slack && (inCycle <= slack || run->cycle - inCycle <= slack);
    passed = !atEnd ? inCycle : passed < ended - slack ? 0 : run->cycle;
    return backwards ? duration - passed * speed : passed * speed;
}

bool runsBackwards(const Node& texture, double now) {
    return shownRun(texture, now).speed < 0;
}

std::optional<ClockRun> runOfMovie(const Node& texture, double duration) {
    return clockOf(runOf(texture), duration);
}

bool addChanges(const Node& texture, const Presentation& stream, double from, double until,
                std::vector<double>& times) {
    const auto run = runOfMovie(texture, stream.duration);
    if (!run || stream.shown.size() < 2) return true;
    const std::size_t count = stream.shown.size();
    const double speed = std::abs(runOf(texture).speed);
    const bool backwards = runOf(texture).speed < 0;
    // Seconds of a cycle after which its picture `i` comes.
    const auto after = [&](std::size_t i) {
        if (!backwards) return stream.shown[i].time / speed;
        const std::size_t next = count - i;
        return (next < count ? stream.duration - stream.shown[next].time : 0) / speed;
    };
    // A stop shows the picture that begins just then, on from there; no cycle begins there.
    double pictures = until;
    if (std::isfinite(run->end)) {
        const double slack = halfTick(stream.tick, run->end);
        if (run->end <= until) pictures = run->end + slack;
        until = std::min(until, run->end - slack);
    }
    from = std::max(from, 0.0);
    for (double cycle = std::max(0.0, std::floor((from - run->start) / run->cycle));; ++cycle) {
        const double start = run->start + cycle * run->cycle;
        if (!(start < until)) return true;
        // How many pictures come before `from`; times ascend.
        std::size_t i = 0;
        for (std::size_t step = std::bit_ceil(count); step > 0; step /= 2)
            if (i + step <= count && start + after(i + step - 1) < from) i += step;
        // The first picture is shown from where the cycle begins, in the place of another.
        if ((cycle > 0 || texture.ended) && start >= from) times.push_back(start);
        for (; i < count && start + after(i) < pictures && after(i) < run->cycle; ++i) {
            if (times.size() > kMostMoments) return false;
            times.push_back(start + after(i));
        }
        if (times.size() > kMostMoments) return false;
    }
}

}  // namespace stx::mpeg4
