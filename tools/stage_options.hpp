#pragma once

#include <memory>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "lib/model/sequence.hpp"
#include "lib/render/api/renderer.hpp"
#include "tools/command_line.hpp"

namespace stx::tools {

/// --refine auto|off|STEPS of commands that draw or write refined views.
Option refineOption(Command& command, std::string& text);

/// Frames whose depth is refined when they are read; a note says which steps were done. `text` is
/// that of the option.
[[nodiscard]] Result<std::unique_ptr<Sequence>> refined(std::unique_ptr<Sequence> frames,
                                                        const std::string& text);

/// Leaves out stages of rendering and steps of refining; `names` has commas between them. Errors
/// (usage): a name that is none, with the list of those that are.
[[nodiscard]] Result<void> leaveOut(const std::string& names, RenderSettings& settings);
/// The names of --without for its help: those of drawing.
[[nodiscard]] std::string stageNames();

/// What a log was told, for people and for reports; `frames` were drawn.
[[nodiscard]] std::string explained(const StageLog& log, std::size_t frames);
[[nodiscard]] nlohmann::ordered_json stagesJson(const StageLog& log);

}  // namespace stx::tools
