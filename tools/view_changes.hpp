#pragma once

#include <algorithm>
#include <filesystem>
#include <memory>
#include <mutex>

#include "lib/model/view_table.hpp"

namespace stx::tools {

/// The largest step of depth codes of 8 bits that came by, scene units.
class LargestStep {
  public:
    void add(double step) {
        const std::lock_guard lock(mutex_);
        largest_ = std::max(largest_, step);
    }
    [[nodiscard]] double largest() const { return largest_; }

  private:
    std::mutex mutex_;
    double largest_ = 0;
};

/// Gives each view these depth bits. `step`, which outlives it, hears of those of 8.
[[nodiscard]] ViewChange withDepthBits(int bits, LargestStep& step);

/// cubeFromInside() of views, which are in a spool in `folder` meanwhile where memory does not hold
/// them.
[[nodiscard]] Result<std::unique_ptr<ViewTable>> cubeOf(std::unique_ptr<ViewTable> table,
                                                        const std::filesystem::path& folder,
                                                        Job& job);

}  // namespace stx::tools
