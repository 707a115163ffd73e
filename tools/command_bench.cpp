#include <nlohmann/json.hpp>

#include "lib/render/bench/bench.hpp"
#include "tools/program.hpp"

namespace stx::tools {
namespace {

struct BenchCommandOptions {
    BenchSettings settings;
    int table = 0;
    std::string plot, splat = "data";
};

Result<int> bench(const BenchCommandOptions& o, Program& program) {
    BenchSettings settings = o.settings;
    settings.table1 = o.table != 2;
    settings.table2 = o.table != 1;
    settings.splat = o.splat == "paper" ? SplatRule::paper : SplatRule::data;
    STX_TRY(const auto report, runBench(settings, program.job));
    if (program.common.format == "json") {
        nlohmann::ordered_json out = {{"$schema", "bench.schema.json"}};
        out.update(nlohmann::ordered_json::parse(benchJson(report)));
        program.printJson(out);
    } else {
        program.print(benchText(report));
    }
    if (!o.plot.empty()) {
        const std::string svg = benchSvg(report);
        STX_CHECK(writeFile(o.plot, std::as_bytes(std::span(svg)), program.outputOptions()));
    }
    return 0;
}

}  // namespace

Command addBench(CLI::App& app, Program& program) {
    auto* c = app.add_subcommand("bench",
                                 "The paper's two tables on this machine: shader, conventional "
                                 "OpenGL, software, and ours\n\n"
                                 "  stx bench\n"
                                 "  stx bench --table 1 --format json --plot speed.svg");
    auto o = std::make_shared<BenchCommandOptions>();
    c->add_option("--table", o->table, "Only table 1 (synthetic views) or 2 (full frames)")
        ->check(CLI::IsMember({1, 2}));
    c->add_option("--paths", o->settings.paths,
                  "Only these paths: shader, gl, software, compute, points, surface, "
                  "surface-gpu")
        ->delimiter(',');
    c->add_option("--splat", o->splat,
                  "Rule of the splats' size: data, or paper, Lee & Park's own (default data)")
        ->check(CLI::IsMember({"data", "paper"}));
    c->add_option("--repeats", o->settings.repeats, "Frames measured for each row (default 5)")
        ->check(CLI::Range(1, 1000));
    c->add_option("--device", o->settings.device,
                  "Number of the GPU to use, see 'stx render --list-devices'");
    c->add_option("--plot", o->plot, "Draw the figures")->type_name("FILE.svg");
    addCommonOptions(*c, program, kFormat | kOutput);
    return {c, [o](Program& p) { return bench(*o, p); }};
}

}  // namespace stx::tools
