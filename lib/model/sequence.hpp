#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// Half a tick of a clock, in seconds, and what doubles lose at such a time: as far can two texts
/// or files of one moment be apart that were rounded to such ticks. Ticks longer than a millisecond
/// count as one: that is the coarsest clock to which the times of films are rounded (Matroska's);
/// on coarser ones they are exact.
[[nodiscard]] double halfTick(double tick, double time);

/// When the pictures of a sequence are shown, by its own clock: seconds, which need not begin at 0
/// (recordings often have Unix time). All times that a person or a file names are of this clock.
struct Timeline {
    /// Seconds, ascending, each once. At least one. Frame i is shown from times[i] until
    /// times[i + 1].
    std::vector<double> times{0.0};
    /// When the last frame ends, by the same clock; at least the last time. Of what stands still:
    /// its time.
    double end = 0;
    /// Seconds of the ticks that the times may be rounded to; see findTick().
    double tick = 1e-6;

    [[nodiscard]] double start() const { return times.front(); }
    [[nodiscard]] double duration() const { return std::max(0.0, end - times.front()); }
    /// The slack of a time that is compared with these.
    [[nodiscard]] double slack(double time) const { return halfTick(tick, time); }
    /// Takes as the tick that of timescale(), or a fifth of the shortest frame where that is less:
    /// who asks for the middle of a frame means no other.
    void findTick();

    [[nodiscard]] std::size_t count() const { return times.size(); }
    [[nodiscard]] bool moves() const { return times.size() > 1; }
    /// The frame that is shown at a time: the last that has begun half a tick later, or the first
    /// before that.
    [[nodiscard]] std::size_t frameAt(double time) const;
    /// How long a frame is shown, in seconds.
    [[nodiscard]] double durationOf(std::size_t frame) const;
    /// How messages name a frame, as "frame 2 (0.08 s)".
    [[nodiscard]] std::string nameOf(std::size_t frame) const;
    /// Whether a time is before the first frame or when the last has ended.
    [[nodiscard]] bool outside(double time) const;
    /// Frames a second when all frames last equally long (to a tick); else 0.
    [[nodiscard]] double rate() const;
    /// Ticks a second in which all times, counted from the first, are whole numbers, to a tenth of
    /// a microsecond: the least of the usual ones of MP4 files, a thousand times the rate, or
    /// 1,000,000 where the times are irregular.
    [[nodiscard]] std::uint32_t timescale() const;
    /// Errors (invalidInput) when the promises above do not hold.
    [[nodiscard]] Result<void> check() const;
};

/// Notes how many of the times that are asked for are outside a film, and when it is.
void noteOutside(const std::vector<double>& times, const Timeline& timeline, Job& job);

/// `count` frames, from 1, at a rate above 0.
[[nodiscard]] Timeline steadyTimeline(int count, double rate);

/// A bundle in time, whose frames are made when they are asked for: a film of ten thousand frames
/// takes the memory of one. All frames have the same views: in number, order and name; a view
/// without a picture of a moment has its last one then, and before its first one nothing is known
/// of what it sees (NoDepth::unknown). All count from one Bundle::origin: see fromOrigin(). What
/// stands still is the case of one frame.
class Sequence {
  public:
    virtual ~Sequence() = default;

    [[nodiscard]] const Timeline& timeline() const { return timeline_; }
    /// The bundle as frame `index` (below timeline().count()) has it, with Bundle::time set.
    /// Frames may be asked for in any order; ascending is fastest. One call at a time. It passes
    /// Bundle::check().
    [[nodiscard]] virtual Result<Bundle> frame(std::size_t index, Job& job) = 0;
    /// The same as a table, whose pixels are read when a view is asked for where what is behind
    /// this can do so; else they are there. It serves until another frame is asked for.
    [[nodiscard]] virtual Result<std::unique_ptr<ViewTable>> views(std::size_t index, Job& job) {
        STX_TRY(auto bundle, frame(index, job));
        return tableOf(std::move(bundle));
    }

  protected:
    /// Tells a frame when it is shown, and for how long.
    void setTime(Bundle& bundle, std::size_t index) const;

    Timeline timeline_;
};

/// A bundle that stands still.
[[nodiscard]] std::unique_ptr<Sequence> sequenceOf(Bundle still);

/// The same frames, each changed by `change`, for which all views of a frame are in memory.
[[nodiscard]] std::unique_ptr<Sequence> changed(
    std::unique_ptr<Sequence> frames, std::function<Result<void>(Bundle& frame, Job& job)> change);

/// The same frames, whose views are changed one by one.
[[nodiscard]] std::unique_ptr<Sequence> changedByView(std::unique_ptr<Sequence> frames,
                                                      ViewChange change);

/// The same frames with another environment, which may be null.
[[nodiscard]] std::unique_ptr<Sequence> inEnvironment(
    std::unique_ptr<Sequence> frames, std::shared_ptr<const Environment> environment);

/// The same frames; `look` is called, from any thread, with each view that is asked for, each time.
[[nodiscard]] std::unique_ptr<Sequence> watched(
    std::unique_ptr<Sequence> frames,
    std::function<void(std::size_t frame, std::size_t index, const ReferenceView& view)> look);

/// Some of the frames, in ascending order of their numbers, at their times.
/// Errors (usage): no frame, or numbers that are not in the sequence or do not ascend.
[[nodiscard]] Result<std::unique_ptr<Sequence>> someFrames(std::unique_ptr<Sequence> frames,
                                                           std::vector<std::size_t> numbers);

/// Whether an error is that of a picture, or of another part of a film, which is damaged or
/// missing.
[[nodiscard]] bool isDamage(const Error& error);

/// The same frames, of files that may be damaged: one that cannot be read (isDamage()) is the one
/// before it, or where none before it can be read the first that can. A note says so once. Errors:
/// no frame can be read.
[[nodiscard]] std::unique_ptr<Sequence> acrossDamage(std::unique_ptr<Sequence> frames);

/// Errors (invalidInput), which name the view and the time, when a frame does not have the views of
/// the first: their number and names. Sizes may change.
[[nodiscard]] Result<void> checkSameViews(const Bundle& first, const Bundle& frame);

}  // namespace stx
