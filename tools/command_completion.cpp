// `stx completion`: what a shell needs to complete stx's commands and options, and the manual page.

#include "tools/commands.hpp"

namespace stx::tools {
namespace {

std::string replaced(std::string text, std::string_view what, std::string_view by) {
    for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
        text.replace(at, what.size(), by);
    return text;
}

/// The first line without its full stop: shells show one.
std::string firstLine(const std::string& text) {
    return text.substr(0, text.find('\n'));
}

std::string words(const std::vector<std::string>& list) {
    return fmt::format("{}", fmt::join(list, " "));
}

std::vector<std::string> dashed(const CommandRow& command) {
    std::vector<std::string> names;
    for (const OptionRow& option : command.options)
        if (!option.positional) names.insert(names.end(), option.names.begin(), option.names.end());
    return names;
}

std::vector<std::string> commandNames(const std::vector<CommandRow>& table) {
    std::vector<std::string> names;
    for (const CommandRow& command : table) names.push_back(command.name);
    return names;
}

/// How values begin that cannot be listed; a file may be meant instead.
struct Beginnings {
    const char* option;
    const char* words;
};
constexpr Beginnings kBeginnings[] = {
    {"--views", "cube ring: sphere: octahedral: hemi-octahedral: auto:"},
    {"--light", "dir: point:"},
};

/// Those of an option; empty when there are none.
std::string beginningsOf(const OptionRow& option) {
    for (const auto& known : kBeginnings)
        for (const auto& name : option.names)
            if (name == known.option) return known.words;
    return {};
}

// ---- bash ----

std::string bashCompletion(const std::vector<CommandRow>& table) {
    std::string choices, options;
    for (const CommandRow& command : table) {
        for (const OptionRow& option : command.options) {
            const std::string list =
                option.choices.empty() ? beginningsOf(option) : words(option.choices);
            if (list.empty()) continue;
            std::vector<std::string> patterns;
            for (const auto& name : option.names)
                patterns.push_back(option.positional ? ""
                                                     : fmt::format("'{} {}'", command.name, name));
            if (option.positional) continue;
            choices += fmt::format("        {}) list='{}' ;;\n", fmt::join(patterns, "|"), list);
        }
        options += fmt::format("        {}) list='{}' ;;\n", command.name, words(dashed(command)));
    }
    for (const CommandRow& command : table)
        for (const OptionRow& option : command.options)
            if (option.positional && !option.choices.empty())
                choices += fmt::format("        '{} {}') list='{}' ;;\n", command.name,
                                       command.name, words(option.choices));
    return fmt::format(R"(# bash completion of stx
_stx() {{
    local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}} list=''
    # --option=value arrives as three words.
    if [[ $cur == '=' ]]; then cur=''; elif [[ $prev == '=' ]]; then prev=${{COMP_WORDS[COMP_CWORD-2]}}; fi
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        COMPREPLY=($(compgen -W '{} --help --version' -- "$cur"))
        return
    fi
    # A list of names, @FILE, arrives as one word or as two.
    if [[ $cur == '@' ]]; then cur=''; prev='@'; fi
    if [[ $prev == '@' || $cur == @* ]]; then
        local mark=''
        [[ $cur == @* ]] && mark='@'
        mapfile -t COMPREPLY < <(compgen -f -P "$mark" -- "${{cur#@}}")
        return 0
    fi
    # After sphere: comes a number.
    [[ $cur == ':' || $prev == ':' ]] && return 0
    case "${{COMP_WORDS[1]}} $prev" in
{}    esac
    if [[ -z $list && $cur == -* ]]; then
        case ${{COMP_WORDS[1]}} in
{}        esac
    fi
    # Without a list: file names, by `-o default`.
    [[ -n $list ]] && COMPREPLY=($(compgen -W "$list" -- "$cur"))
    # No space after sphere: either.
    [[ ${{#COMPREPLY[@]}} == 1 && ${{COMPREPLY[0]}} == *: ]] && compopt -o nospace 2> /dev/null
    return 0
}}
complete -o bashdefault -o default -F _stx stx
)",
                       words(commandNames(table)), choices, options);
}

// ---- zsh ----

std::string zshText(const std::string& text) {
    std::string out = replaced(firstLine(text), "\\", "\\\\");
    for (const char* special : {"[", "]", ":"})
        out = replaced(out, special, std::string("\\") + special);
    return replaced(out, "'", "'\\''");
}

std::string zshCompletion(const std::vector<CommandRow>& table) {
    std::string commands, cases;
    for (const CommandRow& command : table) {
        commands += fmt::format("        '{}:{}'\n", command.name, zshText(command.summary));
        std::string specs;
        for (const OptionRow& option : command.options) {
            const std::string beginnings = beginningsOf(option);
            const std::string values =
                !option.choices.empty() ? fmt::format("({})", words(option.choices))
                : !beginnings.empty()
                    ? fmt::format("{{_files; compadd -S \"\" -- {}}}", zshText(beginnings))
                : option.positional && option.many ? "{compset -P @; _files}"
                                                   : "_files";
            if (option.positional) {
                specs += fmt::format(" \\\n                '{}:{}:{}'", option.many ? "*" : "",
                                     zshText(option.names[0]), values);
                continue;
            }
            const std::string value =
                option.value.empty() ? "" : fmt::format(":{}:{}", zshText(option.value), values);
            for (const auto& name : option.names)
                specs += fmt::format(" \\\n                '({}){}[{}]{}'", words(option.names),
                                     name, zshText(option.help), value);
        }
        cases +=
            fmt::format("            {})\n            _arguments -s{} ;;\n", command.name, specs);
    }
    return fmt::format(R"(#compdef stx
_stx() {{
    local -a commands
    commands=(
{}    )
    if ((CURRENT == 2)); then
        _describe command commands
        return
    fi
    local command=$words[2]
    shift words
    ((CURRENT--))
    case $command in
{}    esac
}}
_stx "$@"
)",
                       commands, cases);
}

// ---- fish ----

std::string fishText(const std::string& text) {
    return replaced(replaced(firstLine(text), "\\", "\\\\"), "'", "\\'");
}

std::string fishCompletion(const std::vector<CommandRow>& table) {
    std::string out = "# fish completion of stx\n";
    for (const CommandRow& command : table)
        out += fmt::format("complete -c stx -n __fish_use_subcommand -f -a {} -d '{}'\n",
                           command.name, fishText(command.summary));
    for (const CommandRow& command : table) {
        for (const OptionRow& option : command.options) {
            out += fmt::format("complete -c stx -n '__fish_seen_subcommand_from {}'", command.name);
            for (const auto& name : option.names) {
                if (option.positional) continue;
                out += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
            }
            if (!option.choices.empty())
                out += fmt::format("{} -a '{}'", option.positional ? " -f" : " -x",
                                   words(option.choices));
            else if (!beginningsOf(option).empty())
                out += fmt::format(" -r -a '{}'", beginningsOf(option));
            else if (!option.value.empty() && !option.positional)
                out += " -r";
            else if (option.positional)
                out += " -F";
            out += fmt::format(" -d '{}'\n", fishText(option.help));
        }
    }
    return out;
}

// ---- man ----

std::string roff(const std::string& text) {
    std::string out = replaced(replaced(text, "\\", "\\e"), "-", "\\-");
    out = replaced(out, "\n.", "\n\\&.");
    out = replaced(out, "\n'", "\n\\&'");
    if (out.starts_with('.') || out.starts_with('\'')) out = "\\&" + out;
    return out;
}

std::string manualPage(const std::vector<CommandRow>& table, const std::string& exitCodes) {
    std::string out = fmt::format(
        ".TH STX 1 \"\" \"stx {}\"\n.SH NAME\nstx \\- {}\n.SH SYNOPSIS\n.B stx\n.I COMMAND\n"
        "[OPTIONS]\n.SH COMMANDS\n",
        STX_VERSION, roff("the MPEG-4 AFX SimpleTexture toolkit"));
    for (const CommandRow& command : table) {
        out += fmt::format(".SS stx {}\n{}\n", command.name, roff(command.summary));
        if (!command.examples.empty())
            out += fmt::format(".PP\n.nf\n{}\n.fi\n", roff(command.examples));
        for (const OptionRow& option : command.options) {
            std::vector<std::string> names;
            for (const auto& name : option.names) names.push_back("\\fB" + roff(name) + "\\fR");
            std::string value;
            if (!option.choices.empty())
                value = fmt::format(" {}", fmt::join(option.choices, "|"));
            else if (!option.value.empty() && !option.positional)
                value = " \\fI" + roff(option.value) + "\\fR";
            if (!option.range.empty()) value += fmt::format(" ({})", roff(option.range));
            out += fmt::format(".TP\n{}{}\n{}\n", fmt::join(names, ", "), value, roff(option.help));
        }
    }
    return out + fmt::format(".SH EXIT STATUS\n{}\n", roff(exitCodes));
}

}  // namespace

void addCompletion(CommandLine& line, Program&) {
    Command c =
        line.add("completion",
                 "What a shell needs to complete stx's commands and options; or the manual page\n\n"
                 "  source <(stx completion bash)\n"
                 "  stx completion fish > ~/.config/fish/completions/stx.fish\n"
                 "  stx completion man > stx.1");
    auto kind = std::make_shared<std::string>();
    c.option("SHELL", *kind, "For which shell; man: the manual page")
        .required()
        .oneOf({"bash", "zsh", "fish", "man"});
    c.runs([&line, kind](Program& program) -> Result<int> {
        const auto table = line.table();
        program.print(*kind == "bash"   ? bashCompletion(table)
                      : *kind == "zsh"  ? zshCompletion(table)
                      : *kind == "fish" ? fishCompletion(table)
                                        : manualPage(table, line.exitCodes()));
        return 0;
    });
}

}  // namespace stx::tools
