#include "lib/model/sequence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "lib/base/counted.hpp"

namespace stx {
namespace {

class Still : public Sequence {
  public:
    explicit Still(Bundle bundle) : bundle_(std::move(bundle)) {}
    Result<Bundle> frame(std::size_t index, Job&) override {
        if (index > 0)
            return fail(ErrorCode::usage, "frame {} is asked for, but there is one (0)", index);
        return bundle_;
    }

  private:
    Bundle bundle_;
};

class Changed : public Sequence {
  public:
    Changed(std::unique_ptr<Sequence> frames, std::function<Result<void>(Bundle&, Job&)> change)
        : frames_(std::move(frames)), change_(std::move(change)) {
        timeline_ = frames_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(index, job));
        STX_CHECK(change_(bundle, job));
        return bundle;
    }

  private:
    std::unique_ptr<Sequence> frames_;
    std::function<Result<void>(Bundle&, Job&)> change_;
};

class ChangedByView : public Sequence {
  public:
    ChangedByView(std::unique_ptr<Sequence> frames, ViewChange change)
        : frames_(std::move(frames)), change_(std::move(change)) {
        timeline_ = frames_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(index, job));
        STX_CHECK(checkPeak(change_.takes, bundle.views, job.limits));
        for (std::size_t i = 0; i < bundle.views.size(); ++i) {
            STX_CHECK(job.checkCancelled());
            STX_CHECK(within(fmt::format("view {}", i), change_.change(bundle.views[i], job)));
        }
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, frames_->views(index, job));
        return changedViews(std::move(table), change_);
    }

  private:
    std::unique_ptr<Sequence> frames_;
    ViewChange change_;
};

class InEnvironment : public Sequence {
  public:
    InEnvironment(std::unique_ptr<Sequence> frames, std::shared_ptr<const Environment> environment)
        : frames_(std::move(frames)), environment_(std::move(environment)) {
        timeline_ = frames_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(index, job));
        bundle.environment = environment_;
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, frames_->views(index, job));
        table->about().environment = environment_;
        return table;
    }

  private:
    std::unique_ptr<Sequence> frames_;
    std::shared_ptr<const Environment> environment_;
};

class Watched : public Sequence {
  public:
    using Look = std::function<void(std::size_t, std::size_t, const ReferenceView&)>;
    Watched(std::unique_ptr<Sequence> frames, Look look)
        : frames_(std::move(frames)), look_(std::move(look)) {
        timeline_ = frames_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(index, job));
        for (std::size_t i = 0; i < bundle.views.size(); ++i) look_(index, i, bundle.views[i]);
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, frames_->views(index, job));
        return watchedViews(std::move(table),
                            [look = look_, index](std::size_t i, const ReferenceView& view) {
                                look(index, i, view);
                            });
    }

  private:
    std::unique_ptr<Sequence> frames_;
    Look look_;
};

class Chosen : public Sequence {
  public:
    Chosen(std::unique_ptr<Sequence> frames, std::vector<std::size_t> numbers)
        : frames_(std::move(frames)), numbers_(std::move(numbers)) {
        const Timeline& all = frames_->timeline();
        timeline_.times.clear();
        for (const std::size_t number : numbers_) timeline_.times.push_back(all.times[number]);
        timeline_.end = timeline_.times.back() + all.durationOf(numbers_.back());
        timeline_.tick = all.tick;
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, frames_->frame(numbers_[index], job));
        setTime(bundle, index);
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, frames_->views(numbers_[index], job));
        setTime(table->about(), index);
        return table;
    }

  private:
    std::unique_ptr<Sequence> frames_;
    std::vector<std::size_t> numbers_;
};

class AcrossDamage : public Sequence {
  public:
    explicit AcrossDamage(std::unique_ptr<Sequence> frames) : frames_(std::move(frames)) {
        timeline_ = frames_->timeline();
    }
    Result<Bundle> frame(std::size_t index, Job& job) override {
        STX_TRY(auto bundle, nearest<Bundle>(index, job, [this](std::size_t frame, Job& part) {
                    return frames_->frame(frame, part);
                }));
        setTime(bundle, index);
        return bundle;
    }
    Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) override {
        STX_TRY(auto table, nearest<std::unique_ptr<ViewTable>>(
                                index, job, [this](std::size_t frame, Job& part) {
                                    return soundViews(frame, part);
                                }));
        setTime(table->about(), index);
        return table;
    }

  private:
    /// The frame itself, or what is shown in its place.
    template <class T, class Read>
    Result<T> nearest(std::size_t index, Job& job, const Read& read) {
        auto found = attempt<T>(index, job, read);
        if (found || !isDamage(found.error())) return found;
        const Error error = found.error();
        const auto go = [&](std::size_t to) -> Result<void> {
            STX_CHECK(job.checkCancelled());
            found = attempt<T>(to, job, read);
            if (!found && !isDamage(found.error())) return tl::unexpected(found.error());
            return {};
        };
        for (std::size_t i = index; !found && i > 0;) STX_CHECK(go(--i));
        const bool before = found.has_value();
        for (std::size_t i = index + 1; !found && i < timeline_.count(); ++i) STX_CHECK(go(i));
        if (!found) return tl::unexpected(error);
        if (!noted_)
            job.noteAbove(fmt::format(
                "frame {} ({:.6g} s) cannot be used: {} is shown in its place, and no more is said "
                "of others like it; stx convert --strict stops there: {}",
                index, timeline_.times[index], before ? "the one before it" : "the first that can",
                error.text()));
        noted_ = true;
        return found;
    }

    /// A frame, unless it is known to be damaged. Its notes are passed on when it is there.
    template <class T, class Read>
    Result<T> attempt(std::size_t index, Job& job, const Read& read) {
        if (const auto known = damaged_.find(index); known != damaged_.end())
            return tl::unexpected(known->second);
        Job part;
        part.workFor(job);
        Result<T> found = read(index, part);
        if (!found && isDamage(found.error())) damaged_.emplace(index, found.error());
        if (found) part.passNotesOn();
        return found;
    }

    /// Views whose pixels are not damaged: that a view is shows when it is read, and then another
    /// frame is shown, of which all views are. Each is read once for it, the first time.
    Result<std::unique_ptr<ViewTable>> soundViews(std::size_t index, Job& job) {
        STX_TRY(auto table, frames_->views(index, job));
        if (table->knownSound() || sound_.contains(index)) return table;
        if (memoryOfAll(*table, {"reading", 0}) <= heldWhole(job.limits)) {
            STX_TRY(auto bundle, wholeBundle(std::move(table), job));
            return tableOf(std::move(bundle));
        }
        Job quiet;  // notes are those of the views when they are asked for
        quiet.workFor(job);
        STX_CHECK(forEachView(*table, {"reading", 0}, quiet,
                              [](std::size_t, const auto&) { return Result<void>(); }));
        sound_.insert(index);
        return table;
    }

    std::unique_ptr<Sequence> frames_;
    std::map<std::size_t, Error> damaged_;
    std::set<std::size_t> sound_;  ///< frames whose views have been read
    bool noted_ = false;
};

/// Ticks a second that MP4 files usually have, with those of the rates that films have.
constexpr std::uint32_t kTimescales[] = {1000,  24000, 25000, 30000,  15000, 12000,
                                         50000, 60000, 90000, 120000, 600000};
constexpr std::uint32_t kMicroseconds = 1'000'000;
/// Seconds: times are written with six digits behind the point at least, and doubles lose less.
constexpr double kSameTime = 1e-7;

/// What doubles lose where two of such a size are subtracted, in seconds.
double lostAt(double time) {
    return 4 * std::numeric_limits<double>::epsilon() * std::max(1.0, std::abs(time));
}

}  // namespace

double halfTick(double tick, double time) {
    constexpr double kCoarsest = 0.001;
    return std::min(tick, kCoarsest) / 2 + lostAt(time);
}

void Timeline::findTick() {
    // Times of 120 frames a second in milliseconds are off by half of an eighth of a frame.
    constexpr double kMostOfFrame = 0.2;
    tick = 1.0 / timescale();
    for (std::size_t i = 0; i + 1 < times.size(); ++i)
        tick = std::min(tick, kMostOfFrame * durationOf(i));
}

std::size_t Timeline::frameAt(double time) const {
    const auto next = std::upper_bound(times.begin(), times.end(), time + slack(time));
    return next == times.begin() ? 0 : static_cast<std::size_t>(next - times.begin()) - 1;
}

double Timeline::durationOf(std::size_t frame) const {
    return (frame + 1 < times.size() ? times[frame + 1] : std::max(end, times.back())) -
           times[frame];
}

std::string Timeline::nameOf(std::size_t frame) const {
    return fmt::format("frame {} ({:g} s)", frame, times[frame]);
}

bool Timeline::outside(double time) const {
    return time < times.front() - slack(time) || time >= std::max(end, times.back()) + slack(time);
}

double Timeline::rate() const {
    if (!moves()) return 0;
    const double step = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
    for (std::size_t i = 0; i < times.size(); ++i)
        if (std::abs(times[i] - times.front() - step * static_cast<double>(i)) >
            2 * slack(times[i]))
            return 0;
    return 1 / step;
}

std::uint32_t Timeline::timescale() const {
    const double same = std::max(kSameTime, lostAt(times.front()));
    const auto fits = [&](std::uint32_t ticks) {
        const auto whole = [&](double time) {
            const double at = (time - times.front()) * ticks;
            return std::abs(at - std::round(at)) <= same * ticks;
        };
        return std::ranges::all_of(times, whole) && (end <= times.back() || whole(end));
    };
    for (const std::uint32_t ticks : kTimescales)
        if (fits(ticks)) return ticks;
    if (const double ticks = std::round(1000 * rate()); ticks >= 1000 && ticks < kMicroseconds)
        if (fits(static_cast<std::uint32_t>(ticks))) return static_cast<std::uint32_t>(ticks);
    return kMicroseconds;
}

Result<void> Timeline::check() const {
    if (times.empty()) return fail(ErrorCode::invalidInput, "a sequence has no frame");
    double last = -std::numeric_limits<double>::infinity();
    for (const double time : times) {
        if (!std::isfinite(time))
            return fail(ErrorCode::invalidInput, "a frame is at {} s; a finite time is expected",
                        time);
        if (!(time > last))
            return fail(ErrorCode::invalidInput, "frames are at {} s and then at {} s", last, time);
        last = time;
    }
    if (!std::isfinite(end) || (end < last && moves()))
        return fail(ErrorCode::invalidInput, "the sequence ends at {} s, before its last frame, {}",
                    end, last);
    return {};
}

void noteOutside(const std::vector<double>& times, const Timeline& timeline, Job& job) {
    if (!timeline.moves()) return;
    const auto outside = static_cast<std::size_t>(
        std::ranges::count_if(times, [&](double time) { return timeline.outside(time); }));
    if (outside == 0) return;
    job.note(fmt::format(
        "{} outside the film, which is from {:.12g} to {:.12g} s by its own clock: the frame "
        "nearest "
        "in time is shown",
        times.size() == 1
            ? fmt::format("the time {:.12g} s is", times[0])
            : fmt::format("{} of {} times {}", outside, times.size(), outside == 1 ? "is" : "are"),
        timeline.start(), timeline.end));
}

Timeline steadyTimeline(int count, double rate) {
    Timeline line;
    line.times.clear();
    for (int i = 0; i < count; ++i) line.times.push_back(i / rate);
    line.end = count > 1 ? count / rate : 0;
    line.findTick();
    return line;
}

void Sequence::setTime(Bundle& bundle, std::size_t index) const {
    bundle.time = timeline_.times[index];
    bundle.duration.reset();
    if (const double shown = timeline_.durationOf(index); shown > 0) bundle.duration = shown;
}

std::unique_ptr<Sequence> sequenceOf(Bundle still) {
    return std::make_unique<Still>(std::move(still));
}

std::unique_ptr<Sequence> changed(std::unique_ptr<Sequence> frames,
                                  std::function<Result<void>(Bundle&, Job&)> change) {
    return std::make_unique<Changed>(std::move(frames), std::move(change));
}

std::unique_ptr<Sequence> changedByView(std::unique_ptr<Sequence> frames, ViewChange change) {
    return std::make_unique<ChangedByView>(std::move(frames), std::move(change));
}

std::unique_ptr<Sequence> inEnvironment(std::unique_ptr<Sequence> frames,
                                        std::shared_ptr<const Environment> environment) {
    return std::make_unique<InEnvironment>(std::move(frames), std::move(environment));
}

std::unique_ptr<Sequence> watched(
    std::unique_ptr<Sequence> frames,
    std::function<void(std::size_t frame, std::size_t index, const ReferenceView& view)> look) {
    return std::make_unique<Watched>(std::move(frames), std::move(look));
}

Result<std::unique_ptr<Sequence>> someFrames(std::unique_ptr<Sequence> frames,
                                             std::vector<std::size_t> numbers) {
    if (numbers.empty()) return fail(ErrorCode::usage, "no frame is asked for");
    const std::size_t count = frames->timeline().count();
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        if (numbers[i] >= count)
            return fail(ErrorCode::usage, "frame {} is asked for, but there are {} (from 0)",
                        numbers[i], count);
        if (i > 0 && numbers[i] <= numbers[i - 1])
            return fail(ErrorCode::usage, "frame {} is asked for after frame {}", numbers[i],
                        numbers[i - 1]);
    }
    return std::make_unique<Chosen>(std::move(frames), std::move(numbers));
}

bool isDamage(const Error& error) {
    return error.code == ErrorCode::invalidInput || error.code == ErrorCode::io;
}

std::unique_ptr<Sequence> acrossDamage(std::unique_ptr<Sequence> frames) {
    return std::make_unique<AcrossDamage>(std::move(frames));
}

Result<void> checkSameViews(const Bundle& first, const Bundle& frame) {
    const double time = frame.time.value_or(0);
    if (frame.views.size() != first.views.size())
        return fail(ErrorCode::invalidInput, "{} at {:g} s, but {} at the start",
                    counted(frame.views.size(), "view"), time, first.views.size());
    for (std::size_t i = 0; i < first.views.size(); ++i) {
        const ReferenceView& was = first.views[i];
        const ReferenceView& is = frame.views[i];
        if (is.name != was.name)
            return fail(ErrorCode::invalidInput, "view {} is '{}' at {:g} s, but '{}' at the start",
                        i, is.name, time, was.name);
    }
    return {};
}

}  // namespace stx
