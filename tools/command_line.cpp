#include "tools/command_line.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <sstream>

#include <CLI/CLI.hpp>

#include "lib/model/same_pictures.hpp"
#include "tools/build_text.hpp"
#include "tools/help_text.hpp"
#include "tools/output_names.hpp"
#include "tools/program.hpp"
#include "tools/standard_streams.hpp"

namespace stx::tools {
namespace {

constexpr const char* kSharedOptions = "Shared options";
constexpr const char* kHelp = "Print this help and stop";

/// What CLI11 says of a validator, "{png,jpeg}".
std::vector<std::string> choicesIn(const std::string& text) {
    std::vector<std::string> choices;
    const auto open = text.find('{'), close = text.find('}');
    if (open == std::string::npos || close == std::string::npos || close < open) return choices;
    std::stringstream list(text.substr(open + 1, close - open - 1));
    for (std::string word; std::getline(list, word, ',');) choices.push_back(word);
    return choices;
}

/// What CLI11 says of a range, "INT in [1 - 8]", "INT in [0, or 2 - 8]" or "POSITIVE", for people.
std::string rangeIn(const std::string& text) {
    const auto open = text.find("in ["), dash = text.find(" - ", open), end = text.find(']', dash);
    if (open != std::string::npos && end != std::string::npos)
        return fmt::format("{} to {}", text.substr(open + 4, dash - open - 4),
                           text.substr(dash + 3, end - dash - 3));
    if (text.find("NONNEGATIVE") != std::string::npos) return "0 or more";
    if (text.find("POSITIVE") != std::string::npos) return "above 0";
    return {};
}

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
        // What is behind a colon is CLI11's, or a part of the value: A:B[:STEP].
        const auto colon = type.find(':');
        if (colon != std::string::npos) {
            row.choices = choicesIn(type.substr(colon));
            if (row.choices.empty()) row.range = rangeIn(type.substr(colon));
        }
        row.value = row.choices.empty() && row.range.empty() ? type : type.substr(0, colon);
        if (row.value == "TEXT") row.value = "WORD";
        if (row.value == "INT" || row.value == "UINT" || row.value == "FLOAT") row.value = "N";
    }
    return row;
}

/// The command that was named, or the program itself.
const CLI::App& chosen(const CLI::App& app) {
    const CLI::App* where = &app;
    for (const auto* sub : app.get_subcommands()) where = sub;
    return *where;
}

/// Refuses numbers that are `bad`, as they were written. What is not a number is CLI11's to refuse.
CLI::Validator numberThat(const std::function<bool(double)>& bad, const std::string& expected,
                          const std::string& description) {
    return CLI::Validator(
        [=](std::string& text) {
            double value = 0;
            if (!CLI::detail::lexical_cast(text, value) || !bad(value)) return std::string();
            return fmt::format("it is {}; {}", text, expected);
        },
        description);
}

/// " (did you mean 'convert'?)" where a known word is near.
std::string meant(const std::string& word, const std::vector<std::string>& known) {
    const auto near = nearestWord(word, known);
    return near.empty() || near == word ? "" : fmt::format(" (did you mean '{}'?)", near);
}

Error unknownCommand(const std::string& name, const std::vector<std::string>& known) {
    return {ErrorCode::usage,
            fmt::format("unknown command '{}'{}. See 'stx --help'.", name, meant(name, known)),
            {}};
}

/// A value as the name of a file; of a list, @LIST, that of its own.
std::string pathOfValue(const std::string& value) {
    return value.substr(value.starts_with('@') ? 1 : 0);
}

/// What an option names.
void addNamedPaths(const CLI::Option& option, const std::string& replaces,
                   std::vector<NamedPath>& to) {
    if (option.count() == 0) return;
    const std::string name = option.get_positional() ? "" : optionRow(option).names.front();
    for (const std::string& text : option.reduced_results())
        to.push_back({name, pathOfValue(text), replaces});
}

/// Whether it stands alone and names inputs: its values are not words from a list.
bool namesInputs(const CLI::Option& option) {
    return option.get_positional() && optionRow(option).choices.empty();
}

/// Whether its values name files or folders.
bool namesPath(const CLI::Option& option, const PathOptions& paths) {
    return namesInputs(option) || std::ranges::find(paths.inputs, &option) != paths.inputs.end() ||
           std::ranges::find(paths.outputs, &option) != paths.outputs.end();
}

/// The inputs that stand alone.
std::vector<NamedPath> positionalsOf(const CLI::App& app) {
    std::vector<NamedPath> inputs;
    for (const CLI::Option* option :
         app.get_options([](const CLI::Option* o) { return namesInputs(*o); }))
        addNamedPaths(*option, "", inputs);
    return inputs;
}

/// What the options of a command name for reading.
void addInputsOf(const PathOptions& paths, std::vector<NamedPath>& to) {
    for (const auto* option : paths.inputs) addNamedPaths(*option, "", to);
}

/// What the options of a command name for writing, but for `named`, if it is not null. `only`: what
/// may be replaced.
std::vector<NamedPath> outputsOf(const PathOptions& paths, const std::string& only,
                                 const CLI::Option* named = nullptr) {
    std::vector<NamedPath> outputs;
    for (const auto* option : paths.outputs)
        if (option != named) addNamedPaths(*option, option == paths.replacing ? only : "", outputs);
    return outputs;
}

/// `app`: the command.
Result<void> checkPaths(const CLI::App& app, const std::vector<NamedPath>& inputs,
                        std::vector<NamedPath> outputs) {
    // Of several objects one is written: in the place of the input the others would be lost.
    const CLI::Option* object = app.get_option_no_throw("--object");
    if (object && object->count() > 0)
        for (NamedPath& output : outputs) output.replaces.clear();
    STX_CHECK(checkOutputNames(outputs, inputs));
    rememberInputs(inputs, outputs);
    for (const NamedPath& output : outputs) {
        if (output.option != "--report") continue;
        STX_CHECK(checkReportName(output.path));
        for (const auto& folders : {inputs, outputs})
            STX_CHECK(checkReportIsNoMainFile(output.path, folders));
        STX_CHECK(checkReportIsBeside(output.path, outputs));
    }
    return {};
}

/// Errors (usage) where the JSON that a command prints would be mixed with an output.
Result<void> checkPrintsAlone(const CLI::App& app, const std::vector<NamedPath>& outputs) {
    const CLI::Option* format = app.get_option_no_throw("--format");
    if (!format || format->count() == 0 || format->reduced_results().back() != "json") return {};
    for (const NamedPath& output : outputs)
        if (isStandardOutput(output.path))
            return fail(ErrorCode::usage,
                        "--format json is printed to standard output, and {} is '{}'; write that "
                        "to a file",
                        output.option, output.path);
    return {};
}

/// CLI11 takes the next word for the value of "--light=".
Result<void> checkValuesGiven(int argc, char** argv) {
    for (int i = 1; i < argc && std::string_view(argv[i]) != "--"; ++i) {
        const std::string_view word = argv[i];
        if (word.starts_with("--") && word.find('=') == word.size() - 1)
            return fail(ErrorCode::usage, "'{}' has no value; it is expected right behind the '='",
                        word);
    }
    return {};
}

Error usageError(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
    const CLI::App& where = chosen(app);
    std::string message = error.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    while (!message.empty() && (message.back() == ' ' || message.back() == '.')) message.pop_back();

    constexpr std::string_view kNoNumber = "Could not convert: ";
    if (const auto equals = message.find(" = ");
        message.starts_with(kNoNumber) && equals != message.npos)
        message = fmt::format("{} is '{}'; a number is expected",
                              message.substr(kNoNumber.size(), equals - kNoNumber.size()),
                              message.substr(equals + 3));

    std::vector<std::string> known;
    std::string unknown;
    if (&where == &app) {
        for (const auto* sub : app.get_subcommands([](const CLI::App*) { return true; }))
            known.push_back(sub->get_name());
        if (argc > 1 && argv[1][0] != '-') unknown = argv[1];
        if (!unknown.empty() && std::find(known.begin(), known.end(), unknown) == known.end())
            return unknownCommand(unknown, known);
        unknown.clear();
    } else if (auto rest = where.remaining(); !rest.empty()) {
        // "--" itself is known.
        const bool onlyInputs = std::erase(rest, "--") > 0;
        if (!rest.empty()) unknown = onlyInputs ? rest[0] : rest[0].substr(0, rest[0].find('='));
        for (const auto* option : where.get_options()) {
            for (const auto& name : option->get_lnames()) known.push_back("--" + name);
        }
        if (unknown.empty()) {
            // Something else is wrong, as the message says.
        } else if (onlyInputs) {
            message = fmt::format("unexpected argument '{}'; behind '--' are inputs only", unknown);
        } else {
            message = fmt::format(
                "{} '{}'", unknown.starts_with("--") ? "unknown option" : "unexpected argument",
                unknown);
        }
    }
    if (!unknown.empty()) message += meant(unknown, known);
    const std::string name = &where == &app ? "stx" : "stx " + where.get_name();
    return {ErrorCode::usage, fmt::format("{}. See '{} --help'.", message, name), {}};
}

}  // namespace

Option& Option::takes(const std::string& what) {
    option_->type_name(what);
    return *this;
}
Option& Option::reads(const std::string& what) {
    paths_->inputs.push_back(option_);
    option_->transform([](std::string text) { return inputNamed(std::move(text)); });
    return takes(what);
}
Option& Option::writes(const std::string& what) {
    paths_->outputs.push_back(option_);
    return takes(what);
}
Option& Option::replaces(const std::string& what) {
    paths_->replacing = option_;
    return writes(what);
}
Option& Option::required() {
    option_->required();
    return *this;
}
Option& Option::commaSeparated() {
    option_->delimiter(',');
    return *this;
}
Option& Option::oneOf(const std::vector<std::string>& words) {
    option_->check(CLI::IsMember(words));
    return *this;
}
Option& Option::oneOf(std::initializer_list<int> numbers) {
    option_->check(CLI::IsMember(numbers));
    return *this;
}
Option& Option::range(int least, int most) {
    return range(static_cast<double>(least), static_cast<double>(most));
}
Option& Option::range(double least, double most) {
    option_->check(numberThat([=](double v) { return v < least || v > most; },
                              fmt::format("{:.10g} to {:.10g} is possible", least, most),
                              fmt::format("in [{:.10g} - {:.10g}]", least, most)));
    return *this;
}
Option& Option::zeroOrRange(int least, int most) {
    option_->check(numberThat([=](double v) { return v != 0 && (v < least || v > most); },
                              fmt::format("0, or {} to {} is possible", least, most),
                              fmt::format("in [0, or {} - {}]", least, most)));
    return *this;
}
Option& Option::notNegative() {
    option_->check(
        numberThat([](double v) { return v < 0; }, "it must be 0 or more", "NONNEGATIVE"));
    return *this;
}
Option& Option::positive() {
    option_->check(numberThat([](double v) { return v <= 0; }, "it must be above 0", "POSITIVE"));
    return *this;
}

Command Command::under(const std::string& heading) const {
    Command command = *this;
    command.heading_ = heading;
    return command;
}

/// `lastCounts`: of an option that is given twice.
Option Command::added(CLI::Option* option, bool lastCounts) const {
    if (!heading_.empty()) option->group(heading_);
    if (lastCounts && !option->get_positional())
        option->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
    return {option, *paths_};
}

template <class Value>
requires(!std::invocable<Value&, const std::string&>) Option Command::option(
    const std::string& names, Value& to, const std::string& help) {
    constexpr bool kSeveral = std::is_same_v<Value, std::vector<std::string>>;
    CLI::Option* option = app_->add_option(names, to, help);
    if constexpr (std::is_same_v<Value, double> || std::is_same_v<Value, std::optional<double>>)
        option->check(numberThat([](double v) { return !std::isfinite(v); },
                                 "a finite number is expected", ""));
    // Positionals are names of inputs, or words among which - is none.
    if constexpr (kSeveral || std::is_same_v<Value, std::string>)
        if (option->get_positional())
            option->transform([](std::string text) { return inputNamed(std::move(text)); });
    return added(option, !kSeveral);
}
template Option Command::option(const std::string&, std::string&, const std::string&);
template Option Command::option(const std::string&, std::vector<std::string>&, const std::string&);
template Option Command::option(const std::string&, int&, const std::string&);
template Option Command::option(const std::string&, double&, const std::string&);
template Option Command::option(const std::string&, std::optional<int>&, const std::string&);
template Option Command::option(const std::string&, std::optional<double>&, const std::string&);

Option Command::option(const std::string& names,
                       std::function<Result<void>(const std::string&)> parse,
                       const std::string& help) {
    const auto take = [names, parse = std::move(parse)](const std::string& text) {
        const auto ok = parse(text);
        if (ok) return;
        // Some sentences begin with the option: its name once is enough.
        const std::string& message = ok.error().message;
        if (message.starts_with(names + " ")) throw CLI::ValidationError(message);
        throw CLI::ValidationError(names, message);
    };
    return added(app_->add_option_function<std::string>(names, take, help), true);
}
Option Command::flag(const std::string& names, bool& to, const std::string& help) {
    return added(app_->add_flag(names, to, help), false);
}
Option Command::flag(const std::string& names, int& count, const std::string& help) {
    return added(app_->add_flag(names, count, help), false);
}

void Command::sharedOptions(CommonOptions& to, unsigned which) {
    Command c = under(kSharedOptions);
    c.option("--threads", to.threads, "Threads to use; 0 = all processors").range(0, 1024);
    CLI::Option* memory =
        app_->add_option("--max-memory", to.maxMemoryMiB,
                         "Refuse inputs that would need more memory, in MiB (default 4096)");
    c.added(memory, true).range(1, 1 << 24);
    c.choice("--decoder-isolation", to.requireIsolation, {{"auto", false}, {"required", true}},
             "Decode foreign files as shut in as this kernel can, or only where it filters system "
             "calls (default auto)");
    c.flag("--quiet,-q", to.quiet, "Say nothing but errors");
    c.flag("-v,--verbose", to.verbose, "Say more");
    if (which & kOutput) {
        c.flag("--no-clobber", to.noClobber, "Refuse to replace existing files");
        c.flag("--no-mkdir", to.noMkdir, "Refuse to make folders of outputs that are not there");
        c.option("--report", to.report, "Write what was done as JSON to this file")
            .writes("FILE.json");
    }
    if (which & kFormat)
        c.option("--format", to.format, "text or json (default text)").oneOf({"text", "json"});
    if (which & kOutside)
        c.flag("--allow-outside", to.allowOutside,
               "Let names inside the input reach files outside its folder");
    if (which & kPictures)
        c.choice("--damaged", to.keepDamaged, {{"error", false}, {"keep", true}},
                 "A damaged JPEG is an error, or is drawn as far as it goes, with a note (default "
                 "error)");
}

void Command::objectOption(std::string& to) {
    option("--object", to, "Of an atlas with several objects: the one of this name").takes("NAME");
}

void Command::runs(Body body) {
    app_->set_help_flag("-h,--help", kHelp);  // again, to be listed last
    *body_ = std::move(body);
}

std::vector<std::string> Command::given(const std::vector<std::string>& names) const {
    std::vector<std::string> found;
    for (const auto& name : names)
        if (app_->count(name) > 0) found.push_back(name);
    return found;
}

std::string Command::jobOf(const std::vector<std::string>& without) const {
    std::string all;
    for (const auto* option : std::as_const(*app_).get_options()) {
        const auto names = optionRow(*option).names;
        if (option->count() == 0 || option->get_group() == kSharedOptions ||
            std::ranges::find_first_of(names, without) != names.end())
            continue;
        // A zero ends a word, as none can hold it.
        all += names.front() + '\0';
        // Of paths the name: machines may have copies in folders of their own. A slash in another
        // value is of the value (--fps 30000/1001).
        const bool path = namesPath(*option, *paths_);
        for (const std::string& value : option->results())
            all += (path ? lastName(pathOfValue(value)) : value) + '\0';
    }
    return fmt::format("{:016x}", hashOf(std::as_bytes(std::span(all))));
}

std::vector<std::string> Command::givenUnder(const std::string& heading) const {
    std::vector<std::string> found;
    for (const auto* option : std::as_const(*app_).get_options())
        if (option->get_group() == heading && option->count() > 0)
            found.push_back(option->get_name());
    return found;
}

Result<void> Command::refuse(const std::vector<std::string>& names, const std::string& why) const {
    if (const auto found = given(names); !found.empty())
        return fail(ErrorCode::usage, "{} {}", found.front(), why);
    return {};
}

std::set<std::string> Command::namesRead(const std::vector<std::string>& inputs) const {
    std::vector<NamedPath> named;
    addInputsOf(*paths_, named);
    std::set<std::string> names;
    for (const NamedPath& input : named) names.insert(lastName(input.path));
    for (const std::string& input : inputs) names.insert(lastName(input));
    return names;
}

Result<void> Command::checkNames(const std::vector<std::string>& inputs,
                                 const std::vector<NamedPath>& outputs) const {
    auto all = outputsOf(*paths_, inputs.size() == 1 ? inputs.front() : "",
                         outputs.empty() ? nullptr : paths_->replacing);
    all.insert(all.end(), outputs.begin(), outputs.end());
    auto read = alikeAmong(inputs, all);
    addInputsOf(*paths_, read);
    return checkPaths(*app_, read, std::move(all));
}

CommandLine::CommandLine()
    : app_(std::make_unique<CLI::App>(
          "The MPEG-4 AFX SimpleTexture toolkit: depth image-based representation of 3D objects.",
          "stx")) {
    app_->set_version_flag("--version,-V", "stx " STX_VERSION, "Print what stx this is, and stop");
    app_->set_help_flag("-h,--help", kHelp);
    app_->require_subcommand(1);
    app_->footer(
        "Exit codes: 0 ok, 1 usage, 2 cannot read or write a file, 3 invalid input,\n"
        "4 failed while working, 5 not supported here, 7 a difference or a broken rule.");
}

CommandLine::~CommandLine() = default;

Command CommandLine::add(const std::string& name, const std::string& help) {
    CLI::App* app = app_->add_subcommand(name, help);
    Entry& entry = entries_.emplace_back();
    entry.app = app;
    return {app, entry.body, entry.paths};
}

Result<CommandLine::Request> CommandLine::parse(int argc, char** argv) const {
    STX_CHECK(checkValuesGiven(argc, argv));
    try {
        app_->parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        const CLI::App& where = chosen(*app_);
        // A word that is not a command comes before what is asked of it.
        std::string name = argc > 1 && argv[1][0] != '-' ? argv[1] : "";
        if (&where != app_.get()) name = where.get_name();
        STX_TRY(const auto text, help(name, HelpDetail::brief));
        return Request{text, {}, {}};
    } catch (const CLI::CallForVersion&) {
        return Request{versionText(), {}, {}};
    } catch (const CLI::ParseError& e) {
        return tl::unexpected(usageError(*app_, e, argc, argv));
    }
    for (const auto& entry : entries_) {
        if (!entry.app->parsed()) continue;
        auto inputs = positionalsOf(*entry.app);
        const std::string only = inputs.size() == 1 ? inputs.front().path : "";
        addInputsOf(entry.paths, inputs);
        const auto outputs = outputsOf(entry.paths, only);
        STX_CHECK(checkPaths(*entry.app, inputs, outputs));
        STX_CHECK(checkPrintsAlone(*entry.app, outputs));
        return Request{{}, entry.body, entry.app->get_name()};
    }
    return fail(ErrorCode::usage, "no command was given. See 'stx --help'.");
}

namespace {

/// What the words beside --report may name. What -o names has that option's name.
std::vector<NamedPath> othersOf(const std::vector<std::string_view>& words) {
    std::vector<NamedPath> others;
    for (std::size_t i = 1; i < words.size(); ++i) {
        std::string_view word = words[i];
        if (word.starts_with("--report") || words[i - 1] == "--report") continue;
        const bool output = words[i - 1] == "-o" || words[i - 1] == "--output" ||
                            word.starts_with("--output=") ||
                            (word.starts_with("-o") && word.size() > 2);
        if (word.starts_with("--"))
            word.remove_prefix(std::min(word.find('='), word.size() - 1) + 1);
        else if (word.starts_with('-') || word.starts_with('@'))
            word.remove_prefix(word.starts_with('@') ? 1 : std::min<std::size_t>(2, word.size()));
        others.push_back({output ? "-o" : "", std::string(word)});
    }
    return others;
}

}  // namespace

CommandLine::FailedRequest CommandLine::failedRequest(int argc, char** argv) const {
    FailedRequest request;
    const std::vector<std::string_view> words(argv + std::min(argc, 1), argv + argc);
    const auto entry = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
        return !words.empty() && e.app->get_name() == words[0];
    });
    if (entry == entries_.end()) return request;
    request.command = entry->app->get_name();
    const bool writes = entry->app->get_option_no_throw("--report") != nullptr;
    constexpr std::string_view kReport = "--report";
    for (std::size_t i = 1; i < words.size() && words[i] != "--"; ++i) {
        const std::string_view word = words[i];
        if (word == "--no-clobber") request.noClobber = true;
        if (!writes || !word.starts_with(kReport)) continue;
        const std::string_view rest = word.substr(kReport.size());
        if (rest.starts_with('='))
            request.report = rest.substr(1);
        else if (rest.empty() && i + 1 < words.size() && !words[i + 1].starts_with('-'))
            request.report = words[++i];
    }
    const auto others = othersOf(words);
    if (!mayHoldReport(request.report, others)) request.report = {};
    return request;
}

namespace {

CommandRow rowOf(const CLI::App& app) {
    const std::string text = app.get_description();
    const auto blank = text.find("\n\n");
    CommandRow row{app.get_name(), text.substr(0, blank), {}, {}};
    if (blank != std::string::npos) row.examples = text.substr(blank + 2);
    for (const CLI::Option* option : app.get_options([](const CLI::Option*) { return true; }))
        row.options.push_back(optionRow(*option));
    return row;
}

}  // namespace

std::vector<CommandRow> CommandLine::table() const {
    std::vector<CommandRow> table;
    for (const auto& entry : entries_) table.push_back(rowOf(std::as_const(*entry.app)));
    return table;
}

Result<std::string> CommandLine::help(const std::string& command, HelpDetail detail) const {
    const auto all = table();
    if (command.empty())
        return helpOfProgram(rowOf(std::as_const(*app_)), all, exitCodes(), helpWidth());
    std::vector<std::string> names;
    for (const CommandRow& row : all) {
        if (row.name == command) return helpOf(row, detail, helpWidth());
        names.push_back(row.name);
    }
    return tl::unexpected(unknownCommand(command, names));
}

std::string CommandLine::exitCodes() const {
    return app_->get_footer();
}

}  // namespace stx::tools
