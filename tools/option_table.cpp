#include "tools/option_table.hpp"

#include <regex>
#include <sstream>

#include <fmt/format.h>

namespace stx::tools {
namespace {

/// What CLI11 says of a validator, "{png,jpeg}" or "value in {auto->0,drop->1} OR {0,1}".
std::vector<std::string> choicesIn(const std::string& text) {
    std::vector<std::string> choices;
    const auto open = text.find('{'), close = text.find('}');
    if (open == std::string::npos || close == std::string::npos || close < open) return choices;
    std::stringstream list(text.substr(open + 1, close - open - 1));
    for (std::string word; std::getline(list, word, ',');)
        choices.push_back(word.substr(0, word.find("->")));
    return choices;
}

/// "INT in [1 - 8]", "POSITIVE" and the like, for people.
std::string rangeIn(const std::string& text) {
    static const std::regex between(R"(in \[(\S+) - (\S+)\])");
    std::smatch found;
    if (std::regex_search(text, found, between))
        return fmt::format("{} to {}", found[1].str(), found[2].str());
    if (text.find("NONNEGATIVE") != std::string::npos) return "0 or more";
    if (text.find("POSITIVE") != std::string::npos) return "above 0";
    return {};
}

}  // namespace

OptionRow optionRow(const CLI::Option& option) {
    OptionRow row;
    for (const auto& name : option.get_snames()) row.names.push_back("-" + name);
    for (const auto& name : option.get_lnames()) row.names.push_back("--" + name);
    row.positional = row.names.empty();
    if (row.positional) row.names.push_back(option.get_name(true));
    row.help = option.get_description();
    row.group = option.get_group();
    row.required = option.get_required();
    row.many = option.get_items_expected_max() > 1;
    if (option.get_items_expected_max() > 0) {
        const std::string type = option.get_type_name();
        const auto colon = type.find(':');
        row.value = type.substr(0, colon);
        if (row.value == "TEXT" || row.value == "ENUM") row.value = "WORD";
        if (row.value == "INT" || row.value == "UINT" || row.value == "FLOAT") row.value = "N";
        if (colon != std::string::npos) {
            row.choices = choicesIn(type.substr(colon));
            if (row.choices.empty()) row.range = rangeIn(type.substr(colon));
        }
    }
    return row;
}

std::vector<CommandRow> optionTable(const CLI::App& app) {
    std::vector<CommandRow> table;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        const std::string text = command->get_description();
        const auto blank = text.find("\n\n");
        CommandRow row{command->get_name(), text.substr(0, blank), {}, {}};
        if (blank != std::string::npos) row.examples = text.substr(blank + 2);
        for (const CLI::Option* option :
             command->get_options([](const CLI::Option*) { return true; }))
            row.options.push_back(optionRow(*option));
        table.push_back(std::move(row));
    }
    return table;
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
    const OptionRow row = optionRow(*option);
    std::string text;
    if (!row.choices.empty())
        text += fmt::format(" {}", fmt::join(row.choices, "|"));
    else if (!row.value.empty() && !row.positional)
        text += " " + row.value;
    if (!row.range.empty()) text += fmt::format(" ({})", row.range);
    if (row.many) text += " ...";
    if (row.required) text += " (required)";
    return text;
}

}  // namespace stx::tools
