#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include <nlohmann/json.hpp>

#include "formats/files/no_case.hpp"
#include "formats/files/numbered.hpp"
#include "formats/images/images.hpp"
#include "formats/stx/stx.hpp"
#include "lib/base/printable.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/metrics/immersive.hpp"
#include "lib/metrics/steadiness.hpp"
#include "lib/model/peak_memory.hpp"
#include "tools/commands.hpp"

namespace stx::tools {
namespace {

struct CompareOptions {
    std::string a, b;
    std::string mask, errorPicture, background = "black";
    double gain = 8.0;
    std::optional<double> minPsnr, minSsim;
    int firstFrame = 0;
    int frames = 0;
};

nlohmann::ordered_json number(std::optional<double> v) {
    if (!v) return nullptr;
    return *v;
}

/// All figures of a pair, or of several together.
struct Scores {
    Comparison plain;
    ImmersiveComparison immersive;
    bool codes16 = false;  ///< codes of 16 bits were compared
};

nlohmann::ordered_json toJson(const Scores& scores) {
    const Comparison& c = scores.plain;
    nlohmann::ordered_json out = {
        {"psnr", {{"rgb", number(c.psnrRgb)}, {"y", number(c.psnrY)}}},
        {"ivPsnr", number(scores.immersive.ivPsnr())},
        {"ssim", {{"y", c.ssimY}}},
        {"worst", {{"x", c.worst.x}, {"y", c.worst.y}, {"difference", c.worst.difference}}},
        {"pixels", c.pixels},
        {"differentPixels", c.differentPixels},
        {"identical", c.identical()}};
    if (scores.immersive.panoramas()) out["wsPsnr"] = {{"y", number(scores.immersive.wsPsnrY())}};
    return out;
}

Result<Scores> comparePair(const std::string& a, const std::string& b, const CompareOptions& o,
                           const Image<std::uint8_t>* mask, Steadiness* steadiness,
                           Program& program) {
    STX_TRY(const auto first, openPicture(a, program.job));
    // Both, what of the second its decoder holds, and their luma and colour differences.
    const bool wide = first.isLinear() || !first.fine.empty();
    STX_CHECK(checkPeak(wide ? peak::kComparedLinear : peak::kCompared, first.coded.count(), 0, 0,
                        program.job.limits));
    STX_TRY(const auto second, openPicture(b, program.job));
    for (const auto& [file, picture] : {std::pair{&a, &first}, {&b, &second}})
        if (picture->pictures > 1)
            return fail(ErrorCode::unsupported,
                        "'{}' holds {} pictures, and compare looks at one; 'stx extract {} -o "
                        "FOLDER' makes files of a bundle's",
                        *file, picture->pictures, *file);
    CompareSettings asked;
    asked.mask = mask;
    STX_TRY(asked.background, parseColour(o.background, "--background"));
    Scores scores;
    STX_TRY(auto result,
            within(fmt::format("'{}' and '{}'", a, b), compare(first, second, asked, program.job)));
    scores.plain = result;
    if (result.identical() && !first.others.empty())
        program.job.note(fmt::format("only colours are compared; '{}' holds {}, too", a,
                                     fmt::join(first.others, ", ")));
    const PicturePair pair(first, second);
    const CompareSettings settings = pair.settings(asked);
    const bool asFloats = pair.first();
    scores.codes16 = pair.codes16();
    if (asFloats)
        scores.immersive.add(*pair.first(), *pair.second(), settings);
    else
        scores.immersive.add(first.coded, second.coded, settings);
    if (steadiness && asFloats) steadiness->add(*pair.first(), *pair.second(), settings);
    if (steadiness && !asFloats) steadiness->add(first.coded, second.coded, settings);
    if (!o.errorPicture.empty()) {
        STX_TRY(const auto picture, pair.errorPicture(asked, o.gain));
        STX_TRY(const auto png,
                encodePng(picture.width(), picture.height(), 4, 8, picture.data(), true));
        STX_CHECK(writeFile(o.errorPicture, png, program.outputOptions()));
    }
    return scores;
}

/// Two pictures that belong together.
struct Pair {
    std::string a, b;
    int frame = -1;    ///< of a sequence
    std::string name;  ///< of folders
    [[nodiscard]] std::string errorPicture(const std::string& given) const {
        if (name.empty()) return frameName(given, frame).value_or("");
        return given.empty() ? "" : (std::filesystem::path(given) / (name + ".png")).string();
    }
};

/// The files in a folder by their names without endings.
Result<std::map<std::string, std::string>> picturesIn(const std::string& folder) {
    std::map<std::string, std::string> found;
    std::error_code ec;
    for (std::filesystem::directory_iterator it(folder, ec), end; !ec && it != end;
         it.increment(ec)) {
        if (!it->is_regular_file(ec)) continue;
        const auto stem = it->path().stem().string();
        if (const auto [other, fresh] = found.emplace(stem, it->path().string()); !fresh)
            return fail(ErrorCode::invalidInput, "'{}' and '{}' have one name; each needs its own",
                        other->second, it->path().string());
    }
    if (ec) return fail(ErrorCode::io, "cannot read the folder '{}': {}", folder, ec.message());
    return found;
}

/// Pairs by number, each named when its turn comes: as many frames as numbers can count may be
/// asked for.
struct Pairs {
    int count = 0;
    std::function<Pair(int)> at;
};

/// The pictures of two folders, which have the same names, whatever their endings.
Result<Pairs> pairsOfFolders(const CompareOptions& o) {
    STX_TRY(const auto first, picturesIn(o.a));
    STX_TRY(const auto second, picturesIn(o.b));
    for (const auto& [these, others, folder] :
         {std::tuple{&first, &second, &o.b}, {&second, &first, &o.a}})
        for (const auto& [name, file] : *these)
            if (!others->contains(name))
                return fail(ErrorCode::io, "'{}' has no partner in '{}'", file, *folder);
    std::vector<Pair> pairs;
    for (const auto& [name, file] : first) pairs.push_back({file, second.at(name), -1, name});
    if (pairs.empty())
        return fail(ErrorCode::invalidInput, "the folder '{}' has no picture in it", o.a);
    const int count = static_cast<int>(pairs.size());
    return Pairs{count, [pairs = std::move(pairs)](int i) { return pairs[i]; }};
}

/// Numbers of the frames of two sequences: the first that is asked for and all behind it that
/// either has.
std::vector<int> framesOf(const CompareOptions& o, Job& job) {
    std::set<int> frames = {o.firstFrame};
    std::vector<NumberedFile> found = {{o.firstFrame, o.a}};
    for (const std::string& pattern : {o.a, o.b}) {
        const auto files = numberedFiles(pattern);
        for (const NumberedFile& file : files.value_or(std::vector<NumberedFile>()))
            if (file.number >= o.firstFrame && file.number <= std::numeric_limits<int>::max() &&
                frames.insert(static_cast<int>(file.number)).second)
                found.push_back(file);
    }
    std::ranges::sort(found, {}, &NumberedFile::number);
    if (const auto missing = firstMissing(found))
        job.note(fmt::format("frame {} is in neither sequence; those that are there are compared",
                             *missing));
    return {frames.begin(), frames.end()};
}

/// The frames of two sequences: as many as are asked for, else framesOf().
Result<Pairs> pairsOfSequences(const CompareOptions& o, Job& job) {
    const auto pairOf = [a = o.a, b = o.b](int frame) {
        return Pair{*frameName(a, frame), *frameName(b, frame), frame, ""};
    };
    if (o.frames == 0) {
        const auto frames = framesOf(o, job);
        return Pairs{static_cast<int>(frames.size()), [=](int i) { return pairOf(frames[i]); }};
    }
    constexpr std::int64_t kMost = std::numeric_limits<int>::max();
    const std::int64_t last = std::int64_t{o.firstFrame} + o.frames - 1;
    if (last > kMost)
        return fail(ErrorCode::usage,
                    "--frames {} from frame {} on end at frame {}; frames are numbered up to {}",
                    o.frames, o.firstFrame, last, kMost);
    return Pairs{o.frames, [=, first = o.firstFrame](int i) { return pairOf(first + i); }};
}

std::string decibels(std::optional<double> v) {
    return v ? fmt::format("{:.2f} dB", *v) : std::string("identical");
}

/// "PSNR 40.00 dB (Y 41.00 dB), …", or that there is no difference.
std::string scoresOf(const Scores& scores, const std::string& worstOf) {
    const Comparison& c = scores.plain;
    if (c.identical()) return "identical";
    const auto ws = scores.immersive.wsPsnrY();
    return fmt::format(
        "PSNR {} (Y {}), IV-PSNR {}{}, SSIM {:.4f}, worst pixel ({}, {}){} differs by {:g}, {} of "
        "{} pixels "
        "differ",
        decibels(c.psnrRgb), decibels(c.psnrY), decibels(scores.immersive.ivPsnr()),
        ws ? ", WS-PSNR " + decibels(ws) : "", c.ssimY, c.worst.x, c.worst.y, worstOf,
        c.worst.difference, c.differentPixels, c.pixels);
}

Result<std::optional<Image<std::uint8_t>>> openMask(const CompareOptions& o, Program& program) {
    if (o.mask.empty()) return std::nullopt;
    STX_TRY(const auto loaded, openPicture(o.mask, program.job));
    if (loaded.isLinear())
        return fail(ErrorCode::usage, "--mask '{}' must be an image of 8 or 16 bits", o.mask);
    std::string note;
    auto mask = loaded.fine.empty() ? maskFrom(loaded.coded, note) : maskFrom(loaded.fine, note);
    if (!note.empty()) program.job.note(note);
    return mask;
}

/// All pairs of two folders or two sequences.
struct ManyScores {
    Scores total;
    nlohmann::ordered_json perPair = nlohmann::ordered_json::array();
    Pair worst;
    Steadiness steadiness;  ///< of sequences
    int worstStep = 0;      ///< the frame that its largest change leads to
};

Result<ManyScores> compareMany(const CompareOptions& o, bool folders,
                               const Image<std::uint8_t>* mask, Program& program) {
    ManyScores many;
    STX_TRY(const Pairs pairs, folders ? pairsOfFolders(o) : pairsOfSequences(o, program.job));
    SequenceComparison sequence;
    for (int i = 0; i < pairs.count; ++i) {
        const Pair pair = pairs.at(i);
        STX_CHECK(program.job.checkCancelled());
        CompareOptions one = o;
        one.errorPicture = pair.errorPicture(o.errorPicture);
        if (!one.errorPicture.empty()) STX_CHECK(checkTarget(one.errorPicture, program));
        STX_TRY(const auto c, comparePair(pair.a, pair.b, one, mask,
                                          folders ? nullptr : &many.steadiness, program));
        sequence.add(c.plain);
        if (sequence.frames() == 1) many.total.codes16 = c.codes16;
        many.total.immersive.add(c.immersive);
        auto entry = toJson(c);
        if (folders)
            entry["name"] = pair.name;
        else
            entry["frame"] = pair.frame;
        many.perPair.push_back(std::move(entry));
        if (folders && program.common.format != "json")
            program.print(printable(pair.name) + ": " + scoresOf(c, "") + "\n");
    }
    many.total.plain = sequence.total();
    many.worst = pairs.at(sequence.worstFrame());
    many.worstStep = pairs.at(many.steadiness.worstFrame()).frame;
    return many;
}

/// 0 where the pictures are the same or near enough to what was asked for.
int exitCodeOf(const Scores& total, const CompareOptions& o) {
    if (total.plain.identical()) return 0;
    const auto psnr = total.plain.psnrRgb;
    const bool near = !o.minPsnr || (psnr && *psnr >= *o.minPsnr);
    const bool alike = !o.minSsim || total.plain.ssimY >= *o.minSsim;
    if ((o.minPsnr || o.minSsim) && near && alike) return 0;
    return static_cast<int>(ErrorCode::difference);
}

Result<int> compareImages(const CompareOptions& o, const Command& command, Program& program) {
    const bool sequences = frameName(o.a, 0) && frameName(o.b, 0);
    std::error_code ec;
    const bool folders =
        std::filesystem::is_directory(o.a, ec) || std::filesystem::is_directory(o.b, ec);
    if (!sequences)
        STX_CHECK(command.refuse({"--first-frame", "--frames"},
                                 "is of sequences, named as in a_%04d.png"));
    if (o.errorPicture.empty())
        STX_CHECK(command.refuse({"--gain"}, "is of the error picture; give --error-picture, too"));
    if (sequences && !folders && !o.errorPicture.empty() && !frameName(o.errorPicture, 0))
        return fail(ErrorCode::usage,
                    "--error-picture is '{}', one file for all frames; a numbered name is "
                    "expected, as in 'error_%04d.png'",
                    o.errorPicture);
    if (!folders && !o.errorPicture.empty() && lowerExtension(o.errorPicture) != ".png")
        return fail(ErrorCode::usage, "--error-picture is '{}'; its name must end in .png",
                    o.errorPicture);
    STX_TRY(const auto mask, openMask(o, program));
    const auto* maskImage = mask ? &*mask : nullptr;

    ManyScores many;
    std::string worstOf;
    nlohmann::ordered_json out = {{"$schema", "compare.schema.json"}};
    if (sequences || folders) {
        STX_TRY(many, compareMany(o, folders, maskImage, program));
        worstOf = folders ? " of '" + printable(many.worst.name) + "'"
                          : fmt::format(" of frame {}", many.worst.frame);
        out.update(toJson(many.total));
        if (!folders) out["worst"]["frame"] = many.worst.frame;
        out[folders ? "pairs" : "frames"] = many.perPair;
    } else {
        STX_TRY(many.total, comparePair(o.a, o.b, o, maskImage, nullptr, program));
        out.update(toJson(many.total));
    }
    const Steadiness& steadiness = many.steadiness;
    const auto inValues = [&](double v) { return many.total.codes16 ? inCodes16(v) : v; };
    if (steadiness.steps() > 0)
        out["unsteadiness"] = {
            {"mean", inValues(steadiness.mean())},
            {"worst", inValues(steadiness.worst())},
            {"worstFrame", many.worstStep},
        };
    STX_CHECK(program.writeReport(out));
    if (program.common.format == "json") {
        program.printJson(out);
    } else {
        program.print((folders ? "all: " : "") + scoresOf(many.total, worstOf) + "\n");
        if (steadiness.steps() > 0)
            program.print(fmt::format(
                "changes from frame to frame: {:.3f} beyond those of B, {:.3f} at worst (frame "
                "{})\n",
                inValues(steadiness.mean()), inValues(steadiness.worst()), many.worstStep));
    }
    return exitCodeOf(many.total, o);
}

}  // namespace

void addCompare(CommandLine& line, Program& program) {
    Command c =
        line.add("compare",
                 "PSNR, IV-PSNR, SSIM and the worst pixel of two images, sequences or folders; "
                 "exit code 7 when they differ; by their colours, of 16 bits to their last, turned "
                 "upright as EXIF says\n\n"
                 "  stx compare novel.png truth.png --error-picture error.png\n"
                 "  stx compare a_%04d.png b_%04d.png --format json --min-psnr 40\n"
                 "  stx compare drawn/ truth/ --error-picture errors/   all by their names");
    auto o = std::make_shared<CompareOptions>();
    c.option("A", o->a, "Image, sequence as name_%04d.png, or folder").required();
    c.option("B", o->b, "The same").required();
    c.option("--mask", o->mask,
             "Image; only pixels count whose luma times alpha is at least half of white in it, or, "
             "where it has one value beside 0, that have this one")
        .reads("IMAGE");
    c.option("--error-picture", o->errorPicture,
             "Write where they differ as a PNG, of folders into one")
        .writes("FILE.png");
    c.option("--gain", o->gain, "Of the error picture (default 8)").range(0.001, 1e6);
    c.option(
         "--background", o->background,
         "Colour behind transparent pixels: values of 0 to 1, #rrggbb or a name (default black)")
        .takes("COLOUR");
    c.option("--min-psnr", o->minPsnr, "Exit code 0 when the PSNR of RGB is at least this")
        .takes("DB");
    c.option("--min-ssim", o->minSsim,
             "Exit code 0 when the SSIM of Y is at least this (with --min-psnr: when both are)")
        .range(-1.0, 1.0)
        .takes("SSIM");
    c.option("--first-frame", o->firstFrame, "First frame of sequences (default 0)").notNegative();
    c.option("--frames", o->frames, "Number of frames (default: all that exist)").positive();
    c.sharedOptions(program.common, kFormat | kOutput | kPictures);
    c.runs([o, c](Program& p) { return compareImages(*o, c, p); });
}

}  // namespace stx::tools
