#include <malloc.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "formats/files/named_files.hpp"
#include "lib/base/parallel.hpp"
#include "tools/commands.hpp"
#include "tools/standard_streams.hpp"
#include "tools/stop_signals.hpp"

namespace stx::tools {
namespace {

int mainProgram(int argc, char** argv) {
    Program program;
    CommandLine line;
    // In the order of the help.
    for (const auto add : {addConvert, addSelect, addPack, addBake, addRefine, addBackground,
                           addPanorama, addRender, addInfo, addSheet, addExtract, addValidate,
                           addCompare, addBench, addReport, addDoctor, addHelp, addCompletion})
        add(line, program);
    const auto request = line.parse(argc, argv);
    if (!request) {
        // What was parsed before the mistake does not count, but for the report of it.
        const auto failed = line.failedRequest(argc, argv);
        program.command = failed.command;
        program.common = {};
        program.common.noClobber = failed.noClobber;
        // The mistake is reported even where its report has no place.
        if (!failed.report.empty() && checkFileTarget(failed.report, program))
            program.common.report = failed.report;
        return program.run([&]() -> Result<int> { return tl::unexpected(request.error()); });
    }
    if (!request->body)
        return program.run([&]() -> Result<int> {
            program.print(request->text);
            return 0;
        });
    program.command = request->command;
    // A machine that gives no thread for this gives none for the work. The limit stays to the end:
    // TBB would start threads when it goes.
    if (!watchStopSignals(program.job.cancelled)) {
        program.common.threads = 1;
        [[maybe_unused]] static const auto* const one = new ThreadLimit(1);
    }
    const int code = program.run([&] { return request->body(program); });
    return stopSignal() != 0 ? 128 + stopSignal() : code;
}

}  // namespace
}  // namespace stx::tools

int main(int argc, char** argv) {
    // Else the first large image that is freed raises the limit, and from then on the memory of
    // images stays with the program: a fifth of its peak when it draws.
    mallopt(M_MMAP_THRESHOLD, 256 << 10);
    stx::tools::openClosedStreams();
    stx::guardNamedFiles();
    // A reader that went away is an error of writing, not the end.
    std::signal(SIGPIPE, SIG_IGN);
    const int code = stx::tools::mainProgram(argc, argv);
    // Everything is written and closed. The destructors of the image libraries would only wait for
    // their loading to end, and crash when another thread still does it.
    std::fflush(nullptr);
    _exit(code);
}
