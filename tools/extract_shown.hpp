#pragma once

#include <optional>
#include <string>

#include "formats/any/options.hpp"
#include "tools/program.hpp"

namespace stx::tools {

/// Whether a file that ends so is one that others show as it is: ".html", a page for browsers,
/// and ".glb", a model for any viewer.
[[nodiscard]] bool isShown(const std::string& ending);
/// `stx extract` into such a file: says what was written and reports it. `time`: the moment that a
/// model is of. `refine`: see refineOption(). Errors: those of momentOf(), of the input and of
/// writing.
[[nodiscard]] Result<int> extractShown(const std::string& input, const OpenOptions& open,
                                       const std::string& output, const std::optional<double>& time,
                                       const std::string& refine, Program& program);

}  // namespace stx::tools
