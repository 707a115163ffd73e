#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lib/base/image.hpp"
#include "lib/base/result.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/texture.hpp"

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
    RefineSettings() { set(RefineStep::strays, false); }
    /// The same for what is drawn as splats; of settings that were asked for nothing changes.
    [[nodiscard]] RefineSettings forSplats() const { return automatic_ ? all() : *this; }
    [[nodiscard]] bool on(RefineStep step) const { return !off_[static_cast<std::size_t>(step)]; }
    [[nodiscard]] bool any() const { return !off_.all(); }
    void set(RefineStep step, bool on) { off_[static_cast<std::size_t>(step)] = !on; }
    [[nodiscard]] static RefineSettings none();
    [[nodiscard]] static RefineSettings all();
    /// Of "auto", "off" (none) or names of steps with commas between them. Errors (usage): a
    /// name that is none, with the list of those that are.
    [[nodiscard]] static Result<RefineSettings> from(std::string_view text);

  private:
    std::bitset<kRefineSteps> off_;
    bool automatic_ = true;
};

/// What a step found and did.
struct RefineStepReport {
    int views = 0;            ///< that it changed
    std::int64_t pixels = 0;  ///< of those; of a step that is done twice, of both times
    std::int64_t moved = 0;   ///< pixels that had a depth before and after
    double meanMove = 0;      ///< of those, share of the distance
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
    /// The steps that changed something: "noise, agree".
    [[nodiscard]] std::string names() const;
    /// A clause for each: "noise: 9120 pixels of 4 views, moved by 0.31 % on average; agree: ...".
    [[nodiscard]] std::string text() const;
};

/// A view whose depth is refined. All images have the camera's size.
struct RefineView {
    const Camera* camera = nullptr;
    const Texture* texture = nullptr;
    const Image<float>* depth = nullptr;  ///< scene units, kNoDepth = no point
    bool depthMayBeUnknown = false;       ///< see ReferenceView::depthMayBeUnknown()
    float step = 0;                       ///< scene units between depth codes, 0 of floats
};

struct RefinedView {
    /// None: as it was. Pixels that no step changed have the very same value; those without depth
    /// that have full alpha are unknown in a view with doubt.
    std::optional<Image<float>> depth;
    /// How far off points may be: share of the distance (orthographic views: of the depth range of
    /// their DepthAxis), one standard deviation; 0 of depth that was exact.
    float doubt = 0;
};

/// Refines the depth of views of one moment. The same on any number of threads.
[[nodiscard]] std::vector<RefinedView> refineDepth(std::span<const RefineView> views,
                                                   const RefineSettings& settings,
                                                   RefineReport& report);

/// Tells of views that are looked at one by one whether refineDepth() would change one of them:
/// views in the rectangles of an atlas cost memory to be side by side.
class RefineNeeds {
  public:
    explicit RefineNeeds(const RefineSettings& settings) : settings_(settings) {}
    void add(const RefineView& view);
    [[nodiscard]] bool any() const;

  private:
    RefineSettings settings_;
    bool some_ = false;
    std::vector<float> edgeShares_;
};

}  // namespace stx
