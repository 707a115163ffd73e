#pragma once

#include <concepts>
#include <deque>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "lib/base/result.hpp"
#include "tools/output_names.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

/// The command line, made and parsed with CLI11, which only command_line.cpp includes: reading its
/// header costs each file more than compiling a whole command. Help, shell completion and the
/// manual page are all made from the one place where a command adds an option.
namespace stx::tools {

class Program;
struct CommonOptions;
enum class HelpDetail;

/// The options of a command whose values name files and folders, beside positionals, which all name
/// inputs unless they are words from a list.
struct PathOptions {
    std::vector<const CLI::Option*> inputs, outputs;
    const CLI::Option* replacing = nullptr;  ///< the output that may take the input's place
};

/// An option that was just added, to say more about it.
class Option {
  public:
    Option(CLI::Option* option, PathOptions& paths) : option_(option), paths_(&paths) {}

    /// What it takes, for people: "WxH".
    Option& takes(const std::string& what);
    /// The same of what names an input: no output may have its place.
    Option& reads(const std::string& what);
    /// The same of what names an output: it has the place neither of an input nor of another one.
    Option& writes(const std::string& what);
    /// The same of an output that is of the input's kind: where there is one input, it may have its
    /// place, since files are written beside it and renamed at the end. Not with --object, which
    /// leaves the other objects of the input out.
    Option& replaces(const std::string& what);
    Option& required();
    /// One value with commas in it is several.
    Option& commaSeparated();
    Option& oneOf(const std::vector<std::string>& words);
    Option& oneOf(std::initializer_list<const char*> words) {
        return oneOf(std::vector<std::string>(words.begin(), words.end()));
    }
    Option& oneOf(std::initializer_list<int> numbers);
    Option& range(int least, int most);
    Option& range(double least, double most);
    /// 0, which has a meaning of its own, or a number of the range.
    Option& zeroOrRange(int least, int most);
    Option& notNegative();
    Option& positive();

  private:
    CLI::Option* option_;
    PathOptions* paths_;
};

/// Which of the shared options a command has beside --threads, --max-memory, --quiet, -v.
enum SharedOptions : unsigned {
    kOutput = 1,    ///< --no-clobber, --report
    kFormat = 2,    ///< --format text|json
    kOutside = 4,   ///< --allow-outside
    kPictures = 8,  ///< --damaged error|keep, where pictures are decoded
};

/// One command and its options. `names` are as in "-o,--output"; a name without dashes is of a
/// positional. What options are written to must outlive the parsing. Copies are the same command.
class Command {
  public:
    using Body = std::function<Result<int>(Program&)>;

    Command(CLI::App* app, Body& body, PathOptions& paths)
        : app_(app), body_(&body), paths_(&paths) {}

    /// The same command, whose further options the help lists under this heading.
    [[nodiscard]] Command under(const std::string& heading) const;

    /// `to` is a string, several, a number, or a number that may be left out.
    template <class Value>
    requires(!std::invocable<Value&, const std::string&>) Option
        option(const std::string& names, Value& to, const std::string& help);
    /// A text that `parse` takes or refuses.
    Option option(const std::string& names, std::function<Result<void>(const std::string&)> parse,
                  const std::string& help);
    /// A word for each value.
    template <class Value>
    Option choice(const std::string& names, Value& to,
                  const std::vector<std::pair<std::string, Value>>& words,
                  const std::string& help) {
        std::vector<std::string> list;
        for (const auto& w : words) list.push_back(w.first);
        const auto take = [&to, words](const std::string& text) -> Result<void> {
            for (const auto& w : words)
                if (w.first == text) to = w.second;
            return {};
        };
        return option(names, take, help).oneOf(list);
    }
    Option flag(const std::string& names, bool& to, const std::string& help);
    /// How often it is given.
    Option flag(const std::string& names, int& count, const std::string& help);
    /// Those of SharedOptions that `which` names, and those that every command has.
    void sharedOptions(CommonOptions& to, unsigned which);
    /// --object, of commands that open one model.
    void objectOption(std::string& to);
    /// What it does once its options are parsed; gives the exit code.
    void runs(Body body);

    // ---- Once the options are parsed. ----

    /// Those of `names` ("--size") that were given, in that order.
    [[nodiscard]] std::vector<std::string> given(const std::vector<std::string>& names) const;
    /// The options under a heading of the help that were given.
    [[nodiscard]] std::vector<std::string> givenUnder(const std::string& heading) const;
    /// A hash of the inputs and options that were given, of paths their last part, in 16
    /// hexadecimal digits. Without the options that are shared (sharedOptions()) and those of
    /// `names`.
    [[nodiscard]] std::string jobOf(const std::vector<std::string>& without) const;
    /// Error (usage) when one of `names` was given though it cannot matter. `why` goes on after the
    /// name: "is of lighting; give --light, too".
    [[nodiscard]] Result<void> refuse(const std::vector<std::string>& names,
                                      const std::string& why) const;
    /// The last names of all that it reads: of `inputs`, and of what options name.
    [[nodiscard]] std::set<std::string> namesRead(const std::vector<std::string>& inputs) const;
    /// What CommandLine::parse() checks of outputs, again with what lists and patterns stand for:
    /// `inputs` (alikeAmong()) for those that stand alone, `outputs`, if there are some, for the
    /// output that may take an input's place.
    [[nodiscard]] Result<void> checkNames(const std::vector<std::string>& inputs,
                                          const std::vector<NamedPath>& outputs = {}) const;

  private:
    Option added(CLI::Option* option, bool lastCounts) const;

    CLI::App* app_;
    Body* body_;
    PathOptions* paths_;
    std::string heading_;  ///< empty: that of CLI11
};

/// An option as a row of a table.
struct OptionRow {
    std::vector<std::string> names;    ///< with their dashes; of a positional: its name alone
    std::string value;                 ///< what it takes, "WxH"; empty for a flag
    std::vector<std::string> choices;  ///< all values it takes, when they can be listed
    std::string range;                 ///< "1 to 8"; empty when any
    std::string help;
    std::string group;  ///< heading that it is listed under
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

/// All commands of the program `stx`.
class CommandLine {
  public:
    CommandLine();
    ~CommandLine();
    CommandLine(const CommandLine&) = delete;
    CommandLine& operator=(const CommandLine&) = delete;

    /// A new command. `help` is a summary, an empty line and examples.
    [[nodiscard]] Command add(const std::string& name, const std::string& help);

    /// What the arguments ask for: a text to print (help, the version), or a command's body.
    struct Request {
        std::string text;
        Command::Body body;
        std::string command;  ///< its name
    };
    /// Errors (usage) in one line that says where to read on, with the nearest known word for an
    /// unknown one; also where an output would take the place of an input or of another output.
    [[nodiscard]] Result<Request> parse(int argc, char** argv) const;

    /// What the arguments say of the report of a command line that parse() refused. They are read
    /// word by word, since the parse may have stopped before them.
    struct FailedRequest {
        std::string command;  ///< empty: none that there is
        /// Of --report; empty: none, the command has no report, or it has no right place: another
        /// word names that file, or it has the name of a picture or a model.
        std::string report;
        bool noClobber = false;
    };
    [[nodiscard]] FailedRequest failedRequest(int argc, char** argv) const;

    [[nodiscard]] std::vector<CommandRow> table() const;
    /// The help of a command, or of the program where `command` is empty, as wide as the terminal.
    /// Errors (usage): no such command.
    [[nodiscard]] Result<std::string> help(const std::string& command, HelpDetail detail) const;
    /// What the exit codes mean: the last lines of the help.
    [[nodiscard]] std::string exitCodes() const;

  private:
    struct Entry {
        CLI::App* app = nullptr;
        Command::Body body;
        PathOptions paths;
    };
    std::unique_ptr<CLI::App> app_;
    std::deque<Entry> entries_;  // commands refer to them
};

}  // namespace stx::tools
