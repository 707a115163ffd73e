#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "lib/base/job.hpp"
#include "lib/base/result.hpp"
#include "lib/model/bundle.hpp"

/// Captured depth and colours repaired, before anything is drawn from them.

namespace stx {

/// The steps, in the order in which they are done; of views that are there already, poses and
/// exposure come before all others.
enum class RefineStep {
    steps,
    shift,
    reproject,
    mixed,
    raise,
    gaps,
    align,
    poses,
    exposure,
    noise,
    edges,
    silhouettes,
    agree,
    colours,
    strays
};
inline constexpr std::size_t kRefineSteps = 15;

/// When a step can be done.
enum class RefineWhen {
    import,  ///< it needs what only an import knows: depth as it was stored, the depth's camera
    refine,  ///< whenever there are views
    both,    ///< at an import, as the set needs it; of views that are there already, when asked for
};

/// What a step does unless it is asked for or left out.
enum class RefineAuto {
    found,   ///< it measures whether there is something to do: exact views stay, to the bit
    known,   ///< it is done of sets that are known to need it
    splats,  ///< of what is drawn as splats
};

struct RefineStepInfo {
    RefineStep step;
    std::string_view name;  ///< as in --refine
    RefineWhen when;
    RefineAuto automatic;
    std::string_view usual;     ///< the same in words: "where it is found", "8-bit depth"
    std::string_view sentence;  ///< what it does
    std::string_view source;    ///< of the method; empty: our own
};
/// All steps, in order.
[[nodiscard]] const std::array<RefineStepInfo, kRefineSteps>& refineSteps();
[[nodiscard]] const RefineStepInfo& infoOf(RefineStep step);
/// Whether a step changed something in the set of a view.
[[nodiscard]] bool wasDone(RefineStep step, const Refined& had);

enum class RefineSwitch : std::uint8_t { automatic, on, off };

/// Which steps are done: unless said otherwise each as its RefineAuto says.
class RefineSettings {
  public:
    /// The same for what is drawn as splats.
    [[nodiscard]] RefineSettings forSplats() const {
        RefineSettings settings = *this;
        settings.splats_ = true;
        return settings;
    }
    [[nodiscard]] RefineSwitch of(RefineStep step) const {
        return switches_[static_cast<std::size_t>(step)];
    }
    void set(RefineStep step, RefineSwitch to) { switches_[static_cast<std::size_t>(step)] = to; }
    void set(RefineStep step, bool on) { set(step, on ? RefineSwitch::on : RefineSwitch::off); }

    /// Whether a step is done of views that are there; never of RefineWhen::import.
    [[nodiscard]] bool on(RefineStep step) const;
    /// Some step is.
    [[nodiscard]] bool any() const;
    /// Whether a step is done at an import; `known`: its set is known to need it.
    [[nodiscard]] bool atImport(RefineStep step, bool known) const {
        return of(step) == RefineSwitch::on || (of(step) == RefineSwitch::automatic && known);
    }
    /// Only the steps that were asked for.
    [[nodiscard]] RefineSettings asked() const;
    /// What is left to do of views that these settings were imported with.
    [[nodiscard]] RefineSettings afterImport() const;
    /// What is left to do for views that were refined before: the steps that measure by themselves
    /// are done together, once; any other once, too.
    [[nodiscard]] RefineSettings after(const Refined& had) const;

    [[nodiscard]] static RefineSettings none();
    /// All steps that measure by themselves, and `strays`.
    [[nodiscard]] static RefineSettings all();
    /// Of "auto", "off" (none) or names of steps with commas between them: only these; after
    /// "auto,": these, too, and none that has a minus before it. `reproject` is left out by its
    /// minus alone: depth would lie on wrong pixels without it. Errors (usage): a name that is
    /// none, with the list of those that are.
    [[nodiscard]] static Result<RefineSettings> from(std::string_view text);

  private:
    std::array<RefineSwitch, kRefineSteps> switches_{};
    bool splats_ = false;
};

/// What a step found and did.
struct RefineStepReport {
    int views = 0;            ///< that it changed
    std::int64_t pixels = 0;  ///< of those; of a step that is done twice, of both times
    std::int64_t moved = 0;   ///< pixels that had a depth before and after, or a colour
    double meanMove = 0;      ///< of those, share of the distance; of colours: of white
    /// Of all processors together, measuring included; at an import of each view's own thread.
    double milliseconds = 0;

    void add(const RefineStepReport& other);
};
struct RefineReport {
    /// By RefineStep.
    std::array<RefineStepReport, kRefineSteps> steps;
    double noise = 0;      ///< largest of all views, share of the distance (one standard deviation)
    double ownColour = 1;  ///< see colourAtEdges()

    [[nodiscard]] RefineStepReport& of(RefineStep step) {
        return steps[static_cast<std::size_t>(step)];
    }
    [[nodiscard]] const RefineStepReport& of(RefineStep step) const {
        return steps[static_cast<std::size_t>(step)];
    }
    [[nodiscard]] bool changed() const;
    /// Of more views, or of another moment.
    void add(const RefineReport& other);
    /// The steps that changed something, as Refined::steps has them: "noise,agree".
    [[nodiscard]] std::string names() const;
    /// Adds them to what a view had before.
    void record(Refined& view) const;
    /// For people who did not ask for it: which steps, and how to leave them out.
    [[nodiscard]] std::string note() const;
    /// A clause for each: "noise: 9120 pixels of 4 views, moved by 0.31 % on average; agree: ...".
    [[nodiscard]] std::string text() const;
};

/// Refines a bundle of one moment: exact views stay as they are, to the bit, and so does what was
/// refined before (ViewHeader::refined). Steps of RefineWhen::import are passed over. The same on
/// any number of threads. Errors: a bundle that fails check(), cancelled.
[[nodiscard]] Result<RefineReport> refine(Bundle& bundle, const RefineSettings& settings, Job& job);
/// The same of a bundle whose images are in a spool, where new ones go, too, as does what is known
/// of all views meanwhile: memory is taken for as many views as are worked on at a time, one for
/// each thread where the limit has room for them. The spool must outlive the bundle.
[[nodiscard]] Result<RefineReport> refine(Bundle& bundle, const RefineSettings& settings,
                                          PixelSpool& spool, Job& job);

}  // namespace stx
