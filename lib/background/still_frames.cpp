#include "lib/background/still_frames.hpp"

#include <algorithm>
#include <optional>

#include "lib/base/parallel.hpp"

namespace stx {

KeptFrames::KeptFrames(StillFrames& frames, std::uint64_t bytes)
    : frames_(&frames), kept_(static_cast<std::size_t>(frames.count())) {
    const auto size = frames.size();
    room_ = bytes / (static_cast<std::uint64_t>(size.x) * size.y * sizeof(glm::u8vec4));
}

Result<std::shared_ptr<const Rgba8Image>> KeptFrames::frame(int k) {
    const auto at = static_cast<std::size_t>(k);
    {
        const std::lock_guard lock(mutex_);
        if (kept_[at]) return kept_[at];
    }
    // Two threads may read the same frame; both get the same pixels.
    STX_TRY(auto picture, frames_->frame(k));
    const std::lock_guard lock(mutex_);
    if (!kept_[at] && room_ > 0) {
        kept_[at] = picture;
        --room_;
    }
    return picture;
}

std::vector<int> spreadFrames(int count, int wanted) {
    const int n = wanted == 0 ? count : std::min(count, wanted);
    std::vector<int> which(static_cast<std::size_t>(n));
    for (std::int64_t i = 0; i < n; ++i)
        which[i] = n == 1 ? 0 : static_cast<int>((i * (count - 1) + (n - 1) / 2) / (n - 1));
    return which;
}

Result<void> takeFrames(StillFrames& frames, std::span<const int> which, std::uint64_t bytes,
                        const std::function<void(std::size_t, const Rgba8Image&)>& take) {
    std::vector<std::optional<Error>> errors(which.size());
    const auto count = static_cast<std::int64_t>(which.size());
    const auto size = frames.size();
    const std::uint64_t one = static_cast<std::uint64_t>(size.x) * size.y * kFrameBytesPerPixel;
    const auto atOnce = static_cast<std::int64_t>(
        std::clamp<std::uint64_t>(bytes / one, 1, static_cast<std::uint64_t>(count)));
    // As many pieces as may be in memory at a time, where those are fewer than there are threads.
    const std::int64_t grain = atOnce >= threadCount() ? 1 : (count + atOnce - 1) / atOnce;
    parallelFor(0, count, grain, [&](std::size_t at) {
        const auto picture = frames.frame(which[at]);
        if (picture)
            take(at, **picture);
        else
            errors[at] = picture.error();
    });
    for (auto& error : errors)
        if (error) return tl::unexpected(std::move(*error));
    return {};
}

}  // namespace stx
