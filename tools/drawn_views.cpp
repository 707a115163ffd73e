#include "tools/drawn_views.hpp"

#include "lib/render/drawing_memory.hpp"

namespace stx::tools {

Result<void> checkDrawing(const ViewTable& table, const PeakMemory& drawing,
                          const std::vector<bool>& wanted, const Limits& limits) {
    const DrawingMemory takes(table, drawing, wanted);
    return checkPeak({"drawing", 0}, takes.pixels(), 0, takes.least(), limits);
}

Result<Bundle> viewsToDraw(
    const ViewTable& table, const PeakMemory& drawing, const std::vector<bool>& wanted,
    const std::filesystem::path& folder, std::unique_ptr<FileSpool>& spool, Job& job,
    const std::function<Result<void>(std::size_t, const ReferenceView&)>& look) {
    const DrawingMemory takes(table, drawing, wanted);
    const bool fits = takes.inMemory() <= job.limits.maxMemoryBytes;
    if (takes.inSpool(job.limits) && (!fits || FileSpool::costsLittle(folder))) {
        STX_CHECK(checkDrawing(table, drawing, wanted, job.limits));
        auto made =
            FileSpool::create(folder, takes.spoolHolds(job.limits), fits ? takes.inMemory() : 0);
        if (!made && !fits) return propagate(made);
        if (made) spool = std::move(*made);
    } else {
        STX_CHECK(
            within(table.where(), job.limits.checkAllocation(takes.images(), 1, "the views")));
    }
    return someViews(table, wanted, spool.get(), job, look);
}

}  // namespace stx::tools
