#pragma once

#include <string_view>

namespace stx::tools {

/// Makes each of the three standard streams that the caller closed one that can be neither read nor
/// written. Else the next file that is opened would get its number: messages would go into a
/// picture, and a film would be taken for stdin. First of all, before any file is opened.
void openClosedStreams();

/// Writes to stderr as far as that goes: what people are told must not stop the work, and neither
/// must a full disk or a closed pipe behind it.
void writeToStderr(std::string_view text) noexcept;

}  // namespace stx::tools
