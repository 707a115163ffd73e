#include <algorithm>

#include <nlohmann/json.hpp>

#include "formats/any/open.hpp"
#include "formats/any/sequences.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/files/files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/images/images.hpp"
#include "formats/stx/stx.hpp"
#include "lib/base/printable.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/sheet/sheet.hpp"
#include "tools/commands.hpp"
#include "tools/peak_of_views.hpp"
#include "tools/refining.hpp"

namespace stx::tools {
namespace {

constexpr int kMomentsOfPairs = 6;  ///< that are compared, of two inputs that move

struct SheetOptions {
    std::vector<std::string> inputs;
    std::string output, size;
    std::string refine = "auto";
    std::vector<std::string> refines;  ///< --refine, where it asks for something
    SheetSettings settings;
    OpenOptions open;
};

std::string fileName(const std::string& path) {
    const std::filesystem::path p(path);
    return printable((p.has_filename() ? p : p.parent_path()).filename().string());
}

/// A picture and no bundle: an .exr may be either.
Result<bool> isPicture(const std::string& path, const Limits& limits) {
    STX_TRY(const auto kind, recognise(path));
    if (kind != FileKind::exr)
        return kind == FileKind::photo || kind == FileKind::image || kind == FileKind::unknown;
    STX_TRY(const auto reader, ExrReader::open(path, limits));
    return !isExrBundle(reader);
}

Texture textureOf(Picture picture) {
    return picture.isLinear() ? Texture(std::move(picture.linear))
                              : Texture(std::move(picture.coded));
}

Result<std::vector<SheetPair>> pairsOfPictures(const SheetOptions& o, Job& job) {
    STX_TRY(auto a, openPicture(o.inputs[0], job));
    // Both, as they are and for the sheet, and their difference.
    const bool wide = a.isLinear() || !a.fine.empty();
    STX_CHECK(checkPeak(wide ? peak::kComparedLinear : peak::kCompared, a.coded.count(), 0, 0,
                        job.limits));
    STX_TRY(auto b, openPicture(o.inputs[1], job));
    std::vector<SheetPair> pairs(1);
    SheetPair& pair = pairs[0];
    pair.title = fileName(o.inputs[0]) + " | " + fileName(o.inputs[1]);
    // The sheet shows 8 bits, and the figures are those of stx compare.
    ColourError& error = pair.error.emplace();
    STX_TRY(error.found, within(pair.title, compare(a, b, {}, job)));
    STX_TRY(error.picture,
            within(pair.title, PicturePair(a, b).errorPicture({}, ColourError::kGain)));
    pair.a = textureOf(std::move(a));
    pair.b = textureOf(std::move(b));
    return pairs;
}

/// The views of two inputs, by their numbers; of what moves at some moments.
Result<std::vector<SheetPair>> pairsOfViews(const SheetOptions& o, Job& job) {
    STX_TRY(const auto a, openSequence(o.inputs[0], o.open, job));
    STX_TRY(auto table, a->views(0, job));
    STX_CHECK(checkImagesFit(peak::kSheetOfTwo, *table, job.limits));
    auto first = wholeBundle(std::move(table), job);
    if (!first) return propagate(first);
    // Before the other one is read.
    STX_CHECK(checkPeak(peak::kSheetOfTwo, first->views, job.limits));
    STX_TRY(const auto b, openSequence(o.inputs[1], o.open, job));
    const auto count = std::min(a->timeline().count(), b->timeline().count());
    if (a->timeline().count() != b->timeline().count())
        job.note(fmt::format("one has {}, the other {}; the first {} are compared",
                             counted(a->timeline().count(), "frame"),
                             counted(b->timeline().count(), "frame"), count));
    const auto most =
        static_cast<std::size_t>(o.settings.columns > 0 ? o.settings.columns : kMomentsOfPairs);
    const std::size_t moments = std::min(count, most);
    std::vector<SheetPair> pairs;
    std::uint64_t pixels = 0;
    for (std::size_t m = 0; m < moments; ++m) {
        STX_CHECK(job.checkCancelled());
        const std::size_t frame = moments == 1 ? 0 : m * (count - 1) / (moments - 1);
        if (m > 0) first = a->frame(frame, job);
        if (!first) return propagate(first);
        STX_TRY(auto second, b->frame(frame, job));
        const auto views = std::min(first->views.size(), second.views.size());
        if (m == 0 && first->views.size() != second.views.size())
            job.note(fmt::format("one has {}, the other {}; the first {} are compared",
                                 counted(first->views.size(), "view"),
                                 counted(second.views.size(), "view"), views));
        for (std::size_t i = 0; i < views; ++i) {
            ReferenceView &va = first->views[i], &vb = second.views[i];
            SheetPair pair;
            pair.title = fmt::format("{} {}{}{}", i, printable(va.name),
                                     va.name == vb.name ? "" : " | " + printable(vb.name),
                                     moments > 1 ? fmt::format(", frame {}", frame) : "");
            pixels += static_cast<std::uint64_t>(va.camera.width) * va.camera.height +
                      static_cast<std::uint64_t>(vb.camera.width) * vb.camera.height;
            // As floats, the larger case: a colour and a depth.
            STX_CHECK(job.limits.checkAllocation(pixels, 20, "the views that are compared"));
            pair.a = std::move(va.texture);
            pair.b = std::move(vb.texture);
            pair.depthA = std::move(va.depth);
            pair.depthB = std::move(vb.depth);
            pairs.push_back(std::move(pair));
        }
    }
    return pairs;
}

Result<Sheet> sheetOfPair(const SheetOptions& o, Job& job) {
    STX_TRY(const bool first, isPicture(o.inputs[0], job.limits));
    STX_TRY(const bool second, isPicture(o.inputs[1], job.limits));
    if (first != second)
        return fail(ErrorCode::usage,
                    "'{}' is a picture and '{}' is not; two pictures or two bundles can be "
                    "compared",
                    o.inputs[first ? 0 : 1], o.inputs[first ? 1 : 0]);
    job.noteUnused(o.refines, "of one input", "two are compared as they are");
    STX_TRY(const auto pairs, first ? pairsOfPictures(o, job) : pairsOfViews(o, job));
    return sheetOf(pairs, o.settings, job);
}

Result<Sheet> sheetOfOne(const SheetOptions& o, Job& job) {
    const std::string& input = o.inputs[0];
    STX_TRY(const bool picture, isPicture(input, job.limits));
    STX_TRY(const auto kind, recognise(input));
    if (picture && kind != FileKind::photo)
        return fail(ErrorCode::invalidInput,
                    "'{}' is one picture; a sheet shows a bundle, an atlas or an image set, or "
                    "compares two pictures",
                    input);
    if (kind == FileKind::atlas) {
        job.noteUnused(o.refines, "of views", fmt::format("'{}' is shown as it is", input));
        // Of all objects, or of one.
        STX_TRY(const auto atlas,
                o.open.object.empty() ? readAtlas(input, job) : openAtlas(input, o.open, job));
        return sheetOf(atlas, o.settings, job);
    }
    STX_TRY(auto frames, openSequence(input, o.open, job));
    STX_TRY(frames, refined(std::move(frames), o.refine, peak::kSheet, folderBeside(o.output)));
    if (frames->timeline().moves()) return sheetOf(*frames, o.settings, job);
    keepFreedMemory();  // of a view, for the next one
    STX_TRY(const auto table, frames->views(0, job));
    return sheetOf(*table, o.settings, job);
}

Result<int> sheet(const SheetOptions& options, const Command& command, Program& program) {
    const Stopwatch watch;
    SheetOptions o = options;
    STX_TRY(const auto refine, refineSettings(o.refine));
    if (refine.any()) o.refines = command.given({"--refine"});
    if (o.inputs.size() > 2)
        return fail(ErrorCode::usage, "{} inputs; one, or two to compare, are expected",
                    o.inputs.size());
    if (lowerExtension(o.output) != ".png" && o.output != "-")
        return fail(ErrorCode::usage, "-o is '{}'; a sheet is a .png", o.output);
    if (!o.size.empty()) STX_SET(o.settings.mostSize, parseSize(o.size, program.job.limits));
    STX_CHECK(checkFileTarget(o.output, program));
    for (const auto& input : o.inputs) {
        preloadCodecs(input);
        o.settings.title += (o.settings.title.empty() ? "" : " | ") + fileName(input);
    }
    STX_TRY(const auto made,
            o.inputs.size() == 2 ? sheetOfPair(o, program.job) : sheetOfOne(o, program.job));
    if (made.shown < made.count)
        program.job.note(fmt::format("{} of {} fit on the sheet; a larger --size shows more",
                                     made.shown, made.count));
    const Rgb8Image& picture = made.picture;
    STX_TRY(const auto png,
            encodePng(picture.width(), picture.height(), 3, 8, picture.data(), true));
    STX_CHECK(writeFile(o.output, png, program.outputOptions()));
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format("{} → {} ({}), {}x{}, {} of {} shown, {}", o.settings.title, o.output,
                            humanBytes(png.size()), picture.width(), picture.height(), made.shown,
                            made.count, humanSeconds(seconds)));
    STX_CHECK(program.writeReport({{"$schema", "sheet-report.schema.json"},
                                   {"inputs", o.inputs},
                                   {"output", o.output},
                                   {"width", picture.width()},
                                   {"height", picture.height()},
                                   {"shown", made.shown},
                                   {"count", made.count},
                                   {"seconds", seconds}}));
    return 0;
}

}  // namespace

void addSheet(CommandLine& line, Program& program) {
    Command c = line.add(
        "sheet",
        "A contact sheet to look at: the views of a bundle with colour, depth, normals and splats; "
        "an atlas with its rectangles; frames over time; or two inputs and their error (pictures "
        "turned upright as EXIF says)\n\n"
        "  stx sheet model.mp4 -o sheet.png\n"
        "  stx sheet atlas -o atlas.png\n"
        "  stx sheet novel.png truth.png -o error.png\n"
        "  stx sheet before.exr after.mp4 -o both.png --size 4000x8000");
    auto o = std::make_shared<SheetOptions>();
    c.option("IN", o->inputs,
             "Bundle, atlas, image set or what moves; or two of them, or two pictures, to compare")
        .required();
    c.option("-o,--output", o->output, "Picture to write (.png)").required().writes("SHEET.png");
    c.option("--size", o->size, "The sheet is at most this large (default 2600x2600)").takes("WxH");
    c.option("--columns", o->settings.columns,
             "Views beside each other; of what moves: moments (default: what fills the sheet best, "
             "6 moments)")
        .range(1, 1000)
        .takes("N");
    refineOption(c, o->refine);
    c.objectOption(o->open.object);
    c.sharedOptions(program.common, kOutput | kOutside | kPictures);
    c.runs([o, c](Program& p) { return sheet(*o, c, p); });
}

}  // namespace stx::tools
