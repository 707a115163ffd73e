#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/model/is_seen.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// Plain video of a camera that stands still: colour frames of one size, in the order of time.
class StillFrames {
  public:
    virtual ~StillFrames() = default;
    /// Width and height of every frame, pixels, at least 1.
    [[nodiscard]] virtual glm::ivec2 size() const = 0;
    [[nodiscard]] virtual int count() const = 0;
    /// Frame `k`, from 0, with straight alpha. Any frame, as often as wanted, from several threads
    /// at a time. Errors are those of reading it, and (invalidInput) another size.
    [[nodiscard]] virtual Result<std::shared_ptr<const Rgba8Image>> frame(int k) = 0;
    /// The frame whose picture frame(k) gave: another one where `k` is damaged.
    [[nodiscard]] virtual int shownFor(int k) const { return k; }
};

/// The same frames; those that are read first are kept, as many as fit into `bytes`. What passes
/// over all frames several times reads the kept ones once.
class KeptFrames : public StillFrames {
  public:
    /// `frames` must outlive it.
    KeptFrames(StillFrames& frames, std::uint64_t bytes);
    [[nodiscard]] glm::ivec2 size() const override { return frames_->size(); }
    [[nodiscard]] int count() const override { return frames_->count(); }
    [[nodiscard]] Result<std::shared_ptr<const Rgba8Image>> frame(int k) override;
    [[nodiscard]] int shownFor(int k) const override { return frames_->shownFor(k); }

  private:
    StillFrames* frames_;
    std::uint64_t room_;  ///< frames that may still be kept
    std::mutex mutex_;
    std::vector<std::shared_ptr<const Rgba8Image>> kept_;
};

/// `wanted` of `count` frames, spread evenly from the first to the last; all of them when there are
/// not more. `wanted` is 0 (all) or at least 2.
[[nodiscard]] std::vector<int> spreadFrames(int count, int wanted);

/// What a frame takes while it is read, decoded and made RGBA.
inline constexpr std::uint64_t kFrameBytesPerPixel = 8;

/// Calls take(i, picture) for frame which[i] of each i, on several threads, but of frames that are
/// being read no more at a time than fit into `bytes`. The error is that of the first frame that
/// has one.
[[nodiscard]] Result<void> takeFrames(
    StillFrames& frames, std::span<const int> which, std::uint64_t bytes,
    const std::function<void(std::size_t, const Rgba8Image&)>& take);

/// Luma of BT.601, 0..255: what every method here sees of a frame.
[[nodiscard]] inline std::uint8_t stillLuma(glm::u8vec4 p) {
    return static_cast<std::uint8_t>((77u * p.r + 150u * p.g + 29u * p.b + 128u) >> 8);
}

}  // namespace stx
