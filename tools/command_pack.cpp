#include <chrono>

#include "formats/atlas/atlas_files.hpp"
#include "formats/images/images.hpp"
#include "formats/open.hpp"
#include "lib/packing/packing.hpp"
#include "tools/program.hpp"

namespace stx::tools {
namespace {

struct PackOptions {
    std::string input, output;
    std::string layout = "grid";
    PackSettings settings;
};

Result<int> packBundle(const PackOptions& o, Program& program) {
    const auto start = std::chrono::steady_clock::now();
    STX_CHECK(checkTarget(o.output, program));
    preloadCodecs();
    STX_TRY(const auto bundle, openBundle(o.input, {}, program.job));
    PackSettings settings = o.settings;
    settings.layout =
        o.layout == "tight" ? PackSettings::Layout::tight : PackSettings::Layout::grid;
    auto atlas = pack(bundle, settings, program.job);
    if (!atlas) return tl::unexpected(atlas.error().at(fmt::format("'{}'", o.input)));
    STX_CHECK(program.job.checkCancelled());
    STX_CHECK(writeAtlas(*atlas, o.output, program.job, program.outputOptions()));
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    program.sayNotes();
    program.say(fmt::format(
        "{} ({}) → {} ({}), {} views in {} textures {}x{}, {:.1f} % used, {:.2g} s",
        std::filesystem::path(o.input).filename().string(), humanBytes(bytesOf(o.input)), o.output,
        humanBytes(bytesOf(o.output)), atlas->views.size(), atlas->textureCount(), atlas->width(),
        atlas->height(), atlas->used() * 100, seconds));
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
    c->add_option("--padding", o->settings.padding,
                  "Pixels around each rectangle, filled from its edge (default 2)")
        ->check(CLI::Range(0, 64));
    c->add_option("--max-size", o->settings.maxSize, "Largest side of a texture (default 16384)")
        ->check(CLI::Range(16, 65536));
    addCommonOptions(*c, program, kOutput | kOutside);
    return {c, [o](Program& p) { return packBundle(*o, p); }};
}

}  // namespace stx::tools
