#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tools/command_line.hpp"

namespace stx::tools {

/// Columns that help is wrapped to: those of the terminal that stdout is, 40 to 110; 80 without
/// one.
[[nodiscard]] int helpWidth();

/// How much is said of each option.
enum class HelpDetail {
    brief,  ///< its first sentence and its default
    whole,
};

/// The help of a command, in lines of at most `width` columns where words allow it.
[[nodiscard]] std::string helpOf(const CommandRow& command, HelpDetail detail, int width);
/// The help of the program: its options, what each command is for, and the exit codes.
[[nodiscard]] std::string helpOfProgram(const CommandRow& program,
                                        const std::vector<CommandRow>& commands,
                                        std::string_view exitCodes, int width);

}  // namespace stx::tools
