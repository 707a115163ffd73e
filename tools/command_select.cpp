#include <algorithm>
#include <memory>
#include <numeric>

#include <nlohmann/json.hpp>

#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/images/images.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/model/some_views.hpp"
#include "lib/selection/selection.hpp"
#include "tools/commands.hpp"
#include "tools/mesh_views.hpp"

namespace stx::tools {
namespace {

struct SelectOptions {
    std::string input, output, plot;
    SelectSettings settings;
    std::optional<double> sharePercent;  ///< nothing: 95, or as the count says
    OpenOptions open;
};

/// A mesh has no views to choose from: the best ones around it are captured.
Result<int> selectAroundMesh(const Mesh& mesh, const SelectOptions& o, const Command& command,
                             Program& program) {
    const Stopwatch watch;
    STX_CHECK(command.refuse({"--share", "--density"},
                             fmt::format("is of bundles, but '{}' is a mesh", o.input)));
    if (o.settings.count == 0)
        return fail(ErrorCode::usage, "'{}' is a mesh; say how many views of it with --count N",
                    o.input);
    MeshViewOptions views;
    views.views = fmt::format("auto:{}", o.settings.count);
    views.plot = o.plot;
    Selection chosen;
    STX_TRY(auto bundle,
            within(fmt::format("'{}'", o.input), captureMesh(mesh, views, program, &chosen)));
    bundle.title = std::filesystem::path(o.input).stem().string();
    SaveOptions save;
    save.noClobber = program.common.noClobber;
    STX_CHECK(saveBundle(bundle, fileOfStill(o.output), save, program.job));
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format("{} → {}, {}, {}", std::filesystem::path(o.input).filename().string(),
                            o.output, counted(bundle.views.size(), "view"), humanSeconds(seconds)));
    std::vector<int> order(bundle.views.size());
    std::iota(order.begin(), order.end(), 0);
    STX_CHECK(program.writeReport({{"$schema", "select-report.schema.json"},
                                   {"input", o.input},
                                   {"output", o.output},
                                   {"views", order},
                                   {"of", bundle.views.size()},
                                   {"quality", chosen.quality},
                                   {"certificate", chosen.certificate},
                                   {"coverage", chosen.coverage},
                                   {"coverageOfAll", chosen.coverageOfAll},
                                   {"seconds", seconds}}));
    return 0;
}

/// Moments of a film that are looked at.
constexpr std::size_t kMoments = 8;

/// The bundle; of a film, that of the moment in which most is seen, of a few.
Result<Bundle> momentWithMost(Sequence& frames, Job& job) {
    STX_TRY(auto best, frames.frame(0, job));
    const Timeline& timeline = frames.timeline();
    const std::size_t count = std::min(timeline.count(), kMoments);
    std::int64_t most = best.pointCount();
    for (std::size_t i = 1; i < count; ++i) {
        STX_CHECK(job.checkCancelled());
        Job quiet;
        quiet.workFor(job);
        STX_TRY(auto bundle, frames.frame(i * (timeline.count() - 1) / (count - 1), quiet));
        if (bundle.pointCount() <= most) continue;
        most = bundle.pointCount();
        best = std::move(bundle);
    }
    if (timeline.moves())
        job.note(
            fmt::format("views are chosen by what they see at {:.4g} s", best.time.value_or(0)));
    return best;
}

/// Chooses among the views; those of the background, which show what no other view does, stay.
Result<Selection> selectInFront(const Bundle& bundle, const SelectSettings& settings, Job& job) {
    std::vector<int> numbers, behind;
    for (std::size_t i = 0; i < bundle.views.size(); ++i)
        (bundle.views[i].background ? behind : numbers).push_back(static_cast<int>(i));
    if (behind.empty() || numbers.empty()) return selectViews(bundle, settings, job);
    STX_TRY(auto selection, selectViews(keepViews(bundle, numbers), settings, job));
    for (int& view : selection.views) view = numbers[view];
    selection.views.insert(selection.views.end(), behind.begin(), behind.end());
    return selection;
}

/// Background views stay, whatever they see, and are rare: all views are in memory then.
bool mayGoOneByOne(const ViewTable& table) {
    return !table.whole() && std::ranges::none_of(table.about().views, &ReferenceView::background);
}

Result<int> select(const SelectOptions& o, const Command& command, Program& program) {
    const Stopwatch watch;
    STX_CHECK(checkTarget(o.output, program));
    STX_CHECK(checkPlotTarget("--plot", o.plot, program));
    STX_CHECK(containerOf(o.output));
    preloadCodecs(o.input);
    const auto kind = recognise(o.input);
    if (kind && *kind == FileKind::mesh) {
        STX_TRY(const auto opened, openRenderable(o.input, o.open, program.job));
        return selectAroundMesh(std::get<Mesh>(opened), o, command, program);
    }
    STX_TRY(auto frames, openSequence(o.input, o.open.into(o.output), program.job));
    const Timeline timeline = frames->timeline();
    if (timeline.moves() && !holdsSequences(o.output))
        return fail(
            ErrorCode::usage,
            "'{}' has {} frames, and '{}' holds one; .mp4, .xmt, .bt and a numbered name as "
            "in name_%04d.exr hold more",
            o.input, timeline.count(), o.output);
    SelectSettings settings = o.settings;
    settings.share = o.sharePercent.value_or(settings.count > 0 ? 100.0 : 95.0) / 100.0;
    SaveOptions save;
    save.noClobber = program.common.noClobber;
    Bundle bundle;
    std::unique_ptr<ViewTable> oneByOne;
    if (timeline.moves()) {
        STX_TRY(bundle, momentWithMost(*frames, program.job));
    } else {
        STX_TRY(auto table, frames->views(0, program.job));
        if (mayGoOneByOne(*table))
            oneByOne = std::move(table);
        else
            STX_SET(bundle, wholeBundle(std::move(table), program.job));
    }
    const std::size_t of = oneByOne ? oneByOne->count() : bundle.views.size();
    STX_TRY(const Selection selection, oneByOne ? selectViews(*oneByOne, settings, program.job)
                                                : selectInFront(bundle, settings, program.job));
    if (oneByOne) {
        std::vector<std::size_t> kept(selection.views.begin(), selection.views.end());
        std::ranges::sort(kept);
        STX_CHECK(saveViews(*someViewsOf(*oneByOne, std::move(kept)), fileOfStill(o.output), save,
                            program.job));
    } else if (timeline.moves()) {
        bundle = {};
        frames = changed(std::move(frames), [&](Bundle& frame, Job&) -> Result<void> {
            frame = keepViews(std::move(frame), selection.views);
            return {};
        });
        STX_CHECK(saveSequence(*frames, o.output, save, program.job));
    } else {
        bundle = keepViews(std::move(bundle), selection.views);
        STX_CHECK(saveBundle(bundle, fileOfStill(o.output), save, program.job));
    }
    if (!o.plot.empty()) {
        const std::string svg =
            selectionPlotSvg(selection, std::filesystem::path(o.input).filename().string());
        STX_CHECK(writeFile(o.plot, std::as_bytes(std::span(svg)), program.outputOptions()));
    }
    const double quality = selection.quality.empty() ? 0.0 : selection.quality.back();
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format(
        "{} → {}, {} of {} views, {:.1f} % of the quality of all, at least {:.1f} % of the best "
        "possible "
        "choice; they see {:.1f} % of the surface, all see {:.1f} %; {}",
        std::filesystem::path(o.input).filename().string(), o.output, selection.views.size(), of,
        quality * 100, selection.certificate * 100, selection.coverage * 100,
        selection.coverageOfAll * 100, humanSeconds(seconds)));
    STX_CHECK(program.writeReport({{"$schema", "select-report.schema.json"},
                                   {"input", o.input},
                                   {"output", o.output},
                                   {"views", selection.views},
                                   {"of", of},
                                   {"quality", selection.quality},
                                   {"certificate", selection.certificate},
                                   {"coverage", selection.coverage},
                                   {"coverageOfAll", selection.coverageOfAll},
                                   {"seconds", seconds}}));
    return 0;
}

}  // namespace

void addSelect(CommandLine& line, Program& program) {
    Command c = line.add("select",
                         "Keep the fewest reference views that still cover the surface\n\n"
                         "  stx select model.exr -o fewer.exr --count 12\n"
                         "  stx select model.exr -o fewer.exr --share 98 --plot quality.svg");
    auto o = std::make_shared<SelectOptions>();
    c.option("IN", o->input, "Bundle or film to choose from, or a mesh to look at from all sides")
        .required();
    c.option("-o,--output", o->output, "Bundle to write").required().replaces("OUT");
    c.option("--count", o->settings.count, "Number of views to keep; with --share at most so many")
        .range(1, 65536)
        .takes("N");
    c.option("--share", o->sharePercent,
             "Keep as many as reach this much of the quality of all views, in percent (default 95; "
             "100 with --count)")
        .range(0.1, 100.0)
        .takes("PERCENT");
    c.option("--density", o->settings.targetDensity,
             "Wanted samples per scene unit (default: what the views typically have)")
        .positive();
    c.option("--plot", o->plot, "Draw quality against the number of views").writes("FILE.svg");
    c.objectOption(o->open.object);
    c.sharedOptions(program.common, kOutput | kOutside | kPictures);
    c.runs([o, c](Program& p) { return select(*o, c, p); });
}

}  // namespace stx::tools
