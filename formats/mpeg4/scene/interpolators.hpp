#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "formats/mpeg4/scene/scene.hpp"

/// What moves a scene between its commands (ISO/IEC 14772-1, 6.48 and 4.6.8): TimeSensors send how
/// much of their cycle has passed along ROUTEs to interpolators, which send values to fields.
namespace stx::mpeg4 {

/// The end of what runs for ever.
inline constexpr double kEver = std::numeric_limits<double>::infinity();

/// How a time-dependent node runs by its fields (ISO/IEC 14772-1, 4.6.9); seconds of the scene.
struct ClockRun {
    double start = 0;
    double cycle = 0;  ///< above 0
    double end = 0;    ///< when it becomes inactive; kEver where it loops and does not stop

    /// The cycle that is under way at `loopsUntil` is the last; the first one always is run, but
    /// for a stopTime, which counts only after the start.
    ClockRun(double startTime, double cycleSeconds, double stopTime, double loopsUntil);
    /// Not when it ends within `slack`.
    [[nodiscard]] bool activeAt(double now, double slack) const {
        return start <= now + slack && now + slack < end;
    }
};

/// Until when a node begins its cycle anew: kEver, or when a command has ended that.
[[nodiscard]] double loopsUntil(const Node& timeDependent);

/// Nothing of a TimeSensor that does not run: it is not enabled, or its times are not usable.
[[nodiscard]] std::optional<ClockRun> runOfClock(const Node& timeSensor);

/// A clock's part of its cycle in [0, 1] at a time; nothing while it has never run. After its end:
/// where it stopped. `now` is in seconds of the scene, and may be `slack` off. The end of each
/// cycle is 1 (ISO/IEC 14772-1, 6.50).
[[nodiscard]] std::optional<float> fractionOf(const Node& timeSensor, double now, double slack);

/// The TimeSensors whose fraction_changed a route leaves, each once.
[[nodiscard]] std::vector<NodePtr> clocksOf(const Scene& scene);

/// Sets the fields that routes reach as they are at `now`, as Events does.
void applyInterpolators(Scene& scene, double now);

/// What clocks send to that is not followed here, as `TYPE.event TO TYPE.field`: ROUTEs into
/// PROTOs, through nodes that are not computed, and of other events of clocks than the fraction.
[[nodiscard]] std::set<std::string> routesNotFollowed(const Scene& scene);

/// The scene at one moment after another, moved by its clocks as the commands until then have left
/// them. A field keeps the last value that came to it, be it from a command or along a route; a
/// clock sends values while it is active and when it ends (ISO/IEC 14772-1, 4.7 and 6.50).
class MovingScene {
  public:
    /// As SceneInTime has them; the timescale must be known.
    MovingScene(const std::vector<CommandFrame>& frames, std::uint32_t timescale,
                bool timesFromStart, ActiveNode active);
    MovingScene(MovingScene&&) noexcept;
    MovingScene& operator=(MovingScene&&) noexcept;
    ~MovingScene();

    /// The scene at `now` seconds, of which `until` ticks have begun. `slack`: how far times of
    /// that moment may be off, in seconds. Else as SceneInTime::at().
    [[nodiscard]] Result<Scene*> at(double now, std::uint64_t until, double slack);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace stx::mpeg4
