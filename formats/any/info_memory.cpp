#include "formats/any/info_memory.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "lib/base/counted.hpp"
#include "lib/base/parallel.hpp"
#include "lib/refine/refine_needed.hpp"

namespace stx {
namespace {

/// What a command does with views, and whether it looks at one at a time where they come on demand.
struct ViewCommand {
    const char* words;
    const PeakMemory* takes;
    const PeakMemory* takesWithVectors;  ///< where views have normals or splats
    bool oneByOne;
};

constexpr PeakMemory kNothingMore = {"reading", 0};
constexpr ViewCommand kCommands[] = {
    {"convert -o NAME.exr", &kNothingMore, &kNothingMore, true},
    {"convert -o NAME.mp4", &peak::kMpeg4, &peak::kMpeg4Vectors, true},
    {"bake -o NAME.exr", &peak::kBake, &peak::kBake, true},
    {"bake -o NAME.mp4", &peak::kBakeToMpeg4, &peak::kBakeToMpeg4, true},
    {"extract -o FOLDER", &peak::kExport, &peak::kExport, true},
    {"sheet", &peak::kSheet, &peak::kSheet, true},
    {"render", &peak::kSurfaceMode, &peak::kSurfaceMode, false},
    {"render --mode splat", &peak::kSplatMode, &peak::kSplatMode, false},
    {"render --light", &peak::kLitSurfaceMode, &peak::kLitSurfaceMode, false},
    {"render --mode splat --light", &peak::kLitSplatMode, &peak::kLitSplatMode, false},
    {"pack", &peak::kAtlas, &peak::kAtlas, false},
    {"select", &peak::kSelect, &peak::kSelect, false},
    {"refine", &peak::kRefine, &peak::kRefine, false},
    {"extract -o NAME.ply", &peak::kPoints, &peak::kPoints, false},
    {"extract -o NAME.ply --as splats", &peak::kSplats, &peak::kSplats, false},
    {"extract -o NAME.glb", &peak::kSurfaces, &peak::kSurfaces, false},
    {"extract -o NAME.html", &peak::kPage, &peak::kPage, false},
};

nlohmann::ordered_json memoryOf(const ViewTable& table, bool refines) {
    const bool vectors = std::ranges::any_of(
        table.kinds(), [](const ViewImageKinds& k) { return k.normal || k.splatU || k.splatV; });
    auto commands = nlohmann::ordered_json::array();
    for (const ViewCommand& command : kCommands) {
        const PeakMemory& takes = vectors ? *command.takesWithVectors : *command.takes;
        const bool each = command.oneByOne && !table.whole() && !refines;
        std::uint64_t bytes = each ? memoryOfEach(table, takes) : memoryOfAll(table, takes);
        if (refines) bytes = std::max(bytes, memoryOfAll(table, peak::kRefine));
        commands.push_back({{"command", command.words},
                            {"bytes", bytes},
                            {"views", each ? "one for each thread" : "all"}});
    }
    return {{"threads", threadCount()}, {"commands", std::move(commands)}};
}

}  // namespace

Result<nlohmann::ordered_json> memoryJson(const ViewTable& table, Job& job) {
    STX_TRY(const bool refines, mayRefine(table, RefineSettings(), job));
    return memoryOf(table, refines);
}

Result<nlohmann::ordered_json> memoryOfSizes(const nlohmann::ordered_json& views) {
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
    return memoryOf(*viewsOf(sizes), true);
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
