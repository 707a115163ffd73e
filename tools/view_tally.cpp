#include "tools/view_tally.hpp"

#include <numeric>
#include <utility>

namespace stx::tools {

void PictureSizes::add(const Camera& camera) {
    const glm::ivec2 size(camera.width, camera.height);
    const auto less = [](glm::ivec2 a, glm::ivec2 b) {
        const auto pixels = [](glm::ivec2 v) { return static_cast<std::int64_t>(v.x) * v.y; };
        return std::pair(pixels(a), a.x) < std::pair(pixels(b), b.x);
    };
    if (smallest_.x == 0 || less(size, smallest_)) smallest_ = size;
    if (less(largest_, size)) largest_ = size;
}

std::string PictureSizes::text() const {
    const auto one = [](glm::ivec2 size) { return fmt::format("{}x{}", size.x, size.y); };
    return smallest_ == largest_ ? one(smallest_) : "of " + one(smallest_) + " to " + one(largest_);
}

void ViewTally::add(std::size_t index, const ReferenceView& view) {
    const std::int64_t points = view.pointCount();
    const std::lock_guard lock(mutex_);
    points_[index] = points;
}

void ViewTally::addSize(const Camera& camera) {
    const std::lock_guard lock(mutex_);
    sizes_.add(camera);
}

std::int64_t ViewTally::points() const {
    return std::accumulate(points_.begin(), points_.end(), std::int64_t{0},
                           [](std::int64_t sum, const auto& view) { return sum + view.second; });
}

std::unique_ptr<Sequence> tallied(std::unique_ptr<Sequence> frames, ViewTally& tally) {
    return watched(std::move(frames),
                   [&tally](std::size_t frame, std::size_t index, const ReferenceView& view) {
                       tally.addSize(view.camera);
                       if (frame == 0) tally.add(index, view);
                   });
}

}  // namespace stx::tools
