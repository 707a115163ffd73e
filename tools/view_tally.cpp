#include "tools/view_tally.hpp"

#include <algorithm>
#include <numeric>

namespace stx::tools {

void ViewTally::add(std::size_t index, const ReferenceView& view) {
    const std::int64_t points = view.pointCount();
    const std::lock_guard lock(mutex_);
    points_.resize(std::max(points_.size(), index + 1));
    points_[index] = points;
}

std::int64_t ViewTally::points() const {
    return std::accumulate(points_.begin(), points_.end(), std::int64_t{0});
}

std::unique_ptr<Sequence> tallied(std::unique_ptr<Sequence> frames, ViewTally& tally) {
    return watched(std::move(frames),
                   [&tally](std::size_t frame, std::size_t index, const ReferenceView& view) {
                       if (frame == 0) tally.add(index, view);
                   });
}

}  // namespace stx::tools
