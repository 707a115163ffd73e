#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "lib/base/job.hpp"
#include "lib/base/result.hpp"
#include "lib/model/bundle.hpp"

/// Captured depth repaired, before anything is drawn from it.

namespace stx {

/// The steps, in the order in which they are done. Each finds out by itself whether there is
/// something to do: exact depth stays as it is, to the bit.
enum class RefineStep { pinholes, noise, edges, silhouettes, agree, colours, strays };

struct RefineStepInfo {
    RefineStep step;
    std::string_view name;      ///< as in --refine
    std::string_view sentence;  ///< what it does
    std::string_view source;    ///< of the method; empty: our own
};
inline constexpr std::size_t kRefineSteps = 7;
/// All steps, in order.
[[nodiscard]] const std::array<RefineStepInfo, kRefineSteps>& refineSteps();

/// Which steps are done: unless said otherwise all but `strays`, which forSplats() has, too.
class RefineSettings {
  public:
    /// The same for what is drawn as splats; of settings that were asked for nothing changes.
    [[nodiscard]] RefineSettings forSplats() const {
        RefineSettings settings = *this;
        settings.splats_ = true;
        return settings;
    }
    [[nodiscard]] bool on(RefineStep step) const {
        return !off_[static_cast<std::size_t>(step)] &&
               (step != RefineStep::strays || splats_ || !automatic_);
    }
    [[nodiscard]] bool any() const { return !off_.all(); }
    void set(RefineStep step, bool on) { off_[static_cast<std::size_t>(step)] = !on; }
    /// What is left to do for views that were refined before: nothing but `strays`.
    [[nodiscard]] RefineSettings after(const Refined& had) const;
    [[nodiscard]] static RefineSettings none();
    [[nodiscard]] static RefineSettings all();
    /// Of "auto", "off" (none) or names of steps with commas between them. Errors (usage): a
    /// name that is none, with the list of those that are.
    [[nodiscard]] static Result<RefineSettings> from(std::string_view text);
    /// The steps that are done unless said otherwise, but for some. Errors (usage) as from().
    [[nodiscard]] static Result<RefineSettings> without(std::string_view text);

  private:
    std::bitset<kRefineSteps> off_;
    bool automatic_ = true, splats_ = false;
};

/// What a step found and did.
struct RefineStepReport {
    int views = 0;            ///< that it changed
    std::int64_t pixels = 0;  ///< of those; of a step that is done twice, of both times
    std::int64_t moved = 0;   ///< pixels that had a depth before and after
    double meanMove = 0;      ///< of those, share of the distance
    double milliseconds = 0;  ///< of all processors together, measuring included
};
struct RefineReport {
    /// By RefineStep.
    std::array<RefineStepReport, kRefineSteps> steps;
    double noise = 0;      ///< largest of all views, share of the distance (one standard deviation)
    double ownColour = 1;  ///< see colourAtEdges()

    [[nodiscard]] const RefineStepReport& of(RefineStep step) const {
        return steps[static_cast<std::size_t>(step)];
    }
    [[nodiscard]] bool changed() const;
    /// Of more views, or of another moment.
    void add(const RefineReport& other);
    /// The steps that changed something, as Refined::steps has them: "noise,agree".
    [[nodiscard]] std::string names() const;
    /// For people who did not ask for it: which steps, and how to leave them out.
    [[nodiscard]] std::string note() const;
    /// A clause for each: "noise: 9120 pixels of 4 views, moved by 0.31 % on average; agree: ...".
    [[nodiscard]] std::string text() const;
};

/// Refines the depth of a bundle of one moment: exact depth stays as it is, to the bit, and so does
/// what was refined before (ViewHeader::refined). The same on any number of threads. Errors: a
/// bundle that fails check(), cancelled.
[[nodiscard]] Result<RefineReport> refine(Bundle& bundle, const RefineSettings& settings, Job& job);

}  // namespace stx
