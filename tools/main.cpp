#include <unistd.h>

#include <cstdio>

#include "lib/base/printable.hpp"
#include "tools/option_table.hpp"
#include "tools/program.hpp"
#include "tools/stop_signals.hpp"

namespace stx::tools {
namespace {

/// One line and where to read on, with the nearest known word for an unknown one.
int usageError(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
    const CLI::App* where = &app;
    for (const auto* sub : app.get_subcommands()) where = sub;
    std::string message = error.what();
    std::replace(message.begin(), message.end(), '\n', ' ');
    while (!message.empty() && (message.back() == ' ' || message.back() == '.')) message.pop_back();

    std::vector<std::string> known;
    std::string unknown;
    if (where == &app) {
        for (const auto* sub : app.get_subcommands([](const CLI::App*) { return true; }))
            known.push_back(sub->get_name());
        if (argc > 1 && argv[1][0] != '-') unknown = argv[1];
        if (!unknown.empty() && std::find(known.begin(), known.end(), unknown) == known.end())
            message = fmt::format("there is no command '{}'", unknown);
    } else if (const auto rest = where->remaining(); !rest.empty()) {
        unknown = rest[0].substr(0, rest[0].find('='));
        for (const auto* option : where->get_options()) {
            for (const auto& name : option->get_lnames()) known.push_back("--" + name);
        }
        if (unknown.rfind("--", 0) == 0)
            message = fmt::format("there is no option '{}'", unknown);
        else
            message = fmt::format("unexpected argument '{}'", unknown);
    }
    if (!unknown.empty()) {
        const auto near = nearestWord(unknown, known);
        if (!near.empty() && near != unknown) message += fmt::format(" (did you mean '{}'?)", near);
    }
    const std::string name = where == &app ? "stx" : "stx " + where->get_name();
    fmt::print(stderr, "stx: {}. See '{} --help'.\n", printable(message), name);
    return static_cast<int>(ErrorCode::usage);
}

int mainProgram(int argc, char** argv) {
    Program program;
    CLI::App app(
        "The MPEG-4 AFX SimpleTexture toolkit: depth image-based representation of 3D objects.",
        "stx");
    app.set_version_flag("--version,-V", "stx " STX_VERSION);
    app.set_help_flag("-h,--help", "Print this help and stop");
    app.require_subcommand(1);
    app.formatter(std::make_shared<HelpFormatter>());
    app.get_formatter()->column_width(34);
    app.footer(
        "Exit codes: 0 ok, 1 usage, 2 cannot read or write a file, 3 invalid input,\n"
        "4 failed while working, 5 not supported here, 7 a difference or a broken rule.");
    const std::vector<Command> commands = {
        addConvert(app, program), addSelect(app, program),    addPack(app, program),
        addBake(app, program),    addRender(app, program),    addInfo(app, program),
        addExtract(app, program), addValidate(app, program),  addCompare(app, program),
        addBench(app, program),   addCompletion(app, program)};
    for (const auto& command : commands)
        command.app->set_help_flag("-h,--help", "Print this help and stop");

    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        const CLI::App* where = &app;
        for (const auto* sub : app.get_subcommands()) where = sub;
        program.print(where->help(where == &app ? "" : "stx"));
        return 0;
    } catch (const CLI::CallForVersion&) {
        program.print("stx " STX_VERSION "\n");
        return 0;
    } catch (const CLI::ParseError& e) {
        return usageError(app, e, argc, argv);
    }

    watchStopSignals(program.job.cancelled);
    for (const auto& command : commands) {
        if (!command.app->parsed()) continue;
        const int code = program.run([&] { return command.body(program); });
        return stopSignal() != 0 ? 128 + stopSignal() : code;
    }
    return static_cast<int>(ErrorCode::usage);
}

}  // namespace
}  // namespace stx::tools

int main(int argc, char** argv) {
    const int code = stx::tools::mainProgram(argc, argv);
    // Everything is written and closed. The destructors of the image libraries would only wait for
    // their loading to end, and crash when another thread still does it.
    std::fflush(nullptr);
    _exit(code);
}
