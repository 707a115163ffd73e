#pragma once

#include <string>
#include <string_view>

#include "lib/base/job.hpp"

namespace stx::tools {

/// Makes each of the three standard streams that the caller closed one that can be neither read nor
/// written. Else the next file that is opened would get its number: messages would go into a
/// picture, and a film would be taken for stdin. First of all, before any file is opened.
void openClosedStreams();

/// What a command's input "-" stands for: a name that is opened as often as anybody wants. Others
/// stay as they are.
[[nodiscard]] std::string inputNamed(std::string input);

/// Once inputNamed() was asked for stdin: takes what comes through a pipe into memory, since files
/// are read here and there. Errors: io; (invalidInput) more than the limit.
[[nodiscard]] Result<void> takeStandardInput(const Limits& limits);

/// Writes to stderr as far as that goes: what people are told must not stop the work, and neither
/// must a full disk or a closed pipe behind it.
void writeToStderr(std::string_view text) noexcept;

}  // namespace stx::tools
