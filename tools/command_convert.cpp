#include <chrono>

#include "formats/images/images.hpp"
#include "formats/open.hpp"
#include "lib/capture/capture.hpp"
#include "tools/batch.hpp"
#include "tools/mesh_views.hpp"
#include "tools/program.hpp"

namespace stx::tools {
namespace {

struct ConvertOptions {
    std::vector<std::string> inputs;
    std::string output;
    std::shared_ptr<MeshViewOptions> mesh = std::make_shared<MeshViewOptions>();
    std::string colour = "png";
    int quality = 92;
    bool pointTexture = false;
    OpenOptions open;
    BatchOptions batch;
};

SaveOptions saveOptions(const ConvertOptions& o, const Program& program) {
    SaveOptions save;
    save.noClobber = program.common.noClobber;
    save.jpegQuality = o.colour == "jpeg" ? o.quality : 0;
    save.pointTexture = o.pointTexture;
    return save;
}

Result<Bundle> makeBundle(const std::filesystem::path& input, const ConvertOptions& o,
                          Program& program) {
    STX_TRY(auto opened, openRenderable(input, o.open, program.job));
    if (auto* mesh = std::get_if<Mesh>(&opened)) {
        auto bundle = captureMesh(*mesh, *o.mesh, program);
        if (!bundle) return tl::unexpected(bundle.error().at(fmt::format("'{}'", input.string())));
        bundle->title = input.stem().string();
        return bundle;
    }
    auto& bundle = std::get<Bundle>(opened);
    if (o.mesh->depthBitsGiven) {
        for (auto& view : bundle.views) {
            if (view.depthBits == o.mesh->depthBits) continue;
            view.depthBits = o.mesh->depthBits;
            fitDepthRange(view);
        }
        noteDepthLoss(bundle, program.job);
    }
    return std::move(bundle);
}

Result<nlohmann::ordered_json> convertOne(const std::filesystem::path& input,
                                          const std::filesystem::path& target,
                                          const ConvertOptions& o, Program& program) {
    const auto start = std::chrono::steady_clock::now();
    STX_CHECK(checkTarget(target, program));
    STX_CHECK(containerOf(target));
    std::size_t views = 0;
    std::string sizes;
    std::int64_t points = 0;
    STX_TRY(const bool passed, convertDocument(input, target, saveOptions(o, program),
                                               o.mesh->depthBitsGiven, program.job));
    if (!passed) {
        STX_TRY(const auto bundle, makeBundle(input, o, program));
        STX_CHECK(program.job.checkCancelled());
        STX_CHECK(saveBundle(bundle, target, saveOptions(o, program), program.job));
        views = bundle.views.size();
        points = bundle.pointCount();
        sizes = fmt::format(", {} views {}x{}", views, bundle.views[0].camera.width,
                            bundle.views[0].camera.height);
    }
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    program.sayNotes();
    program.say(fmt::format("{} ({}) → {} ({}){}, {:.2g} s", input.filename().string(),
                            humanBytes(bytesOf(input)), target.filename().string(),
                            humanBytes(bytesOf(target)), sizes, seconds));
    return nlohmann::ordered_json{{"input", input.string()},  {"output", target.string()},
                                  {"status", "ok"},           {"exitCode", 0},
                                  {"views", views},           {"points", points},
                                  {"bytes", bytesOf(target)}, {"seconds", seconds}};
}

Result<int> convert(const ConvertOptions& o, Program& program) {
    STX_TRY(const auto inputs, expandInputs(o.inputs, program.job.limits));
    STX_TRY(const auto items, planBatch(inputs, o.output));
    STX_CHECK(checkMeshViewOptions(*o.mesh, program));
    STX_CHECK(containerOf(items[0].output));
    const BatchWork work = [&](const BatchItem& item, Program& p) {
        // Loading the image libraries takes 190 ms: let it happen while the model is read.
        preloadCodecs();
        return convertOne(item.input, item.output, o, p);
    };
    // One name on the command line is one conversion; a list is a batch, however short.
    if (items.size() > 1 || o.inputs[0][0] == '@') return runBatch(items, o.batch, work, program);

    std::error_code ec;
    nlohmann::ordered_json entry;
    if (o.batch.skipExisting && std::filesystem::exists(items[0].output, ec)) {
        entry = {{"input", items[0].input},
                 {"output", items[0].output},
                 {"status", "skipped"},
                 {"exitCode", 0}};
    } else {
        STX_TRY(entry, work(items[0], program));
    }
    STX_CHECK(program.writeReport({{"$schema", "convert-report.schema.json"},
                                   {"conversions", nlohmann::ordered_json::array({entry})}}));
    return 0;
}

}  // namespace

Command addConvert(CLI::App& app, Program& program) {
    auto* c = app.add_subcommand(
        "convert",
        "Mesh, image set or bundle to bundle; the output's ending picks the container\n"
        "(.mp4, .xmt, .bt: MPEG-4; .exr: OpenEXR)\n\n"
        "  stx convert model.glb -o model.mp4 --views sphere:16 --size 512x512\n"
        "  stx convert model.mp4 -o model.xmt\n"
        "  stx convert capture/transforms.json -o capture.exr\n"
        "  stx convert @list.txt -o 'out/{stem}.mp4' --jobs 4 --keep-going --skip-existing");
    auto o = std::make_shared<ConvertOptions>();
    c->add_option("IN", o->inputs, "Files or folders to convert; @FILE: those named in its lines")
        ->required();
    c->add_option("-o,--output", o->output, "What to write; {stem} stands for an input's name")
        ->required()
        ->type_name("OUT");
    addMeshViewOptions(*c, o->mesh);
    c->add_option("--texture", o->open.texture, "Texture of a mesh that names none")
        ->type_name("IMAGE")
        ->group("Views of a mesh");
    const char* coding = "Coding";
    c->add_option("--colour", o->colour, "png (exact) or jpeg, in MPEG-4 containers (default png)")
        ->check(CLI::IsMember({"png", "jpeg"}))
        ->group(coding);
    c->add_option("--quality", o->quality, "Of JPEG, 1 to 100 (default 92)")
        ->check(CLI::Range(1, 100))
        ->group(coding);
    c->add_flag("--point-texture", o->pointTexture, "Write PointTexture nodes (MPEG-4)")
        ->group(coding);
    const char* many = "Many inputs";
    c->add_option("--jobs,-j", o->batch.jobs,
                  "Inputs at a time, each in a process of its own (default 1)")
        ->check(CLI::Range(1, 1024))
        ->type_name("N")
        ->group(many);
    c->add_flag("--keep-going,-k", o->batch.keepGoing, "Go on with the others when an input fails")
        ->group(many);
    c->add_flag("--skip-existing", o->batch.skipExisting, "Pass over inputs whose output exists")
        ->group(many);
    const char* sets = "Image sets";
    c->add_option("--from", o->open.from,
                  "Kind of image set, when it cannot be told from the files")
        ->group(sets);
    c->add_option("--frame", o->open.frame, "Frame of a set that has time, from 0 (default 0)")
        ->check(CLI::NonNegativeNumber)
        ->group(sets);
    addCommonOptions(*c, program, kOutput | kOutside);
    return {c, [o](Program& p) { return convert(*o, p); }};
}

}  // namespace stx::tools
