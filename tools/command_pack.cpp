#include <chrono>
#include <cmath>

#include "formats/atlas/atlas_files.hpp"
#include "formats/images/images.hpp"
#include "formats/open.hpp"
#include "lib/packing/packing.hpp"
#include "lib/packing/prune_quality.hpp"
#include "tools/program.hpp"

namespace stx::tools {
namespace {

struct PackOptions {
    std::string input, output;
    std::string layout = "grid";
    PackSettings settings;
    bool prune = false;
    std::string budget;
    PruneSettings pruning;
    double minPsnr = 0;
    std::string colour = "png";
    int quality = 92;
};

/// "4M", "250k" or "1000000" pixels.
Result<std::int64_t> parsePixels(const std::string& text) {
    std::string number = text;
    double factor = 1;
    if (!number.empty() && (number.back() == 'M' || number.back() == 'k')) {
        factor = number.back() == 'M' ? 1e6 : 1e3;
        number.pop_back();
    }
    const auto value = parseNumbers(number, 1, "--budget");
    if (!value || (*value)[0] * factor < 1 || (*value)[0] * factor > 1e15)
        return fail(ErrorCode::usage,
                    "--budget is '{}'; a number of pixels is expected, as in 4M or 250k", text);
    return static_cast<std::int64_t>((*value)[0] * factor);
}

Result<int> packBundle(const PackOptions& o, Program& program) {
    const auto start = std::chrono::steady_clock::now();
    STX_CHECK(checkTarget(o.output, program));
    preloadCodecs(o.input);
    PruneSettings pruning = o.pruning;
    if (!o.budget.empty()) {
        STX_TRY(pruning.budget, parsePixels(o.budget));
    }
    STX_TRY(auto bundle, openBundle(o.input, {}, program.job));
    PackSettings settings = o.settings;
    std::string pruned;
    if (o.prune || pruning.budget > 0 || o.minPsnr > 0) {
        auto report = o.minPsnr > 0 ? pruneToQuality(bundle, pruning, o.minPsnr, program.job)
                                    : prune(bundle, pruning, program.job);
        if (!report) return tl::unexpected(report.error().at(fmt::format("'{}'", o.input)));
        settings.sourcePixels = report->sourcePixels;
        pruned = fmt::format(", {:.1f} % of the object's pixels kept",
                             100.0 * static_cast<double>(report->keptPixels) /
                                 static_cast<double>(report->sourcePixels));
        if (o.minPsnr > 0 && std::isfinite(report->psnr))
            pruned += fmt::format(", {:.1f} dB measured", report->psnr);
    }
    settings.layout =
        o.layout == "tight" ? PackSettings::Layout::tight : PackSettings::Layout::grid;
    auto atlas = pack(bundle, settings, program.job);
    if (!atlas) return tl::unexpected(atlas.error().at(fmt::format("'{}'", o.input)));
    STX_CHECK(program.job.checkCancelled());
    AtlasSaveOptions save;
    save.jpegQuality = o.colour == "jpeg" ? o.quality : 0;
    save.output = program.outputOptions();
    STX_CHECK(writeAtlas(*atlas, o.output, program.job, save));
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    program.sayNotes();
    program.say(fmt::format(
        "{} ({}) → {} ({}), {} views in {} textures {}x{}, {:.1f} % used{}, {:.2g} s",
        std::filesystem::path(o.input).filename().string(), humanBytes(bytesOf(o.input)), o.output,
        humanBytes(bytesOf(o.output)), atlas->views.size(), atlas->textureCount(), atlas->width(),
        atlas->height(), atlas->used() * 100, pruned, seconds));
    STX_CHECK(program.writeReport(
        {{"$schema", "pack-report.schema.json"},
         {"input", o.input},
         {"output", o.output},
         {"views", atlas->views.size()},
         {"textures", atlas->textureCount()},
         {"width", atlas->width()},
         {"height", atlas->height()},
         {"used", atlas->used()},
         {"pixels", {{"source", atlas->sourcePixels}, {"kept", atlas->keptPixels}}},
         {"seconds", seconds}}));
    return 0;
}

}  // namespace

Command addPack(CLI::App& app, Program& program) {
    auto* c = app.add_subcommand(
        "pack",
        "Merge the reference views into at most 4 textures: colour, depth, normal, splat\n\n"
        "  stx pack model.exr -o atlas           a folder: atlas.json and images\n"
        "  stx pack model.exr -o atlas.exr --layout tight");
    auto o = std::make_shared<PackOptions>();
    c->add_option("BUNDLE", o->input, "Bundle to pack")->required();
    c->add_option("-o,--output", o->output, "Folder, or one .exr file")
        ->required()
        ->type_name("ATLAS");
    c->add_option("--layout", o->layout,
                  "grid: equal cells in view order; tight: trimmed and packed (default grid)")
        ->check(CLI::IsMember({"grid", "tight"}));
    c->add_option(
         "--padding", o->settings.padding,
         "Pixels around each rectangle, filled from what surrounds it in its view; 1, 3, 7 keep "
         "mip levels 1, 2, 3 clean (default 2)")
        ->check(CLI::Range(0, 64));
    c->add_option("--max-size", o->settings.maxSize, "Largest side of a texture (default 16384)")
        ->check(CLI::Range(16, 65536));
    c->add_option("--colour", o->colour,
                  "png (exact) or jpeg, in a folder; alpha stays exact (default png)")
        ->check(CLI::IsMember({"png", "jpeg"}));
    c->add_option("--quality", o->quality, "Of JPEG (default 92)")->check(CLI::Range(1, 100));
    const char* pruning = "Pruning";
    c->add_flag("--prune", o->prune,
                "Leave out pixels that another kept view shows as well or better")
        ->group(pruning);
    c->add_option("--budget", o->budget, "Keep at most so many object pixels, as in 4M")
        ->type_name("PIXELS")
        ->group(pruning);
    c->add_option(
         "--min-psnr", o->minPsnr,
         "Prune only as far as pictures of what is kept reach this against pictures of all: RGB, "
         "the worst of up to 8, rendered from poses of the views and half way between them")
        ->type_name("DB")
        ->check(CLI::Range(0.0, 200.0))
        ->group(pruning);
    addCommonOptions(*c, program, kOutput | kOutside);
    return {c, [o](Program& p) { return packBundle(*o, p); }};
}

}  // namespace stx::tools
