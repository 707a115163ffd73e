#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/imagesets/image_sets.hpp"
#include "formats/imagesets/set_view.hpp"
#include "lib/model/view_table.hpp"
#include "lib/refine/poses.hpp"

/// From the description of a set to its views: all in memory, or as a table of views that are read
/// when they are asked for.
namespace stx::imagesets {

/// Leaves out views whose files or poses are not there, and says so. Errors when none is left, or
/// `strict`.
[[nodiscard]] Result<void> dropMissing(SetDescription& set, bool strict, Job& job);
/// Errors with the first file of a view that is not there.
[[nodiscard]] Result<void> checkFilesAreThere(const SetDescription& set);

/// The views of a described frame in memory. `failing` becomes the number of the view that cannot
/// be read, where it is that.
[[nodiscard]] Result<Bundle> readViews(SetDescription set, const std::string& where,
                                       const ImageSetOptions& options, Job& job,
                                       std::optional<std::size_t>* failing = nullptr);

/// The same views as a table. Where nothing looks at all of them at once, and they would take more
/// than `held` bytes, each is read once here, for what is known of them before pixels are asked
/// for, and again when it is asked for; else they are in memory. `failing` as above. `said`, if
/// any, is shared by the moments of a film, of which one says that views disagree.
[[nodiscard]] Result<std::unique_ptr<ViewTable>> tableOfViews(
    SetDescription set, const std::string& where, const ImageSetOptions& options,
    std::uint64_t held, Job& job, std::optional<std::size_t>* failing = nullptr,
    std::shared_ptr<std::atomic<bool>> said = nullptr);

// What both ways have in common.

/// Puts the cameras of a set that has an origin there, leaves out what is missing, and checks that
/// the rest can be read.
[[nodiscard]] Result<void> prepareToRead(SetDescription& set, const std::string& where,
                                         const ImageSetOptions& options, Job& job);
/// loadSetView(), of which nothing is known where the view is absent, with an error where the
/// memory does not do.
[[nodiscard]] Result<std::vector<ReferenceView>> loadOne(const SetView& view,
                                                         const ImageSetOptions& options,
                                                         RefineReport& report, bool& showsNothing,
                                                         Job& job);
/// What loading all views gives beside them.
struct LoadedViews {
    RefineReport report;
    /// The views of which no pixel has a valid depth, ascending, and why of the first.
    std::vector<std::size_t> showNothing;
    Error why;
};
/// Loads all views, several at a time, and calls `take` with those of each, from any thread. Notes,
/// and the errors of the first that fails, come in the order of the views. Views that show nothing
/// are errors, too, where all do, or `failing` or ImageSetOptions::strict is given, or the set is a
/// frame of several, which have the same cameras.
[[nodiscard]] Result<LoadedViews> loadEach(
    const SetDescription& set, const std::string& where, const ImageSetOptions& options,
    std::size_t atOnce, Job& job, std::optional<std::size_t>* failing,
    const std::function<Result<void>(std::size_t index, std::vector<ReferenceView> views)>& take);
/// Takes the views that show nothing out of the set, and says so.
void leaveOut(const LoadedViews& loaded, SetDescription& set, Job& job);
/// Names become part and file names: each is there once.
void makeNamesUnique(std::vector<ReferenceView>& views);
/// Decides on the origin of a set whose bounds are known: Bundle::origin and bounds, the cameras.
/// What was subtracted from these.
glm::dvec3 findOrigin(Bundle& bundle, const SetDescription& set, Job& job);

/// Whether the depth of a view was measured, as depth cameras do, which miss some of it.
[[nodiscard]] bool depthWasMeasured(const ViewHeader& view);
/// When cameras of a set are moved so that views agree: as the options say, else of two views and
/// more whose depth was measured. None: not at all.
[[nodiscard]] std::optional<AlignPoses> alignsPoses(const Bundle& about,
                                                    const ImageSetOptions& options);
/// Does it to the cameras of a bundle, of which headers do, by samples of its views. `each`:
/// bounds of each view before `subtracted` was taken from all places.
[[nodiscard]] Result<void> alignCameras(Bundle& about, std::vector<PoseSample> samples,
                                        AlignPoses when, const std::vector<Bounds>& each,
                                        glm::dvec3 subtracted, RefineReport& report, Job& job);

}  // namespace stx::imagesets
