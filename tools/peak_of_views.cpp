#include "tools/peak_of_views.hpp"

#include <algorithm>

namespace stx::tools {

Result<void> checkPeakOfAll(const PeakMemory& step, const ViewTable& views, const Limits& limits) {
    std::uint64_t pixels = 0, largest = 0, held = 0;
    for (std::size_t i = 0; i < views.count(); ++i) {
        pixels += views.pixelsOf(i);
        largest = std::max(largest, views.pixelsOf(i));
        held += views.bytesGiven(i);
    }
    return checkPeak(step, pixels, largest, held, limits);
}

Result<void> checkImagesFit(const PeakMemory& step, const ViewTable& views, const Limits& limits,
                            std::uint64_t fromSpool) {
    if (views.whole() || memoryOfAll(views, {}) <= limits.maxMemoryBytes) return {};
    if (fromSpool < memoryOfAll(views, step)) {
        std::uint64_t pixels = 0;
        for (std::size_t i = 0; i < views.count(); ++i) pixels += views.pixelsOf(i);
        return checkPeak({step.what, 0}, pixels, 0, fromSpool, limits);
    }
    return checkPeakOfAll(step, views, limits);
}

}  // namespace stx::tools
