#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "formats/mpeg4/scene/document.hpp"
#include "formats/mpeg4/scene/interpolators.hpp"
#include "lib/model/sequence.hpp"

namespace stx::mpeg4 {

/// A presentation has no more moments than that: a day at 25 a second is 2,160,000. Short edit
/// lists and clocks could ask for any number.
inline constexpr std::size_t kMostMoments = 4'000'000;
/// Nor later ones, in seconds: 31,000 years.
inline constexpr double kLatestMoment = 1e12;

/// The nearest tick of a clock; 0 for times before its start, the last that there is for times that
/// it cannot count.
[[nodiscard]] std::uint64_t ticksAt(double seconds, std::uint32_t timescale);

/// The last tick that has begun at a time, or begins no later than `slack` seconds after it.
[[nodiscard]] std::uint64_t ticksBegun(double seconds, std::uint32_t timescale, double slack);

/// Errors (unsupported): frames of a film that would be shown at one tick of its clock.
[[nodiscard]] Result<void> checkTicks(const Timeline& film, std::uint32_t timescale);

/// When the samples of a stream are shown, counted from the stream's start: decoding time plus
/// composition offset, through the edit list (ISO/IEC 14496-12, 8.6).
struct Presentation {
    struct Shown {
        double time = 0;  ///< seconds, ascending
        std::size_t sample = 0;
    };
    std::vector<Shown> shown;
    double duration = 0;  ///< seconds: of one cycle at speed 1
    double tick = 0;      ///< seconds: of the coarser of its clock and its edit list's

    /// The sample that is shown at a time of the stream, or no later than `slack` seconds after it;
    /// the first one before that. There must be one.
    [[nodiscard]] std::size_t sampleAt(double time, double slack) const;
};
/// The edit list counts from the first sample, and begins when that is decoded.
/// Samples that the edit list leaves out are never shown; an edit list that leaves out all, or that
/// shows more than kMostMoments pictures, is passed over. A last edit of duration 0 shows all that
/// is left (8.6.6).
[[nodiscard]] Presentation presentationOf(const ElementaryStream& stream);

/// The time of its stream that a texture shows at `now` seconds of the scene. A MovieTexture runs
/// by startTime, stopTime, speed and loop, shows its first picture before it begins (its last when
/// it runs backwards), and holds the last one when it has ended (ISO/IEC 14772-1, 6.28), also
/// while an event prepares its next run. Other textures run with the scene.
/// A cycle that ends within `slack` seconds has ended.
[[nodiscard]] double mediaTimeOf(const Node& texture, double duration, double now, double slack);

/// Whether what a texture shows at `now` was played from its stream's end. Its time at a moment is
/// where the picture ends that is shown then, so that what is shown from then on is the one before.
[[nodiscard]] bool runsBackwards(const Node& texture, double now);

/// When a texture of a stream of `duration` seconds is active; nothing where its picture stays.
[[nodiscard]] std::optional<ClockRun> runOfMovie(const Node& texture, double duration);

/// Adds the moments of the scene, from `from` and before `until`, at which a texture of a stream
/// changes; seconds, ascending. One that stops just when a picture begins changes then, at `until`,
/// too. False when there are more than kMostMoments.
[[nodiscard]] bool addChanges(const Node& texture, const Presentation& stream, double from,
                              double until, std::vector<double>& times);

}  // namespace stx::mpeg4
