#include <chrono>
#include <numbers>
#include <optional>

#include "formats/images/images.hpp"
#include "formats/imagesets/camera_file.hpp"
#include "formats/open.hpp"
#include "lib/capture/capture.hpp"
#include "lib/geometry/view_layout.hpp"
#include "tools/batch.hpp"
#include "tools/program.hpp"

namespace stx::tools {
namespace {

struct ConvertOptions {
    std::vector<std::string> inputs;
    std::string output;
    std::string views = "sphere:16";
    std::string size = "512x512";
    std::string projection = "perspective";
    std::optional<double> elevationDeg;
    double fovDeg = 35.0;
    int depthBits = 16;
    bool depthBitsGiven = false;
    int supersampling = 4;
    std::string normals = "none";
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

/// Cameras for a mesh: a named layout, or a camera file.
Result<std::vector<Camera>> camerasFor(const Mesh& mesh, const ConvertOptions& o,
                                       Program& program) {
    std::error_code ec;
    auto layout = parseViewLayout(o.views);
    if (!layout) {
        if (!std::filesystem::is_regular_file(o.views, ec)) return propagate(layout);
        STX_TRY(const auto named, readCameraFile(o.views, program.job));
        std::vector<Camera> cameras;
        for (const auto& n : named) cameras.push_back(n.camera);
        return cameras;
    }
    ViewFraming framing;
    STX_TRY(const auto size, parseSize(o.size, program.job.limits));
    framing.width = size.x;
    framing.height = size.y;
    // Six faces of a cube are orthographic by the standard's own example; others as asked.
    framing.orthographic = o.projection == "orthographic" ||
                           (o.projection.empty() && layout->kind == ViewLayout::Kind::cube);
    framing.fovRad = o.fovDeg * std::numbers::pi / 180.0;
    if (!(o.fovDeg > 0 && o.fovDeg < 170))
        return fail(ErrorCode::usage, "--fov is {:g}; it must be above 0 and below 170 degrees",
                    o.fovDeg);
    layout->elevationRad = o.elevationDeg.value_or(15.0) * std::numbers::pi / 180.0;

    std::vector<glm::vec3> points;
    points.reserve(mesh.positions.size());
    for (const auto& t : mesh.triangles) {
        for (int k = 0; k < 3; ++k) points.push_back(mesh.positions[t[k]]);
    }
    for (const auto p : mesh.points) points.push_back(mesh.positions[p]);
    return layoutCameras(*layout, framing, points);
}

Result<Bundle> makeBundle(const std::filesystem::path& input, const ConvertOptions& o,
                          Program& program) {
    STX_TRY(auto opened, openRenderable(input, o.open, program.job));
    if (auto* mesh = std::get_if<Mesh>(&opened)) {
        STX_TRY(const auto cameras, camerasFor(*mesh, o, program));
        CaptureSettings capture;
        capture.supersampling = o.supersampling;
        capture.depthBits = o.depthBits;
        capture.meshNormals = o.normals == "mesh";
        auto bundle = captureBundle(*mesh, cameras, capture, program.job);
        if (!bundle) return tl::unexpected(bundle.error().at(fmt::format("'{}'", input.string())));
        bundle->title = input.stem().string();
        return bundle;
    }
    auto& bundle = std::get<Bundle>(opened);
    if (o.depthBitsGiven) {
        for (auto& view : bundle.views) {
            if (view.depthBits == o.depthBits) continue;
            view.depthBits = o.depthBits;
            fitDepthRange(view);
        }
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
    STX_TRY(const bool passed,
            convertDocument(input, target, saveOptions(o, program), o.depthBitsGiven, program.job));
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
    if (o.views.rfind("auto:", 0) != 0) {
        std::error_code ec;
        if (auto layout = parseViewLayout(o.views);
            !layout && !std::filesystem::exists(o.views, ec))
            return tl::unexpected(layout.error());
    }
    STX_CHECK(parseSize(o.size, program.job.limits));
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
    const char* capture = "Views of a mesh";
    c->add_option("--views", o->views,
                  "cube, ring:N, sphere:N, octahedral:N or a camera file (default sphere:16)")
        ->group(capture);
    c->add_option("--size", o->size, "Size of each view (default 512x512)")
        ->type_name("WxH")
        ->group(capture);
    o->projection.clear();
    c->add_option("--projection", o->projection,
                  "perspective or orthographic (default perspective; cube: orthographic)")
        ->check(CLI::IsMember({"perspective", "orthographic"}))
        ->group(capture);
    c->add_option("--elevation", o->elevationDeg,
                  "Of a ring above the horizon, in degrees (default 15)")
        ->check(CLI::Range(-90.0, 90.0))
        ->type_name("DEG")
        ->group(capture);
    c->add_option("--fov", o->fovDeg,
                  "Angle that the whole object fills, in degrees: sets the distance (default 35)")
        ->type_name("DEG")
        ->group(capture);
    c->add_option("--supersampling", o->supersampling,
                  "Colour samples per pixel and axis, 1 to 8 (default 4)")
        ->check(CLI::Range(1, 8))
        ->group(capture);
    c->add_option("--normals", o->normals,
                  "mesh: keep the model's own normals (SimpleTextureV2); or none")
        ->check(CLI::IsMember({"mesh", "none"}))
        ->group(capture);
    c->add_option("--texture", o->open.texture, "Texture of a mesh that names none")
        ->type_name("IMAGE")
        ->group(capture);
    const char* coding = "Coding";
    c->add_option_function<int>(
         "--depth-bits",
         [o](const int& bits) {
             o->depthBits = bits;
             o->depthBitsGiven = true;
         },
         "8, 16 or 32 (float, .exr only); default 16")
        ->check(CLI::IsMember({8, 16, 32}))
        ->group(coding);
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
