#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "lib/render/api/renderer.hpp"

namespace stx::tools {

/// Leaves out stages of rendering and steps of refining; `names` has commas between them. Errors
/// (usage): a name that is none, with the list of those that are.
[[nodiscard]] Result<void> leaveOut(const std::string& names, RenderSettings& settings);
/// The names of --without for its help: those of drawing.
[[nodiscard]] std::string stageNames();

/// What a log was told, for people and for reports; `frames` were drawn.
[[nodiscard]] std::string explained(const StageLog& log, std::size_t frames);
[[nodiscard]] nlohmann::ordered_json stagesJson(const StageLog& log);

}  // namespace stx::tools
