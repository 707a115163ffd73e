#include <nlohmann/json.hpp>

#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/images/images.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/refine/refine.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

struct RefineOptions {
    std::string input, output;
    std::string only, without;
};

nlohmann::ordered_json stepsJson(const RefineReport& report) {
    auto steps = nlohmann::ordered_json::array();
    for (const RefineStepInfo& info : refineSteps()) {
        const RefineStepReport& s = report.of(info.step);
        steps.push_back({{"name", info.name},
                         {"views", s.views},
                         {"pixels", s.pixels},
                         {"moved", s.moved},
                         {"meanMove", s.meanMove},
                         {"milliseconds", s.milliseconds}});
    }
    return steps;
}

Result<int> refineInput(const RefineOptions& o, const Command& command, Program& program) {
    const Stopwatch watch;
    if (!o.only.empty())
        STX_CHECK(command.refuse({"--without"}, "does not go with --only; give one of them"));
    STX_TRY(const auto settings, o.only.empty() && o.without.empty() ? RefineSettings()
                                 : o.only.empty() ? RefineSettings::without(o.without)
                                                  : RefineSettings::from(o.only));
    STX_CHECK(checkTarget(o.output, program));
    STX_CHECK(containerOf(o.output));
    preloadCodecs(o.input);
    STX_TRY(auto frames, openSequence(o.input, {}, program.job));
    const Timeline timeline = frames->timeline();
    RefineReport report;
    std::size_t views = 0, seen = 0;
    bool before = false;
    frames = changed(std::move(frames), [&](Bundle& bundle, Job& job) -> Result<void> {
        std::uint64_t pixels = 0;
        for (const ReferenceView& view : bundle.views) {
            before = before || !view.refined.steps.empty();
            pixels += static_cast<std::uint64_t>(view.camera.width) * view.camera.height;
        }
        // The views as they were and as they become, and their pictures while they are packed.
        STX_CHECK(job.limits.checkAllocation(pixels, 24, "refining"));
        STX_TRY(const auto found, refine(bundle, settings, job));
        // Some containers are written in two passes.
        if (seen++ < timeline.count()) report.add(found);
        views = bundle.views.size();
        return {};
    });
    SaveOptions save;
    save.noClobber = program.common.noClobber;
    STX_CHECK(saveSequence(*frames, o.output, save, program.job));
    if (before) program.job.note("views that were refined before are left as they are");
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format(
        "{} ({}) → {} ({}), {}: {}, {}", std::filesystem::path(o.input).filename().string(),
        humanBytes(bytesOf(o.input)), std::filesystem::path(o.output).filename().string(),
        humanBytes(bytesOf(o.output)),
        counted(views, "view") +
            (timeline.moves() ? " of " + counted(timeline.count(), "frame") : std::string()),
        report.changed() ? report.text() : "nothing to refine", humanSeconds(seconds)));
    STX_CHECK(program.writeReport({{"$schema", "refine-report.schema.json"},
                                   {"input", o.input},
                                   {"output", o.output},
                                   {"views", views},
                                   {"frames", timeline.count()},
                                   {"noise", report.noise},
                                   {"ownColour", report.ownColour},
                                   {"steps", stepsJson(report)},
                                   {"seconds", seconds}}));
    return 0;
}

}  // namespace

void addRefine(CommandLine& line, Program& program) {
    std::string help =
        "Captured depth repaired: what render, pack and extract do before they draw or write, once "
        "and kept. Exact depth stays as it is\n\n"
        "  stx refine capture.exr -o better.exr\n"
        "  stx refine film.mp4 -o better.mp4 --without colours\n\nSteps, in this order:\n";
    for (const RefineStepInfo& step : refineSteps())
        help += fmt::format("  {:<12}{}\n", step.name, step.sentence);
    Command c = line.add("refine", help);
    auto o = std::make_shared<RefineOptions>();
    c.option("IN", o->input, "Bundle, film, atlas or image set").required();
    c.option("-o,--output", o->output, "Bundle to write (.exr, .mp4, .xmt, .bt)")
        .required()
        .takes("OUT");
    c.option("--only", o->only, "These steps, with commas between them").takes("STEPS");
    c.option("--without", o->without, "All but these steps and strays").takes("STEPS");
    c.sharedOptions(program.common, kOutput | kOutside | kPictures);
    c.runs([o, c](Program& p) { return refineInput(*o, c, p); });
}

}  // namespace stx::tools
