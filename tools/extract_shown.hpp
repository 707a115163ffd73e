#pragma once

#include <optional>
#include <string>

#include "lib/model/sequence.hpp"
#include "tools/program.hpp"

namespace stx::tools {

/// Whether a file that ends so is one that others show as it is: ".html", a page for browsers,
/// and ".glb", a model for any viewer.
[[nodiscard]] bool isShown(const std::string& ending);
/// `stx extract` into such a file: says what was written and reports it. `time`: the moment that a
/// model is of. Errors: those of momentOf(), of the input and of writing.
[[nodiscard]] Result<int> extractShown(const std::string& input, const std::string& output,
                                       const std::optional<double>& time, Program& program);

/// The frame of --time, the first where it is not given. Errors (usage): a time before the start;
/// none of a film for what is of one moment only: `whatIs`, as in "points are", else null.
[[nodiscard]] Result<std::size_t> momentOf(const std::optional<double>& time,
                                           const Timeline& timeline, const char* whatIs,
                                           const std::string& input);

}  // namespace stx::tools
