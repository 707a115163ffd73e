#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

/// The commands and their options as data. Help, shell completion and the manual page are all made
/// from the one place where a command adds an option.
namespace stx::tools {

struct OptionRow {
    std::vector<std::string> names;    ///< with their dashes; of a positional: its name alone
    std::string value;                 ///< what it takes, "WxH"; empty for a flag
    std::vector<std::string> choices;  ///< all values it takes, when they can be listed
    std::string range;                 ///< "1 to 8"; empty when any
    std::string help;
    std::string group;  ///< heading it stands under
    bool required = false;
    bool positional = false;
    bool many = false;  ///< takes several values
};

struct CommandRow {
    std::string name;
    std::string summary;   ///< one paragraph
    std::string examples;  ///< lines of commands, as they are
    std::vector<OptionRow> options;
};

[[nodiscard]] OptionRow optionRow(const CLI::Option& option);
[[nodiscard]] std::vector<CommandRow> optionTable(const CLI::App& app);

/// Help that lists choices and ranges in words.
class HelpFormatter : public CLI::Formatter {
  public:
    std::string make_option_opts(const CLI::Option* option) const override;
};

}  // namespace stx::tools
