#include <cmath>

#include <nlohmann/json.hpp>

#include "lib/render/bench/bench.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

struct BenchCommandOptions {
    BenchSettings settings;
    int table = 0;
    std::string plot;
};

/// Rounded as people read them.
double thousandths(double value) {
    return std::round(value * 1000) / 1000;
}

nlohmann::ordered_json toJson(const BenchReport& report) {
    auto rows = nlohmann::ordered_json::array();
    for (const BenchRow& row : report.rows)
        rows.push_back({{"table", row.table},
                        {"references", row.references},
                        {"points", row.points},
                        {"path", row.path},
                        {"splat", row.splat},
                        {"fps", thousandths(row.fps)},
                        {"mpps", thousandths(row.mpps)}});
    return {{"$schema", "bench.schema.json"},
            {"device", report.device},
            {"processor", report.processor},
            {"threads", report.threads},
            {"rows", std::move(rows)}};
}

Result<int> bench(const BenchCommandOptions& o, Program& program) {
    BenchSettings settings = o.settings;
    settings.table1 = o.table != 2;
    settings.table2 = o.table != 1;
    STX_TRY(const auto report, runBench(settings, program.job));
    if (program.common.format == "json") {
        program.printJson(toJson(report));
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

void addBench(CommandLine& line, Program& program) {
    Command c = line.add("bench",
                         "The paper's two tables on this machine: shader, conventional "
                         "OpenGL, software, and ours\n\n"
                         "  stx bench\n"
                         "  stx bench --table 1 --format json --plot speed.svg");
    auto o = std::make_shared<BenchCommandOptions>();
    c.option("--table", o->table, "Only table 1 (synthetic views) or 2 (full frames)")
        .oneOf({1, 2});
    c.option("--paths", o->settings.paths,
             "Only these paths: shader, gl, software, compute, points, surface, "
             "surface-gpu")
        .commaSeparated();
    c.choice<SplatRule>(
        "--splat", o->settings.splat, {{"data", SplatRule::data}, {"paper", SplatRule::paper}},
        "Rule of the splats' size: data, or paper, Lee & Park's own (default data)");
    c.option("--repeats", o->settings.repeats, "Frames measured for each row (default 5)")
        .range(1, 1000);
    c.option("--device", o->settings.device,
             "Number of the GPU to use, see 'stx render --list-devices'");
    c.option("--plot", o->plot, "Draw the figures").takes("FILE.svg");
    c.sharedOptions(program.common, kFormat | kOutput);
    c.runs([o](Program& p) { return bench(*o, p); });
}

}  // namespace stx::tools
