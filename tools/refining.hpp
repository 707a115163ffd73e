#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "formats/any/options.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/sequence.hpp"
#include "lib/refine/refine.hpp"
#include "tools/command_line.hpp"

namespace stx::tools {

/// --refine auto|off|STEPS of commands that draw or write refined views.
Option refineOption(Command& command, std::string& text);

/// The settings of that option, of views that are there. Errors (usage): a step that only an import
/// can do.
[[nodiscard]] Result<RefineSettings> refineSettings(const std::string& text);

/// Refines views that are there; a note says which steps were done. `then`: as below.
[[nodiscard]] Result<void> refineViews(Bundle& bundle, const RefineSettings& settings,
                                       const PeakMemory& then, Job& job);

/// The same of views in a spool, which must outlive the bundle.
[[nodiscard]] Result<void> refineViews(Bundle& bundle, const RefineSettings& settings,
                                       PixelSpool& spool, Job& job);

/// Frames that are refined when they are read; a note says which steps were done. `text` is that of
/// the option. `then` is what they are for: errors (invalidInput) where they are too large for it.
/// `folder`: for what memory does not hold. Views that are asked for one by one are in a spool
/// there where that takes less (refinedViews()).
[[nodiscard]] Result<std::unique_ptr<Sequence>> refined(std::unique_ptr<Sequence> frames,
                                                        const std::string& text,
                                                        const PeakMemory& then,
                                                        const std::filesystem::path& folder);
/// The same of frames that are read more than once: what became of them is kept in the folder.
[[nodiscard]] Result<std::unique_ptr<Sequence>> refinedOnce(std::unique_ptr<Sequence> frames,
                                                            const std::string& text,
                                                            const PeakMemory& then,
                                                            const std::filesystem::path& folder);

/// Does refine() of a bundle, or of one in a spool.
using RefineBundle = std::function<Result<void>(Bundle& bundle, PixelSpool* spool, Job& job)>;
/// The views of one moment, refined: as they are where mayRefine() finds nothing to do, else from
/// memory, or from a spool in a folder where that takes less memory. What `refine` takes in memory,
/// and what follows, it checks itself. `looksFirst`: whether mayRefine() is asked of views that
/// memory holds, too.
[[nodiscard]] Result<std::unique_ptr<ViewTable>> refinedViews(
    std::unique_ptr<ViewTable> table, const RefineSettings& settings, const RefineBundle& refine,
    bool looksFirst, const std::filesystem::path& folder, Job& job);

/// Frames on their way into a target, each changed once: MPEG-4 films are written in two passes.
[[nodiscard]] std::unique_ptr<Sequence> changedOnTheWay(
    std::unique_ptr<Sequence> frames, const std::filesystem::path& target,
    std::function<Result<void>(Bundle& frame, Job& job)> change);

/// Refines what a command reads: an image set at its import, and whatever is there afterwards.
class Refining {
  public:
    explicit Refining(RefineSettings settings) : settings_(settings) {}
    Refining(const Refining&) = delete;
    Refining& operator=(const Refining&) = delete;

    /// Options by which an import does its steps and tells what they did; they use this object.
    void import(ImageSetOptions& options);
    /// What is left to do of a bundle. Errors: those of check() and refine().
    Result<void> refine(Bundle& bundle, Job& job) { return refine(bundle, nullptr, job); }
    /// The same; in a spool if it is not null.
    Result<void> refine(Bundle& bundle, PixelSpool* spool, Job& job);
    /// Errors (usage): a step that only an import can do, where the input is not an image set.
    [[nodiscard]] Result<void> check() const;
    /// Whether what was read is an image set, whose import has done its steps.
    [[nodiscard]] bool imported() const { return imported_; }
    /// What is left to do of what was read last.
    [[nodiscard]] RefineSettings left() const {
        return imported_ ? settings_.afterImport() : settings_;
    }
    /// Of all that was read.
    [[nodiscard]] const RefineReport& report() const { return report_; }

  private:
    RefineSettings settings_;
    RefineReport report_;
    RefineReport atImport_;  ///< of the moment that was read last
    bool imported_ = false;
};

/// The refining of `stx convert`: what an import does, and what is named of bundles that are there.
struct ImportRefining {
    std::string steps = "auto";  ///< of --refine
    /// What options of single steps say, by RefineStep; automatic: they were not given.
    std::array<RefineSwitch, kRefineSteps> switches{};
    bool poses = false;  ///< --refine-poses

    /// What an import is to do. Errors (usage): a name that is none.
    [[nodiscard]] Result<RefineSettings> settings() const;
    /// The steps that --refine names of a bundle that is there; none are done by themselves. Notes
    /// say which cannot be of what was not `imported` now.
    [[nodiscard]] Result<RefineSettings> left(bool imported, Job& job) const;
    /// Does them. Notes say what was done.
    Result<void> refine(Bundle& bundle, bool imported, Job& job) const;
    /// The same of one moment: refinedViews().
    [[nodiscard]] Result<std::unique_ptr<ViewTable>> refined(std::unique_ptr<ViewTable> table,
                                                             bool imported,
                                                             const std::filesystem::path& folder,
                                                             Job& job) const;
};

/// --refine, and the options of single steps under that heading. `refining` must
/// outlive the command.
void addImportRefining(Command command, ImportRefining& refining, const char* heading);

}  // namespace stx::tools
