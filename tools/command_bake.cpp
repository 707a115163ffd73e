#include <atomic>
#include <utility>

#include <nlohmann/json.hpp>

#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/images/images.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/surface/normals.hpp"
#include "tools/commands.hpp"
#include "tools/view_tally.hpp"

namespace stx::tools {
namespace {

struct BakeOptions {
    std::string input, output;
    std::string method = "robust";
    BakeSettings settings;
    OpenOptions open;
};

Result<int> bakeBundle(const BakeOptions& o, Program& program) {
    const Stopwatch watch;
    const std::uint64_t inputBytes = bytesOf(o.input);  // before the output takes its place
    STX_CHECK(checkTarget(o.output, program));
    STX_TRY(const auto container, containerOf(o.output));
    preloadCodecs(o.input);
    STX_TRY(auto frames, openSequence(o.input, o.open.into(o.output), program.job));
    BakeSettings settings = o.settings;
    settings.method =
        o.method == "paper" ? BakeSettings::Method::paper : BakeSettings::Method::robust;
    const Timeline timeline = frames->timeline();
    STX_TRY(auto change,
            bakeOfViews(settings, container == FileKind::mpeg4 ? peak::kBakeToMpeg4 : peak::kBake));
    std::atomic<bool> normals = false, ofMesh = false;
    change.change = [&normals, &ofMesh, bakes = std::exchange(change.change, {})](
                        ReferenceView& view, Job& job) -> Result<void> {
        if (view.hasNormals()) normals = true;
        // Those of a bake come with splat axes, and are of the depth already.
        if (view.hasNormals() && !view.hasSplats()) ofMesh = true;
        return bakes(view, job);
    };
    keepFreedMemory();  // of a view, for the next one
    ViewTally tally;
    frames = tallied(changedByView(std::move(frames), change), tally);
    SaveOptions save;
    save.noClobber = program.common.noClobber;
    STX_CHECK(saveSequence(*frames, o.output, save, program.job));
    if (ofMesh && !settings.keepNormals)
        program.job.note(
            "the normals that views had are replaced by those of their depth; --keep-normals keeps "
            "them");
    if (!normals && settings.keepNormals)
        program.job.note("the views have no normals; --keep-normals has nothing to keep");
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format(
        "{} ({}) → {} ({}), {} with normals and splats, {}",
        std::filesystem::path(o.input).filename().string(), humanBytes(inputBytes),
        std::filesystem::path(o.output).filename().string(), humanBytes(bytesOf(o.output)),
        counted(tally.views(), "view") +
            (timeline.moves() ? " of " + counted(timeline.count(), "frame") : std::string()),
        humanSeconds(seconds)));
    STX_CHECK(program.writeReport({{"$schema", "bake-report.schema.json"},
                                   {"input", o.input},
                                   {"output", o.output},
                                   {"method", o.method},
                                   {"views", tally.views()},
                                   {"points", tally.points()},
                                   {"seconds", seconds}}));
    return 0;
}

}  // namespace

void addBake(CommandLine& line, Program& program) {
    Command c = line.add("bake",
                         "Normals and splat axes from depth: SimpleTexture to SimpleTextureV2\n\n"
                         "  stx bake model.exr -o baked.exr");
    auto o = std::make_shared<BakeOptions>();
    c.option("BUNDLE", o->input, "Bundle to bake").required();
    c.option("-o,--output", o->output, "Bundle to write (.exr, .mp4, .xmt, .bt)")
        .required()
        .replaces("OUT");
    c.option("--method", o->method,
             "robust: local fit that respects edges and depth steps; paper: differences to "
             "the 4 neighbours (default robust)")
        .oneOf({"robust", "paper"});
    c.option("--discontinuity", o->settings.discontinuity,
             "Relative depth difference beyond the slope that parts two surfaces (default 0.01)")
        .range(1e-6, 1.0);
    c.flag("--keep-normals", o->settings.keepNormals,
           "Views that have normals keep them, as those of a mesh (stx convert --normals mesh)");
    c.objectOption(o->open.object);
    c.sharedOptions(program.common, kOutput | kOutside | kPictures);
    c.runs([o](Program& p) { return bakeBundle(*o, p); });
}

}  // namespace stx::tools
