#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/stx/stx.hpp"
#include "lib/model/view_table.hpp"
#include "lib/selection/selection.hpp"

namespace stx {

/// `auto:N`, or `auto:DBdB` with a quality in decibels.
struct AutoViews {
    int count = 0;  ///< 1..4096; 0 = the fewest that reach `decibels`
    double decibels = 0;
};

/// Nothing for other views than `auto`. Errors (usage): a number out of range.
[[nodiscard]] Result<std::optional<AutoViews>> parseAutoViews(std::string_view views);

/// The cameras that see a mesh, and how they were chosen.
struct MeshViews {
    std::vector<Camera> cameras;
    AutoViews wanted;
    /// The rest is of `auto` views only.
    std::optional<Selection> selection;
    int candidates = 0;  ///< directions that they were chosen from
    double psnr = 0;     ///< that the cameras reach, dB, of auto:DBdB
};

/// Chooses views by ConvertSettings, see there. A note says when auto:DBdB is not reached. Errors
/// (usage): settings out of range.
[[nodiscard]] Result<MeshViews> chooseViews(const Mesh& mesh, const ConvertSettings& settings,
                                            Job& job);

/// What the cameras see of a mesh that has passed check(), as convert() gives it. Errors: settings
/// (usage), those of captureBundle().
[[nodiscard]] Result<Bundle> captureViews(const Mesh& mesh, const std::vector<Camera>& cameras,
                                          const ConvertSettings& settings, Job& job);

/// The same as a table, see withCapturedViews().
[[nodiscard]] Result<void> withViewsOf(
    const Mesh& mesh, const std::vector<Camera>& cameras, const ConvertSettings& settings, Job& job,
    const std::function<Result<void>(std::unique_ptr<ViewTable> table, Job& job)>& use);

/// Gives all views these depth bits and the range that suits them; false when all had them.
bool setDepthBits(Bundle& bundle, int bits);
/// The same of one view.
bool setDepthBits(ReferenceView& view, int bits);

/// What the depth codes of views cost, for a note: of 8 bits always, of 16 where that shows
/// (ViewHeader::kFineStep). Safe for threads.
class CodedDepth {
  public:
    void add(const ViewHeader& view);
    void note(Job& job) const;

  private:
    std::mutex mutex_;
    double step8_ = 0, step16_ = 0;  ///< the largest, scene units
    double pixels_ = 0;              ///< the largest of 16 bits, see depthStepInPixels()
};

}  // namespace stx
