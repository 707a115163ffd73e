#include <algorithm>
#include <set>
#include <sstream>
#include <utility>

#include <nlohmann/json.hpp>

#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/files/files.hpp"
#include "formats/files/numbered.hpp"
#include "formats/images/images.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/refine/poses.hpp"
#include "lib/registration/disagreement_by_view.hpp"
#include "tools/commands.hpp"
#include "tools/refining.hpp"

namespace stx::tools {
namespace {

struct RefineOptions {
    std::string input, output;
    std::string only, with, without, object;
};

/// As --refine has it.
std::string stepsOf(const RefineOptions& o) {
    if (!o.only.empty()) return o.only;
    std::string text = "auto";
    for (const auto& [names, before] : {std::pair(o.with, ","), std::pair(o.without, ",-")})
        for (std::size_t at = 0; !names.empty() && at <= names.size();) {
            const std::size_t end = std::min(names.find(',', at), names.size());
            text += before + names.substr(at, end - at);
            at = end + 1;
        }
    return text;
}

/// Errors (usage): a step that is both asked for and left out.
Result<void> checkNoContradiction(const RefineOptions& o) {
    const auto names = [](const std::string& text) {
        std::set<std::string> found;
        std::stringstream list(text);
        for (std::string name; std::getline(list, name, ',');) found.insert(name);
        return found;
    };
    const auto with = names(o.with);
    for (const std::string& name : names(o.without))
        if (with.contains(name))
            return fail(ErrorCode::usage,
                        "--with and --without both name the step '{}'; give it to one of them",
                        name);
    return {};
}

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

/// Notes which views still do not agree with those that show the same.
Result<void> noteDisagreement(const ViewTable& table, const RefineSettings& settings, Job& job) {
    const Bundle& bundle = table.about();
    STX_TRY(const auto found, measureDepthDisagreement(table, job));
    const bool aligned = settings.on(RefineStep::poses) || posesWereAligned(bundle);
    if (const auto note = disagreementNote(bundle, found, aligned))
        job.note("after refining, " + *note);
    return {};
}

/// The views of one moment, refined. Those that are exact are read one by one, and so are those
/// that take less memory in a spool.
Result<std::unique_ptr<ViewTable>> refinedStill(std::unique_ptr<ViewTable> table,
                                                const RefineOptions& o, Refining& refining,
                                                Job& job) {
    STX_CHECK(refining.check());
    bool done = false;
    const auto refine = [&](Bundle& bundle, PixelSpool* spool, Job& own) {
        done = true;
        return refining.refine(bundle, spool, own);
    };
    STX_TRY(table, refinedViews(std::move(table), refining.left(), refine, false,
                                folderBeside(o.output), job));
    if (done) STX_CHECK(noteDisagreement(*table, refining.left(), job));
    return table;
}

/// Where nothing is left to do of the views, as is after all usual steps, that need not be found.
Result<void> saveStill(const ViewTable& table, const RefineOptions& o, SaveOptions save, Job& job) {
    if (stepsOf(o) == "auto") save.summaries = SaveOptions::Summaries::known;
    return saveViews(table, o.output, save, job);
}

Result<int> refineInput(const RefineOptions& o, const Command& command, Program& program) {
    const Stopwatch watch;
    for (const auto& [option, steps] :
         {std::pair("--only", &o.only), {"--with", &o.with}, {"--without", &o.without}})
        if (steps->empty())
            STX_CHECK(command.refuse({option}, "is empty; steps are expected, as in noise,edges"));
    if (!o.only.empty())
        STX_CHECK(
            command.refuse({"--with", "--without"}, "does not go with --only; give one of them"));
    STX_TRY(const auto settings, RefineSettings::from(stepsOf(o)));
    STX_CHECK(checkNoContradiction(o));
    const std::uint64_t inputBytes = bytesOf(o.input);  // before the output takes its place
    STX_CHECK(checkTarget(o.output, program));
    STX_CHECK(containerOf(o.output));
    preloadCodecs(o.input);
    Refining refining(settings);
    OpenOptions open;
    open.object = o.object;
    refining.import(open.set);
    STX_TRY(auto frames, openSequence(o.input, open.into(o.output), program.job));
    const Timeline timeline = frames->timeline();
    if (timeline.moves() && settings.on(RefineStep::poses))
        return fail(
            ErrorCode::usage,
            "'{}' moves, and the step 'poses' moves the cameras of one moment; leave it out",
            o.input);
    std::size_t views = 0;
    bool before = false;
    const auto lookAt = [&](const Bundle& bundle) {
        views = bundle.views.size();
        for (const ReferenceView& view : bundle.views)
            before = before || !view.refined.steps.empty();
    };
    SaveOptions save;
    save.noClobber = program.common.noClobber;
    if (timeline.count() == 1 && !frameName(o.output, 0)) {
        STX_TRY(auto table, frames->views(0, program.job));
        lookAt(std::as_const(*table).about());
        STX_TRY(table, refinedStill(std::move(table), o, refining, program.job));
        STX_CHECK(saveStill(*table, o, save, program.job));
    } else {
        bool first = true;
        frames = changedOnTheWay(std::move(frames), o.output,
                                 [&](Bundle& bundle, Job& job) -> Result<void> {
                                     lookAt(bundle);
                                     STX_CHECK(refining.refine(bundle, job));
                                     // Of a film its first frame tells.
                                     if (!std::exchange(first, false)) return {};
                                     return noteDisagreement(*viewsOf(bundle), settings, job);
                                 });
        STX_CHECK(saveSequence(*frames, o.output, save, program.job));
    }
    const RefineReport& report = refining.report();
    // What an import has just done is in the report.
    if (before && !refining.imported())
        program.job.note(report.changed()
                             ? "views were refined before: steps of then are not done again"
                             : "views that were refined before are left as they are");
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format(
        "{} ({}) → {} ({}), {}: {}, {}", std::filesystem::path(o.input).filename().string(),
        humanBytes(inputBytes), std::filesystem::path(o.output).filename().string(),
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
        "Captured views repaired: what render, pack and extract do before they draw or write, once "
        "and kept. Exact views stay as they are\n\n"
        "  stx refine capture.exr -o better.exr\n"
        "  stx refine capture.exr -o better.exr --with poses\n"
        "  stx refine film.mp4 -o better.mp4 --without colours\n\n"
        "Steps, in this order, but for poses and exposure, which come first where views are there "
        "already; * of image sets only, as they are read:\n";
    for (const RefineStepInfo& step : refineSteps())
        help += fmt::format("  {:<12}{} {} ({})\n", step.name,
                            step.when == RefineWhen::import ? '*' : ' ', step.sentence, step.usual);
    Command c = line.add("refine", help);
    auto o = std::make_shared<RefineOptions>();
    c.option("IN", o->input, "Bundle, film, atlas or image set").required();
    c.option("-o,--output", o->output, "Bundle to write (.exr, .mp4, .xmt, .bt)")
        .required()
        .replaces("OUT");
    c.option("--only", o->only, "These steps, with commas between them").takes("STEPS");
    c.option("--with", o->with, "These steps, too").takes("STEPS");
    c.option("--without", o->without, "None of these steps").takes("STEPS");
    c.objectOption(o->object);
    c.sharedOptions(program.common, kOutput | kOutside | kPictures);
    c.runs([o, c](Program& p) { return refineInput(*o, c, p); });
}

}  // namespace stx::tools
