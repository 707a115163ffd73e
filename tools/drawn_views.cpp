#include "tools/drawn_views.hpp"

#include <algorithm>

#include "lib/model/peak_memory.hpp"

namespace stx::tools {
namespace {

/// What drawing from a spool takes beside that, bytes: for each pixel of all views what is known of
/// blocks, and beside its images for each of the view that a thread prepares.
constexpr std::uint64_t kKnown = 2;
constexpr PeakMemory kPreparing = {"drawing", 32};

/// Of the memory that is left beside a spool, it takes one part of so many: frames take some, too.
constexpr std::uint64_t kPartOfLeft = 2;

struct DrawingTakes {
    std::uint64_t images = 0, pixels = 0;  ///< of the views
    std::uint64_t inMemory = 0, fromSpool = 0;
    std::uint64_t beside = 0;  ///< of the second: what is not in the spool

    DrawingTakes(const ViewTable& table, const PeakMemory& drawing,
                 const std::vector<bool>& wanted) {
        for (std::size_t i = 0; i < table.count(); ++i) {
            if (!wanted[i]) continue;
            images += table.bytesOf(i);
            inMemory += table.bytesOf(i) + drawing.perPixel * table.pixelsOf(i);
            pixels += table.pixelsOf(i);
        }
        beside = memoryOfEach(table, kPreparing) + kKnown * pixels;
        fromSpool = beside + beside / (kSpoolPart - 1);
    }
    /// What a spool may hold in memory. Of less it reads the same again.
    [[nodiscard]] std::uint64_t spoolHolds(std::uint64_t limit) const {
        return std::max(limit / kSpoolPart, limit > beside ? (limit - beside) / kPartOfLeft : 0);
    }
};

}  // namespace

Result<void> checkDrawing(const ViewTable& table, const PeakMemory& drawing,
                          const std::vector<bool>& wanted, const Limits& limits) {
    const DrawingTakes takes(table, drawing, wanted);
    return checkPeak({kPreparing.what, 0}, takes.pixels, 0,
                     std::min(takes.inMemory, takes.fromSpool), limits);
}

Result<Bundle> viewsToDraw(
    const ViewTable& table, const PeakMemory& drawing, const std::vector<bool>& wanted,
    const std::filesystem::path& folder, std::unique_ptr<FileSpool>& spool, Job& job,
    const std::function<Result<void>(std::size_t, const ReferenceView&)>& look) {
    const std::uint64_t limit = job.limits.maxMemoryBytes;
    const DrawingTakes takes(table, drawing, wanted);
    if (takes.inMemory > limit && takes.inMemory > takes.fromSpool) {
        STX_CHECK(checkDrawing(table, drawing, wanted, job.limits));
        STX_TRY(spool, FileSpool::create(folder, takes.spoolHolds(limit)));
    } else
        STX_CHECK(within(table.where(), job.limits.checkAllocation(takes.images, 1, "the views")));
    return someViews(table, wanted, spool.get(), job, look);
}

}  // namespace stx::tools
