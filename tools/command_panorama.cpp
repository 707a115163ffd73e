#include <numbers>

#include <nlohmann/json.hpp>

#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/images/images.hpp"
#include "formats/panorama/panorama_files.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/panorama/panorama.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

struct PanoramaOptions {
    std::vector<std::string> inputs;
    std::string output, size, into;
    int faces = 0;
    bool noLoop = false, leaveOneOut = false;
    PanoramaSettings settings;
};

/// What is written: the equirectangular picture, or faces.
std::string shapeOf(const PanoramaOptions& o, int width) {
    const int face = o.into.empty() ? panoramaFaceSize(o.output, width, o.faces) : o.faces;
    if (face > 0) return fmt::format("6 faces {}x{}", face, face);
    return fmt::format("{}x{}", width, width / 2);
}

/// Mean of those that others show at least a tenth of, dB; 0 = none.
double meanPsnr(const std::vector<LeftOutPicture>& leftOut) {
    double sum = 0;
    int count = 0;
    for (const LeftOutPicture& one : leftOut) {
        if (one.covered < 0.1) continue;
        sum += one.psnr;
        ++count;
    }
    return count > 0 ? sum / count : 0;
}

nlohmann::ordered_json reportOf(const PanoramaOptions& o, const PanoramaAlignment& found,
                                const std::vector<LeftOutPicture>& leftOut, glm::ivec2 size,
                                const PictureSource& source, double seconds) {
    auto pictures = nlohmann::ordered_json::array();
    for (std::size_t k = 0; k < found.cameras.size(); ++k) {
        const PanoramaCamera& c = found.cameras[k];
        nlohmann::ordered_json picture{{"name", source.name(static_cast<int>(k))},
                                       {"used", c.used},
                                       {"width", c.size.x},
                                       {"height", c.size.y}};
        if (c.used) {
            const glm::dvec3 ahead = c.worldFromCamera * glm::dvec3(0, 0, -1);
            const auto& q = c.worldFromCamera;
            picture["rotation"] = {q.w, q.x, q.y, q.z};
            picture["yawDegrees"] = std::atan2(-ahead.x, -ahead.z) * kDegrees;
            picture["pitchDegrees"] = std::asin(std::clamp(ahead.y, -1.0, 1.0)) * kDegrees;
            picture["focalPixels"] = c.focal;
            picture["gain"] = {c.gain.r, c.gain.g, c.gain.b};
            if (!leftOut.empty())
                picture["leftOut"] = {{"covered", leftOut[k].covered}, {"psnr", leftOut[k].psnr}};
        }
        pictures.push_back(std::move(picture));
    }
    auto pairs = nlohmann::ordered_json::array();
    for (const PanoramaPair& p : found.pairs)
        pairs.push_back({{"a", p.a},
                         {"b", p.b},
                         {"found", p.found},
                         {"matches", p.matches},
                         {"rmsPixels", p.rms},
                         {"parallaxPixels", p.parallax}});
    nlohmann::ordered_json report{
        {"$schema", "panorama-report.schema.json"},
        {"inputs", o.inputs},
        {"output", o.output},
        {"width", size.x},
        {"height", size.y},
        {"pictures", pictures},
        {"used", found.used()},
        {"k1", found.k1},
        {"vignetting", {found.vignetting.second, found.vignetting.fourth}},
        {"rmsPixels", found.rms},
        {"pairs", pairs},
        {"closed", found.closed}};
    if (found.closed) {
        report["gapBeforeDegrees"] = found.gapBefore * kDegrees;
        report["gapDegrees"] = found.gapAfter * kDegrees;
    }
    if (!leftOut.empty()) report["leftOutPsnr"] = meanPsnr(leftOut);
    report["seconds"] = seconds;
    return report;
}

Result<int> makePanorama(const PanoramaOptions& options, const Command& command, Program& program) {
    const Stopwatch watch;
    PanoramaOptions o = options;
    const PanoramaFormat format = panoramaFormat(o.output);
    if (!o.into.empty()) {
        STX_CHECK(containerOf(o.output));
    } else if (format == PanoramaFormat::folder) {
        STX_TRY(const auto target,
                folderTarget(options.output, {},
                             "a folder, .png, .jpg, .tif, .webp, .exr, .mp4, .bt or .xmt"));
        o.output = target.path;
        // Now, not when minutes of work are done.
        if (const auto ending = std::filesystem::path(o.output).extension().string();
            !ending.empty())
            return fail(ErrorCode::usage,
                        "'{}' ends in '{}'; a panorama is written as .png, .jpg, .tif, .webp, "
                        ".exr, .mp4, .bt, .xmt, or into a folder (no ending)",
                        o.output, ending);
    }
    if (!o.into.empty()) STX_CHECK(recognise(o.into));
    if (format == PanoramaFormat::picture)
        STX_CHECK(command.refuse({"--faces"},
                                 "is of cubes: a folder, a scene or .exr; this output is "
                                 "equirectangular"));
    ComposeSettings compose;
    if (!o.size.empty()) {
        STX_TRY(const auto size, parseSize(o.size, program.job.limits));
        if (size.x != 2 * size.y)
            return fail(ErrorCode::usage,
                        "--size is {}x{}; a panorama is twice as wide as high, as 4096x2048",
                        size.x, size.y);
        compose.width = size.x;
    } else if (o.faces > 0) {
        // As dense in the middle of a face as the faces are: pi times as many pixels.
        compose.width = std::min(4 * o.faces, 2 * (program.job.limits.maxImageSide / 2));
    }
    STX_CHECK(checkTarget(o.output, program));
    const std::vector<std::filesystem::path> inputs(o.inputs.begin(), o.inputs.end());
    preloadCodecs(inputs[0]);
    STX_TRY(auto source, openPanoramaPictures(inputs, program.job));
    STX_TRY(auto found, alignPanorama(*source, o.settings, program.job));
    STX_TRY(auto panorama, composePanorama(*source, found, compose, program.job));
    std::vector<LeftOutPicture> leftOut;
    if (o.leaveOneOut) STX_SET(leftOut, leaveEachOut(*source, found, compose, program.job));
    PanoramaWriteOptions write;
    write.faceSize = o.faces;
    write.noClobber = program.common.noClobber;
    const std::string shape = shapeOf(o, panorama.width());
    const glm::ivec2 size(panorama.width(), panorama.height());
    if (o.into.empty())
        STX_CHECK(writePanorama(std::move(panorama), o.output, write, program.job));
    else
        STX_CHECK(writePanoramaInto(std::move(panorama), o.into, o.output, write, program.job));
    const double seconds = watch.seconds();
    const auto report = reportOf(o, found, leftOut, size, *source, seconds);
    const std::string pictures = counted(source->count(), "picture");
    source.reset();  // which says what its pictures lost
    program.sayNotes();
    double across = 0;
    for (const PanoramaCamera& c : found.cameras)
        if (c.used && across == 0) across = 2 * std::atan(0.5 * c.size.x / c.focal) * kDegrees;
    program.say(fmt::format(
        "{} → {} ({}), {} of {}, each {:.1f}° wide{}, within {:.2f} pixels{}, {}", pictures,
        std::filesystem::path(o.output).filename().string(), humanBytes(bytesOf(o.output)), shape,
        found.used(), across, found.closed ? ", all around" : "", found.rms,
        leftOut.empty() ? "" : fmt::format(", left out {:.1f} dB", meanPsnr(leftOut)),
        humanSeconds(seconds)));
    STX_CHECK(program.writeReport(report));
    return 0;
}

}  // namespace

void addPanorama(CommandLine& line, Program& program) {
    Command c = line.add(
        "panorama",
        "Pictures of a camera that only turned, in any order, as one picture of all that is around "
        "it\n\n"
        "  stx panorama IMG_*.jpg -o around.png                 equirectangular\n"
        "  stx panorama pictures/ -o around.exr                 linear light, for OpenEXR's users\n"
        "  stx panorama turn_%02d.jpg -o faces --faces 1024     the six faces of a cube\n"
        "  stx panorama IMG_*.jpg -o place.mp4                  a scene with a Background\n"
        "  stx panorama IMG_*.jpg --into vase.mp4 -o there.mp4  the same around an object\n"
        "  stx panorama a.jpg b.jpg c.jpg -o wide.png --fov 65 --report cameras.json");
    auto o = std::make_shared<PanoramaOptions>();
    c.option(
         "PICTURES", o->inputs,
         "Pictures that overlap by a quarter or more, a folder of numbered ones, or their names "
         "as name_%04d.jpg")
        .required();
    c.option("-o,--output", o->output,
             "Equirectangular picture (.png, .jpg, .tif, .webp), environment map of OpenEXR "
             "(.exr), MPEG-4 scene with a Background (.mp4, .bt, .xmt), or a folder for the six "
             "faces of a cube: front, back, left, right, top, bottom, as a Background has them")
        .required()
        .writes("OUT");
    c.option(
         "--fov",
         [o](const std::string& text) -> Result<void> {
             if (text == "auto") return {};
             STX_TRY(const auto degrees, parseNumbers(text, 1, "--fov"));
             if (!(degrees[0] >= 1 && degrees[0] <= 150))
                 return fail(ErrorCode::usage, "--fov is {}; auto, or 1 to 150 degrees is expected",
                             text);
             o->settings.fieldOfView = degrees[0] / kDegrees;
             return {};
         },
         "Angle across the width of the first picture; auto finds it (default auto)")
        .takes("DEG|auto");
    c.flag("--no-loop", o->noLoop,
           "The pictures do not go all around, though the last look as if they met the first");
    c.choice("--up", o->settings.up, {{"level", PanoramaUp::level}, {"first", PanoramaUp::first}},
             "level: the horizon of all together is level; first: the first picture is upright and "
             "in the middle (default level)");
    c.option("--size", o->size,
             "Of the equirectangular picture (default: as dense as the pictures, at most "
             "8192x4096)")
        .takes("WxH");
    c.option("--faces", o->faces,
             "A cube with faces of N x N pixels (default of folders and scenes: a quarter of the "
             "width of --size)")
        .range(1, 16384)
        .takes("N");
    c.option(
         "--into", o->into,
         "Bundle or film that OUT is to be, with the panorama as its environment; BUNDLE itself "
         "stays as it is")
        .reads("BUNDLE");
    c.flag("--leave-one-out", o->leaveOneOut,
           "Draws each picture again out of a panorama of the others: how near they come (dB) is "
           "told, and in the report of each");
    c.sharedOptions(program.common, kOutput | kPictures);
    c.runs([o, c](Program& p) -> Result<int> {
        o->settings.closeLoop = !o->noLoop;
        return makePanorama(*o, c, p);
    });
}

}  // namespace stx::tools
