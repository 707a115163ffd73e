#include <cmath>

#include <nlohmann/json.hpp>

#include "formats/any/open.hpp"
#include "lib/base/printable.hpp"
#include "lib/quality/ablation.hpp"
#include "lib/render/bench/bench.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

struct BenchCommandOptions {
    BenchSettings settings;
    int table = 0;
    std::vector<std::string> ablate;
    RenderSettings drawing;
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

Result<AblationSet> ablationSetOf(const std::string& input, Program& program) {
    RefineReport atImport;
    OpenOptions open;
    open.set.refined = [&atImport](const RefineReport& found) { atImport = found; };
    STX_TRY(auto opened, openRenderable(input, open, program.job));
    STX_TRY(auto set, within(fmt::format("'{}'", input),
                             std::holds_alternative<Mesh>(opened)
                                 ? AblationSet::of(std::get<Mesh>(opened), program.job)
                                 : AblationSet::of(std::move(std::get<Bundle>(opened)))));
    const std::filesystem::path path(input);
    for (const RefineStepInfo& step : refineSteps())
        if (atImport.of(step.step).views > 0) set.atImport.push_back(step.step);
    set.importWithout = [input](RefineStep step, Job& job) {
        OpenOptions without;
        without.set.refine.set(step, false);
        return openBundle(input, without, job);
    };
    set.name = (path.has_filename() ? path : path.parent_path()).stem().string();
    return set;
}

/// A table of Markdown: what each stage is worth on each set.
std::string ablationText(const std::vector<AblationSet>& sets,
                         const std::vector<AblationRow>& rows) {
    std::string text = "| left out |";
    for (const AblationSet& set : sets) text += fmt::format(" {} |", printable(set.name));
    text += "\n|---|";
    for (std::size_t i = 0; i < sets.size(); ++i) text += "---|";
    text += "\n";
    for (const AblationRow& row : rows) {
        text += fmt::format("| {} |", row.stage.empty() ? "nothing" : "`" + row.stage + "`");
        for (std::size_t i = 0; i < row.cells.size(); ++i) {
            const AblationCell &all = rows[0].cells[i], &cell = row.cells[i];
            if (row.stage.empty())
                text += fmt::format(" {:.2f} dB, {:.0f} ms |", cell.psnr, cell.milliseconds);
            else if (cell.psnr == all.psnr)
                text += fmt::format(" same, {:+.0f} % |",
                                    100 * (cell.milliseconds / all.milliseconds - 1));
            else
                text += fmt::format(" {:+.2f} dB, {:+.0f} % |", cell.psnr - all.psnr,
                                    100 * (cell.milliseconds / all.milliseconds - 1));
        }
        text += "\n";
    }
    return text;
}

Result<int> benchStages(const BenchCommandOptions& o, Program& program) {
    std::vector<AblationSet> sets;
    for (const std::string& input : o.ablate) {
        STX_TRY(auto set, ablationSetOf(input, program));
        sets.push_back(std::move(set));
    }
    STX_TRY(const auto rows, ablate(sets, o.drawing, o.settings.repeats, program.job));
    program.sayNotes();
    if (program.common.format != "json") {
        program.print(ablationText(sets, rows));
        return 0;
    }
    auto list = nlohmann::ordered_json::array();
    for (const AblationRow& row : rows)
        for (std::size_t i = 0; i < row.cells.size(); ++i)
            list.push_back({{"without", row.stage},
                            {"set", o.ablate[i]},
                            {"psnr", row.cells[i].psnr},
                            {"milliseconds", row.cells[i].milliseconds}});
    program.printJson({{"$schema", "ablation.schema.json"}, {"rows", std::move(list)}});
    return 0;
}

Result<int> bench(const BenchCommandOptions& o, const Command& command, Program& program) {
    if (!o.ablate.empty()) {
        STX_CHECK(command.refuse({"--table", "--paths", "--splat", "--device"},
                                 "does not go with --ablate"));
        return benchStages(o, program);
    }
    STX_CHECK(command.refuse({"--mode", "--quality"}, "is of --ablate"));
    BenchSettings settings = o.settings;
    settings.table1 = o.table != 2;
    settings.table2 = o.table != 1;
    STX_TRY(const auto report, runBench(settings, program.job));
    if (program.common.format == "json") {
        program.printJson(toJson(report));
    } else {
        program.print(benchText(report));
    }
    return 0;
}

}  // namespace

void addBench(CommandLine& line, Program& program) {
    Command c =
        line.add("bench",
                 "The paper's two tables on this machine: shader, conventional "
                 "OpenGL, software, and ours\n\n"
                 "  stx bench\n"
                 "  stx bench --ablate spot.obj capture.exr       what each stage is worth\n"
                 "  stx bench --table 1 --format json");
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
    c.option("--ablate", o->ablate,
             "What pictures of these lose in dB, and in time of processors, when a stage is left "
             "out: meshes (16 views of 512x512, six pictures), bundles and image sets (up to four "
             "views that the others must show)")
        .takes("IN...");
    c.choice<RenderMode>("--mode", o->drawing.mode,
                         {{"surface", RenderMode::surface}, {"splat", RenderMode::splat}},
                         "Of --ablate (default surface)");
    c.choice<Quality>("--quality", o->drawing.quality,
                      {{"normal", Quality::normal}, {"best", Quality::best}},
                      "Of --ablate (default normal)");
    c.sharedOptions(program.common, kFormat | kOutput);
    c.runs([o, c](Program& p) { return bench(*o, c, p); });
}

}  // namespace stx::tools
