#include "lib/panorama/work_copies.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "lib/base/parallel_try.hpp"

namespace stx::panorama {
namespace {

/// Longer side of the copies: features and patches gain little from more.
constexpr int kWorkSide = 1200, kLeastSide = 200;
/// Of a pixel of a copy: colour, luma, and a pyramid of floats (1 + 1/4 + 1/16 of its pixels).
constexpr double kBytesPerWorkPixel = 4 + 1 + 4 * 1.3125;
/// Copies take no more than this share of the memory.
constexpr double kMemoryShare = 0.25;
/// Height over width that the memory is counted with.
constexpr double kUsualShape = 0.75;

}  // namespace

Result<std::vector<WorkCopy>> readWorkCopies(PictureSource& source, Job& job) {
    const int count = source.count();
    const double pixels =
        kMemoryShare * static_cast<double>(job.limits.maxMemoryBytes) / kBytesPerWorkPixel / count;
    const int side = static_cast<int>(
        std::min<double>(kWorkSide, std::sqrt(std::max(0.0, pixels / kUsualShape))));
    if (side < kLeastSide)
        return fail(ErrorCode::invalidInput,
                    "{} pictures need more memory than the limit of {} MiB; raise it with "
                    "--max-memory",
                    count, job.limits.maxMemoryBytes >> 20);
    std::vector<WorkCopy> copies(static_cast<std::size_t>(count));
    std::atomic<std::int64_t> done = 0;
    const auto read = parallelTry(0, count, [&](int i) -> Result<void> {
        STX_CHECK(job.checkCancelled());
        STX_TRY(auto picture, source.picture(i));
        copies[i] = makeWorkCopy(std::move(picture), side);
        job.progress(++done, count, "reading pictures");
        return {};
    });
    STX_CHECK(read);
    return copies;
}

Result<std::vector<int>> sameAs(const std::vector<WorkCopy>& copies, Job& job) {
    std::vector<int> same(copies.size(), -1);
    for (std::size_t i = 0; i < copies.size(); ++i) {
        STX_CHECK(job.checkCancelled());
        for (std::size_t k = 0; k < i && same[i] < 0; ++k)
            if (same[k] < 0 && copies[i].colour == copies[k].colour) same[i] = static_cast<int>(k);
    }
    return same;
}

}  // namespace stx::panorama
