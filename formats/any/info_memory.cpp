#include "formats/any/info_memory.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "lib/base/counted.hpp"
#include "lib/base/parallel.hpp"
#include "lib/packing/views_one_by_one.hpp"
#include "lib/quality/prune_quality.hpp"
#include "lib/refine/refine_needed.hpp"
#include "lib/render/drawing_memory.hpp"
#include "lib/render/surface/view_surfaces.hpp"
#include "lib/sheet/sheet.hpp"
#include "lib/splats/from_bundle.hpp"

namespace stx {
namespace {

/// What a command does with views.
struct ViewCommand {
    const char* words;
    const PeakMemory* takes;
    const PeakMemory* takesWithVectors;  ///< where views have normals or splats
    enum class Looks {
        atEach,       ///< one at a time, where they come on demand
        atRefined,    ///< the same; where they are refined before, from a spool if that takes less
        onSheet,      ///< the same, beside the sheet
        whilePacked,  ///< the same, beside the atlas
        whilePruned,  ///< the same, after pictures of all
        whileRefined,
        atSurfaces,  ///< at all, where the limit allows it; else at one at a time, from a spool
        atDiscs,     ///< the same
        atGroups,    ///< at all, where the limit allows it; else at as many as it has room for
        whileDrawn,  ///< at all; from a spool where they take more than a picture needs of them
    } looks;
};

constexpr PeakMemory kNothingMore = {"reading", 0};
using enum ViewCommand::Looks;
constexpr ViewCommand kCommands[] = {
    {"convert -o NAME.exr", &kNothingMore, &kNothingMore, atEach},
    {"convert -o NAME.mp4", &peak::kMpeg4, &peak::kMpeg4Vectors, atEach},
    {"bake -o NAME.exr", &peak::kBake, &peak::kBake, atEach},
    {"bake -o NAME.mp4", &peak::kBakeToMpeg4, &peak::kBakeToMpeg4, atEach},
    {"extract -o FOLDER", &peak::kExport, &peak::kExport, atRefined},
    {"sheet", &peak::kSheet, &peak::kSheet, onSheet},
    {"render", &peak::kSurfaceMode, &peak::kSurfaceMode, whileDrawn},
    {"render --mode splat", &peak::kSplatMode, &peak::kSplatMode, whileDrawn},
    {"render --light", &peak::kLitSurfaceMode, &peak::kLitSurfaceMode, whileDrawn},
    {"render --mode splat --light", &peak::kLitSplatMode, &peak::kLitSplatMode, whileDrawn},
    {"pack", &peak::kAtlas, &peak::kAtlas, whilePacked},
    {"pack --min-psnr", &peak::kAtlas, &peak::kAtlas, whilePruned},
    {"select", &peak::kSelect, &peak::kSelect, atEach},
    {"refine", &peak::kRefine, &peak::kRefine, whileRefined},
    {"extract -o NAME.ply", &peak::kPoints, &peak::kPoints, atRefined},
    {"extract -o NAME.ply --as splats", &peak::kSplats, &peak::kSplats, atDiscs},
    {"extract -o NAME.glb", &peak::kSurfaces, &peak::kSurfaces, atSurfaces},
    {"extract -o NAME.html", &peak::kPage, &peak::kPage, atGroups},
};

/// What commands take of views that may be refined before.
class MemoryOfCommands {
  public:
    MemoryOfCommands(const ViewTable& table, std::size_t frames, bool refines, const Limits& limits)
        : table_(table),
          limits_(limits),
          frames_(frames),
          refines_(refines),
          onDemand_(!table.whole()),
          refiningAll_(memoryOfAll(table, peak::kRefine)),
          refining_(refiningAll_) {
        if (onDemand_)
            refining_ = std::min(refiningAll_, memoryFromSpool(table, peak::kRefine, limits));
        spooled_ = refining_ < refiningAll_;
    }

    struct Takes {
        std::uint64_t bytes = 0;
        bool all = true;  ///< it holds all views
    };
    [[nodiscard]] Takes of(const ViewCommand& command, const PeakMemory& takes) const {
        switch (command.looks) {
            case atEach:
                return each(takes, onDemand_);
            case atRefined:
                return withRefining(each(takes, onDemand_ && (!refines_ || spooled_)));
            case onSheet: {
                Takes views = each(takes, onDemand_ && (!refines_ || spooled_));
                views.bytes += memoryOfSheet(table_, frames_);
                return withRefining(views);
            }
            case whilePacked:
                return withRefining(packed(takes));
            case whilePruned:
                return withRefining(pruned(takes));
            case whileRefined:
                return {refining_, !spooled_};
            case atSurfaces:
                return withRefining(spooled(takes, memoryOfSpooledSurfaces(table_)));
            case atDiscs:
                return withRefining(spooled(takes, memoryOfSpooledSplats(table_, limits_)));
            case atGroups:
                return withRefining(grouped(takes));
            case whileDrawn:
                return withRefining(drawn(takes));
        }
        return {};
    }

  private:
    [[nodiscard]] Takes each(const PeakMemory& takes, bool one) const {
        return {one ? memoryOfEach(table_, takes) : memoryOfAll(table_, takes), !one};
    }
    [[nodiscard]] Takes withRefining(Takes takes) const {
        if (!refines_) return takes;
        // What is refined is in the spool until the end.
        if (spooled_ && !takes.all) takes.bytes += limits_.maxMemoryBytes / kSpoolPart;
        return {std::max(takes.bytes, takes.all ? refiningAll_ : refining_), takes.all};
    }
    [[nodiscard]] Takes packed(const PeakMemory& takes) const {
        const bool one = onDemand_ && (!refines_ || spooled_);
        const auto grid = memoryOfGrid(table_, PackSettings());
        if (!grid) return each(takes, one);
        // All views at once are those in memory beside the pages.
        std::uint64_t viewsBeside = 0;
        for (std::size_t i = 0; !one && onDemand_ && i < table_.count(); ++i)
            viewsBeside += table_.bytesOf(i);
        return {*grid + viewsBeside, !one};
    }
    [[nodiscard]] Takes pruned(const PeakMemory& takes) const {
        return {std::max({packed(takes).bytes, memoryOfPruning(table_),
                          memoryOfAll(table_, kDrawnAfterPruning)}),
                true};
    }
    [[nodiscard]] Takes grouped(const PeakMemory& takes) const {
        const std::uint64_t all = memoryOfAll(table_, takes);
        const bool some = onDemand_ && (!refines_ || spooled_) && all > limits_.maxMemoryBytes;
        if (!some) return {all, true};
        std::uint64_t most = limits_.maxMemoryBytes;
        for (std::size_t i = 0; i < table_.count(); ++i)
            most = std::max(most, table_.bytesOf(i) + takes.perPixel * table_.pixelsOf(i));
        return {most, false};
    }
    [[nodiscard]] Takes drawn(const PeakMemory& takes) const {
        if (!onDemand_) return each(takes, false);
        const DrawingMemory views(table_, takes, std::vector<bool>(table_.count(), true));
        return {views.most(limits_), !views.inSpool(limits_)};
    }
    [[nodiscard]] Takes spooled(const PeakMemory& takes, std::uint64_t inSpool) const {
        const std::uint64_t all = memoryOfAll(table_, takes);
        const bool one =
            onDemand_ && all > limits_.maxMemoryBytes && inSpool <= limits_.maxMemoryBytes;
        return {one ? inSpool : all, !one};
    }

    const ViewTable& table_;
    const Limits& limits_;
    std::size_t frames_;
    bool refines_, onDemand_;
    std::uint64_t refiningAll_, refining_;
    bool spooled_ = false;  ///< they are refined in a spool
};

nlohmann::ordered_json memoryOf(const ViewTable& table, std::size_t frames, bool refines,
                                const Limits& limits, std::uint64_t kept = 0) {
    const bool vectors = std::ranges::any_of(
        table.kinds(), [](const ViewImageKinds& k) { return k.normal || k.splatU || k.splatV; });
    const MemoryOfCommands memory(table, frames, refines, limits);
    auto commands = nlohmann::ordered_json::array();
    for (const ViewCommand& command : kCommands) {
        const auto takes = memory.of(command, vectors ? *command.takesWithVectors : *command.takes);
        commands.push_back({{"command", command.words},
                            {"bytes", takes.bytes + kept},
                            {"views", takes.all ? "all"
                                      : command.looks == atGroups || command.looks == whileDrawn
                                          ? "as many as fit"
                                          : "one for each thread"}});
    }
    return {{"threads", threadCount()}, {"commands", std::move(commands)}};
}

/// Views of which only sizes are known.
class SizesAlone : public ViewTable {
  public:
    SizesAlone(Bundle sizes, std::vector<ViewImageKinds> kinds)
        : ViewTable(std::move(sizes), std::move(kinds)) {}

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t, Job&) const override {
        return fail(ErrorCode::failed, "only its size is known");
    }
};

}  // namespace

Result<nlohmann::ordered_json> memoryJson(const ViewTable& table, std::size_t frames,
                                          std::uint64_t mostKept, Job& job) {
    STX_TRY(const bool refines, mayRefine(table, RefineSettings(), job));
    std::uint64_t decoded = 0;
    for (std::size_t i = 0; i < table.count(); ++i) decoded += table.bytesOf(i) * frames;
    return memoryOf(table, frames, refines, job.limits, std::min(decoded, mostKept));
}

Result<nlohmann::ordered_json> memoryOfSizes(const nlohmann::ordered_json& views,
                                             std::size_t frames, bool onDemand,
                                             const Limits& limits) {
    Bundle sizes;
    for (const auto& view : views) {
        Camera& camera = sizes.views.emplace_back().camera;
        camera.width = view.value("width", 0);
        camera.height = view.value("height", 0);
        if (camera.width <= 0 || camera.height <= 0)
            return fail(ErrorCode::invalidInput,
                        "the size of view '{}' is not known before its picture is read, and so the "
                        "memory that it takes is not, either; leave out --memory",
                        view.value("name", ""));
    }
    if (!onDemand) return memoryOf(*viewsOf(sizes), frames, true, limits);
    std::vector<ViewImageKinds> kinds(sizes.views.size());
    return memoryOf(SizesAlone(std::move(sizes), std::move(kinds)), frames, true, limits);
}

std::string memoryText(const nlohmann::ordered_json& memory) {
    std::string out = fmt::format(
        "memory: MiB at most, beside 60 to 90 of the program; * with one view for each of {} at a "
        "time\n",
        counted(memory["threads"].get<int>(), "thread"));
    for (const auto& row : memory["commands"])
        out += fmt::format("  {:<32}{:>8}{}\n", row["command"].get_ref<const std::string&>(),
                           (row["bytes"].get<std::uint64_t>() + (1 << 20) - 1) >> 20,
                           row["views"] == "one for each thread" ? " *" : "");
    return out;
}

}  // namespace stx
