#include "formats/any/info_memory.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "lib/base/counted.hpp"
#include "lib/base/parallel.hpp"
#include "lib/packing/views_one_by_one.hpp"
#include "lib/refine/refine_needed.hpp"

namespace stx {
namespace {

/// What a command does with views.
struct ViewCommand {
    const char* words;
    const PeakMemory* takes;
    const PeakMemory* takesWithVectors;  ///< where views have normals or splats
    enum class Looks {
        atEach,       ///< one at a time, where they come on demand
        atRefined,    ///< the same, unless they are refined before, which looks at all
        whilePacked,  ///< the same, beside the atlas
        atAll,
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
    {"sheet", &peak::kSheet, &peak::kSheet, atRefined},
    {"render", &peak::kSurfaceMode, &peak::kSurfaceMode, atAll},
    {"render --mode splat", &peak::kSplatMode, &peak::kSplatMode, atAll},
    {"render --light", &peak::kLitSurfaceMode, &peak::kLitSurfaceMode, atAll},
    {"render --mode splat --light", &peak::kLitSplatMode, &peak::kLitSplatMode, atAll},
    {"pack", &peak::kAtlas, &peak::kAtlas, whilePacked},
    {"select", &peak::kSelect, &peak::kSelect, atEach},
    {"refine", &peak::kRefine, &peak::kRefine, atAll},
    {"extract -o NAME.ply", &peak::kPoints, &peak::kPoints, atRefined},
    {"extract -o NAME.ply --as splats", &peak::kSplats, &peak::kSplats, atAll},
    {"extract -o NAME.glb", &peak::kSurfaces, &peak::kSurfaces, atAll},
    {"extract -o NAME.html", &peak::kPage, &peak::kPage, atAll},
};

/// Of one command; `each`: it looks at views one by one.
std::uint64_t bytesOf(const ViewCommand& command, const PeakMemory& takes, const ViewTable& table,
                      bool each, bool refines) {
    if (command.looks == whilePacked) {
        // All views at once are those in memory beside the pages.
        const auto grid = memoryOfGrid(table, PackSettings());
        std::uint64_t viewsBeside = 0;
        for (std::size_t i = 0; !each && !table.whole() && i < table.count(); ++i)
            viewsBeside += table.bytesOf(i);
        if (grid)
            return std::max(*grid + viewsBeside, refines ? memoryOfAll(table, peak::kRefine) : 0);
    }
    const std::uint64_t bytes = each ? memoryOfEach(table, takes) : memoryOfAll(table, takes);
    return refines && !each ? std::max(bytes, memoryOfAll(table, peak::kRefine)) : bytes;
}

nlohmann::ordered_json memoryOf(const ViewTable& table, bool refines) {
    const bool vectors = std::ranges::any_of(
        table.kinds(), [](const ViewImageKinds& k) { return k.normal || k.splatU || k.splatV; });
    auto commands = nlohmann::ordered_json::array();
    for (const ViewCommand& command : kCommands) {
        const PeakMemory& takes = vectors ? *command.takesWithVectors : *command.takes;
        const bool each =
            !table.whole() && command.looks != atAll && (command.looks == atEach || !refines);
        commands.push_back({{"command", command.words},
                            {"bytes", bytesOf(command, takes, table, each, refines)},
                            {"views", each ? "one for each thread" : "all"}});
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

Result<nlohmann::ordered_json> memoryJson(const ViewTable& table, Job& job) {
    STX_TRY(const bool refines, mayRefine(table, RefineSettings(), job));
    return memoryOf(table, refines);
}

Result<nlohmann::ordered_json> memoryOfSizes(const nlohmann::ordered_json& views, bool onDemand) {
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
    if (!onDemand) return memoryOf(*viewsOf(sizes), true);
    std::vector<ViewImageKinds> kinds(sizes.views.size());
    return memoryOf(SizesAlone(std::move(sizes), std::move(kinds)), true);
}

std::string memoryText(const nlohmann::ordered_json& memory) {
    std::string out = fmt::format(
        "memory: MiB at most, beside 60 to 90 of the program; * with one view for each of {} at a "
        "time\n",
        counted(memory["threads"].get<int>(), "thread"));
    for (const auto& row : memory["commands"])
        out += fmt::format("  {:<32}{:>8}{}\n", row["command"].get_ref<const std::string&>(),
                           (row["bytes"].get<std::uint64_t>() + (1 << 20) - 1) >> 20,
                           row["views"] == "all" ? "" : " *");
    return out;
}

}  // namespace stx
