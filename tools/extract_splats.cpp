#include "tools/extract_splats.hpp"

#include <algorithm>
#include <atomic>
#include <map>

#include <nlohmann/json.hpp>

#include "formats/any/sequences.hpp"
#include "formats/files/file_spool.hpp"
#include "formats/files/files.hpp"
#include "formats/files/no_case.hpp"
#include "formats/files/numbered.hpp"
#include "formats/meshes/meshes.hpp"
#include "formats/viewer/viewer_page.hpp"
#include "lib/base/stopwatch.hpp"
#include "lib/model/from_origin.hpp"
#include "lib/model/translucent.hpp"
#include "lib/model/view_table.hpp"
#include "tools/picture_times.hpp"
#include "tools/refining.hpp"
#include "tools/view_tally.hpp"

namespace stx::tools {

namespace {

/// The splats of one moment. What is known of each pixel is in a file where memory does not hold
/// it.
Result<SplatCloud> splatsOfTable(const ViewTable& table, const std::string& output,
                                 const SplatSettings& settings, Job& job) {
    const PeakMemory& takes = settings.most > 0 ? peak::kFewerSplats : peak::kSplats;
    const std::uint64_t limit = job.limits.maxMemoryBytes, inMemory = memoryOfAll(table, takes);
    std::unique_ptr<FileSpool> spool;
    const std::uint64_t spooled = memoryOfSpooledSplats(table, job.limits, settings.most);
    if (inMemory > limit && spooled <= limit) {
        STX_TRY(spool, FileSpool::create(folderBeside(output), limit / kSpoolPart));
    } else {
        std::uint64_t pixels = 0;
        for (std::size_t i = 0; i < table.count(); ++i) pixels += table.pixelsOf(i);
        // The lesser of the two is enough. Of a higher limit the spool has its part, too.
        const std::uint64_t beside = spooled - limit / kSpoolPart;
        const std::uint64_t enough = std::min(inMemory, beside + beside / (kSpoolPart - 1));
        STX_CHECK(checkPeak({takes.what, 0}, pixels, 0, enough, job.limits));
    }
    return splatsOfViews(table, settings, spool.get(), job);
}

}  // namespace

Result<std::optional<ExtractAs>> extractedAs(const std::string& as,
                                             const std::filesystem::path& file) {
    using enum ExtractAs;
    static const std::map<std::string, ExtractAs> kWords = {{"points", points},
                                                            {"splats", splats},
                                                            {"surfaces", surfaces},
                                                            {"rgbd", rgbd},
                                                            {"pair", pair}};
    // The first of each is the usual one.
    static const std::map<std::string, std::vector<const char*>> kEndings = {
        {".ply", {"points", "splats"}},   {".drc", {"points"}},       {".spz", {"splats"}},
        {".glb", {"surfaces", "splats"}}, {".png", {"pair", "rgbd"}}, {".jpg", {"pair", "rgbd"}},
        {".jpeg", {"pair", "rgbd"}}};
    const std::string ending = lowerExtension(file);
    const auto words = kEndings.find(ending);
    if (words == kEndings.end()) {
        if (as.empty()) return std::nullopt;
        return fail(ErrorCode::usage, "--as is of .ply, .spz, .drc, .glb, .png and .jpg files");
    }
    if (as.empty()) {
        // As programs that take such pictures know them.
        constexpr std::string_view kRgbd = "_rgbd";
        const std::string stem = file.stem().string();
        if (words->second[0] == std::string("pair") && stem.size() >= kRgbd.size() &&
            equalNoCase(std::string_view(stem).substr(stem.size() - kRgbd.size()), kRgbd))
            return rgbd;
        return kWords.at(words->second[0]);
    }
    if (std::ranges::find(words->second, as) != words->second.end()) return kWords.at(as);
    return fail(ErrorCode::usage, "--as {}: a {} file is written as {} here", as, ending,
                fmt::join(words->second, " or "));
}

Result<int> extractSplats(const std::string& input, const OpenOptions& open,
                          const std::string& output, const std::optional<double>& time,
                          const std::string& refine, const SplatSettings& settings,
                          Program& program) {
    const Stopwatch watch;
    STX_TRY(auto frames, openSequence(input, open, program.job));
    frames = fromOrigin(std::move(frames));
    STX_TRY(frames,
            refined(std::move(frames), refine,
                    settings.most > 0 ? peak::kFewerSplats : peak::kSplats, folderBeside(output)));
    const Timeline timeline = frames->timeline();
    const bool numbered = frameName(output, 0).has_value();
    std::size_t first = 0, end = timeline.count();
    if (!numbered || time) {
        STX_TRY(first, momentOf(time, timeline, numbered ? nullptr : "a file of splats is", input,
                                program.job));
        end = first + 1;
    } else if (timeline.moves()) {
        program.job.note("files of splats have no times: one is written for each frame");
    }
    std::size_t views = 0, splats = 0;
    ViewTally tally;
    std::atomic<bool> translucent = false;
    glm::vec3 up(0, 1, 0);
    std::vector<std::string> targets;
    OutputFiles files;
    const auto add = [&](std::size_t i) -> Result<void> {
        STX_TRY(auto table, frames->views(i, program.job));
        if (i == first) {
            views = table->count();
            noteEnvironmentLeftOut(std::as_const(*table).about().environment, program.job);
            noteMaterialLeftOut(*table, program.job);
            table = watchedViews(std::move(table), [&](auto k, auto& view) {
                tally.add(k, view);
                if (hasTranslucentInside(view.texture, view.depth)) translucent = true;
            });
        }
        STX_TRY(auto cloud, splatsOfTable(*table, output, settings, program.job));
        if (i == first) {
            splats = cloud.positions.size();
            up = cloud.up;
        }
        cloud.up = up;  // whatever the cameras of later frames do: a film is turned as one
        targets.push_back(frameName(output, static_cast<int>(i - first)).value_or(output));
        return writeSplats(targets.back(), std::move(cloud), {program.common.noClobber, &files},
                           program.job);
    };
    for (std::size_t i = first; i < end; ++i) {
        if (auto added = add(i); !added)
            return tl::unexpected(end - first > 1 ? added.error().at(timeline.nameOf(i))
                                                  : added.error());
        program.job.progress(static_cast<std::int64_t>(i - first) + 1,
                             static_cast<std::int64_t>(end - first), "writing splats");
    }
    STX_CHECK(files.commit());
    std::uint64_t bytes = 0;
    for (const std::string& target : targets) bytes += bytesOf(target);
    if (translucent)
        program.job.note("translucent surfaces are opaque or nearly so as splats, which overlap");
    const double seconds = watch.seconds();
    program.sayNotes();
    program.say(fmt::format(
        "{} ({}) → {} ({}), {}{}, {}", std::filesystem::path(input).filename().string(),
        humanBytes(bytesOf(input)), output, humanBytes(bytes), counted(splats, "splat"),
        end - first > 1 ? " in the first of " + counted(end - first, "frame") : std::string(),
        humanSeconds(seconds)));
    STX_CHECK(program.writeReport({{"$schema", "extract-report.schema.json"},
                                   {"input", input},
                                   {"output", output},
                                   {"views", views},
                                   {"points", tally.points()},
                                   {"splats", splats},
                                   {"seconds", seconds}}));
    return 0;
}

}  // namespace stx::tools
