#include "tools/refine_option.hpp"

#include <fmt/format.h>

namespace stx::tools {

Option refineOption(Command& command, std::string& text) {
    std::string names;
    for (const RefineStepInfo& step : refineSteps())
        names += (names.empty() ? "" : ",") + std::string(step.name);
    return command
        .option("--refine", text,
                "Depth is refined first: auto (where it is not exact), off, or these steps only: " +
                    names + " (see stx refine; default auto)")
        .takes("auto|off|STEPS");
}

Result<std::unique_ptr<Sequence>> refined(std::unique_ptr<Sequence> frames,
                                          const std::string& text) {
    STX_TRY(const auto settings, RefineSettings::from(text));
    if (!settings.any()) return frames;
    return changed(std::move(frames), [settings](Bundle& bundle, Job& job) -> Result<void> {
        STX_TRY(const auto report, refine(bundle, settings, job));
        if (report.changed()) job.note(report.note());
        return {};
    });
}

}  // namespace stx::tools
