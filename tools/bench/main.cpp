// stx-bench: the tables of `stx bench` for people, and a check of GPUs, for machines that have no
// image or mesh library.
#include <cstdio>

#include <CLI/CLI.hpp>

#include "lib/base/parallel.hpp"
#include "lib/render/bench/bench.hpp"
#include "lib/render/factory.hpp"
#include "tools/bench/check.hpp"

namespace {

int report(const stx::Error& error) {
    fmt::print(stderr, "stx-bench: {}\n", error.text());
    return static_cast<int>(error.code);
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"Measures Lee & Park's two tables on this machine.", "stx-bench"};
    stx::BenchSettings settings;
    int table = 0, threads = 0;
    std::string splat = "data";
    bool devices = false, check = false;
    app.set_version_flag("--version", STX_VERSION);
    app.add_option("--table", table, "1 or 2; both by default")->check(CLI::Range(1, 2));
    app.add_option("--path", settings.paths,
                   "only these: shader, gl, software, compute, points, surface, "
                   "surface-gpu");
    app.add_option("--splat", splat, "rule of the splats' size: data or paper")
        ->check(CLI::IsMember({"data", "paper"}));
    app.add_option("--repeats", settings.repeats, "frames measured for each row")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    app.add_option("--device", settings.device, "one of --list-devices; the best by default")
        ->check(CLI::Range(0, 1023));
    app.add_option("--threads", threads, "0 = all processors")->check(CLI::Range(0, 4096));
    app.add_flag("--check", check,
                 "draws by every mode and pipeline on every GPU and compares with the processor's "
                 "pictures; 7 when one is unlike it");
    app.add_flag("--list-devices", devices, "lists the GPUs and ends");
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp& e) {
        return app.exit(e);
    } catch (const CLI::CallForVersion& e) {
        return app.exit(e);
    } catch (const CLI::ParseError& e) {
        fmt::print(stderr, "stx-bench: {}\nSee 'stx-bench --help'.\n", e.what());
        return static_cast<int>(stx::ErrorCode::usage);
    }
    const stx::ThreadLimit limit(threads);
    stx::Job job;
    if (devices) {
        for (const auto& d : stx::listDevices(job))
            fmt::print("{}  {}  {}  {}{}  textures up to {}\n", d.index, d.name, d.version,
                       d.platform, d.software ? "  software" : "", d.maxTextureSize);
        for (const auto& note : job.takeNotes()) fmt::print(stderr, "stx-bench: {}\n", note);
        return 0;
    }
    if (check) {
        const auto print = [](std::string_view text) {
            fmt::print("{}", text);
            std::fflush(stdout);
        };
        const auto checked = stx::checkGpus({settings.device, print}, job);
        for (const auto& note : job.takeNotes()) fmt::print(stderr, "stx-bench: {}\n", note);
        if (!checked) return report(checked.error());
        fmt::print("{} pictures compared, {} unlike the processor's, {} ways not here\n",
                   checked->drawn, checked->wrong, checked->refused);
        return checked->wrong == 0 ? 0 : static_cast<int>(stx::ErrorCode::difference);
    }
    settings.splat = splat == "paper" ? stx::SplatRule::paper : stx::SplatRule::data;
    settings.table1 = table != 2;
    settings.table2 = table != 1;
    const auto result = stx::runBench(settings, job);
    for (const auto& note : job.takeNotes()) fmt::print(stderr, "stx-bench: {}\n", note);
    if (!result) return report(result.error());
    fmt::print("{}", stx::benchText(*result));
    return 0;
}
