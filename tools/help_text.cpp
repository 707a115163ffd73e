#include "tools/help_text.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

#include <fmt/format.h>

namespace stx::tools {
namespace {

constexpr std::size_t kColumn = 34;       ///< where descriptions begin
constexpr std::size_t kNarrowColumn = 8;  ///< the same where lines have no room for that
constexpr std::size_t kNarrow = 64;       ///< such lines

/// Columns that UTF-8 takes: bytes that begin a character.
std::size_t columnsOf(std::string_view text) {
    return static_cast<std::size_t>(
        std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

/// Words of `text` in lines up to `width`. The first begins at column `at`, the others at `indent`;
/// `broken` is put at the end of each but the last.
std::string wrapped(std::string_view text, std::size_t at, std::size_t indent, std::size_t width,
                    std::string_view broken = "") {
    std::string out;
    bool begins = true;
    while (true) {
        const auto first = text.find_first_not_of(" \n");
        if (first == text.npos) break;
        text.remove_prefix(first);
        auto word = text.substr(0, text.find_first_of(" \n"));
        // A list that no line holds goes on in the next.
        if (columnsOf(word) + indent > width && width > indent) {
            const auto cut = word.find_last_of(",|", width - indent - 1);
            if (cut != word.npos) word = word.substr(0, cut + 1);
        }
        const std::size_t columns = columnsOf(word);
        if (!begins && at + 1 + columns + broken.size() > width) {
            out += fmt::format("{}\n{:{}}", broken, "", indent);
            at = indent;
        } else if (!begins) {
            out += ' ';
            ++at;
        }
        out += word;
        at += columns;
        begins = false;
        text.remove_prefix(word.size());
    }
    return out;
}

/// A name and, from a column on, what it is.
std::string entry(const std::string& name, std::string_view what, std::size_t width) {
    const std::size_t column = width < kNarrow ? kNarrowColumn : kColumn;
    std::string spaced;  // so that long lists of words are wrapped, too
    for (const char c : name) {
        spaced += c;
        if (columnsOf(name) + 2 > width && (c == '|' || c == ',')) spaced += ' ';
    }
    std::string out = "  " + wrapped(spaced, 2, 4, width);
    const std::size_t last = columnsOf(std::string_view(out).substr(out.rfind('\n') + 1));
    if (last + 1 > column)
        out += fmt::format("\n{:{}}", "", column);
    else
        out.append(column - last, ' ');
    return out + wrapped(what, column, column, width) + "\n";
}

/// The first sentence, with the default that a later one gives.
std::string briefly(const std::string& help) {
    int depth = 0;
    for (std::size_t i = 0; i + 1 < help.size(); ++i) {
        depth += (help[i] == '(') - (help[i] == ')');
        if (depth != 0 || help[i] != '.' || help[i + 1] != ' ') continue;
        std::string out = help.substr(0, i);
        const auto usual = help.find("(default", i);
        if (usual != help.npos) out += " " + help.substr(usual, help.find(')', usual) + 1 - usual);
        return out;
    }
    return help;
}

std::string nameOf(const OptionRow& option) {
    std::string name = fmt::format("{}", fmt::join(option.names, ","));
    if (!option.choices.empty())
        name += fmt::format(" {}", fmt::join(option.choices, "|"));
    else if (!option.value.empty() && !option.positional)
        name += " " + option.value;
    if (!option.range.empty()) name += fmt::format(" ({})", option.range);
    if (option.many) name += " ...";
    if (option.required) name += " (required)";
    return name;
}

/// Lines of examples and what is said after them: commands stay in lines of their own.
std::string examples(std::string_view text, std::size_t width) {
    std::string out, paragraph;
    const auto flush = [&] {
        if (!paragraph.empty()) out += wrapped(paragraph, 0, 0, width) + "\n";
        paragraph.clear();
    };
    while (!text.empty()) {
        const auto line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(line.size() + 1, text.size()));
        if (!line.empty() && line[0] != ' ') {
            paragraph += std::string(line) + " ";
            continue;
        }
        flush();
        const auto indent = std::min(line.find_first_not_of(' '), line.size());
        // A second column is wrapped within that column.
        const auto gap = line.rfind("  ");
        if (columnsOf(line) <= width)
            out += line;
        else if (gap != line.npos && gap > indent && gap + 2 + kNarrowColumn < width)
            out += std::string(line.substr(0, gap + 2)) +
                   wrapped(line.substr(gap + 2), gap + 2, gap + 2, width);
        else
            out += std::string(indent, ' ') + wrapped(line, indent, indent + 4, width, " \\");
        out += '\n';
    }
    flush();
    return out;
}

std::string groups(const CommandRow& command, HelpDetail detail, std::size_t width) {
    std::vector<std::string> headings;
    const auto headingOf = [](const OptionRow& option) {
        return option.positional ? "Positionals" : option.group;
    };
    for (const OptionRow& option : command.options)
        if (std::ranges::find(headings, headingOf(option)) == headings.end())
            headings.push_back(headingOf(option));
    std::string out;
    for (const std::string& heading : headings) {
        out += "\n" + wrapped(heading + ":", 0, 2, width) + "\n";
        for (const OptionRow& option : command.options)
            if (headingOf(option) == heading)
                out +=
                    entry(nameOf(option),
                          detail == HelpDetail::brief ? briefly(option.help) : option.help, width);
    }
    return out;
}

}  // namespace

int helpWidth() {
    winsize size = {};
    if (isatty(STDOUT_FILENO) == 0 || ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 ||
        size.ws_col == 0)
        return 80;
    return std::clamp<int>(size.ws_col, 40, 110);
}

std::string helpOf(const CommandRow& command, HelpDetail detail, int width) {
    const auto columns = static_cast<std::size_t>(width);
    std::string out = wrapped(command.summary, 0, 0, columns) + "\n";
    if (!command.examples.empty()) out += "\n" + examples(command.examples, columns);
    std::string usage = "stx " + command.name + " [OPTIONS]";
    bool shortened = false;
    for (const OptionRow& option : command.options) {
        shortened = shortened || briefly(option.help) != option.help;
        if (!option.positional) continue;
        const std::string name = option.names[0] + (option.many ? "..." : "");
        usage += option.required ? " " + name : fmt::format(" [{}]", name);
    }
    out += "\nUsage: " + usage + "\n" + groups(command, detail, columns);
    if (shortened && detail == HelpDetail::brief)
        out += "\n" +
               wrapped(fmt::format("More of each option: stx help {}, or the manual page.",
                                   command.name),
                       0, 0, columns) +
               "\n";
    return out;
}

std::string helpOfProgram(const CommandRow& program, const std::vector<CommandRow>& commands,
                          std::string_view exitCodes, int width) {
    const auto columns = static_cast<std::size_t>(width);
    std::string out = wrapped(program.summary, 0, 0, columns) +
                      "\n\nUsage: stx COMMAND [OPTIONS]\n" +
                      groups(program, HelpDetail::whole, columns) + "\nCommands:\n";
    for (const CommandRow& command : commands)
        out += entry(command.name, briefly(command.summary), columns);
    return out + "\n" + wrapped(exitCodes, 0, 0, columns) + "\n";
}

}  // namespace stx::tools
