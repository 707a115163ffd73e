#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "lib/model/sequence.hpp"

namespace stx::tools {

/// What a command's report tells of the views that passed: those of the first frame.
class ViewTally {
  public:
    /// From any thread; a view that passes again counts once.
    void add(std::size_t index, const ReferenceView& view);
    /// Before they pass anew.
    void clear() { points_.clear(); }

    [[nodiscard]] std::size_t views() const { return points_.size(); }
    [[nodiscard]] std::int64_t points() const;

  private:
    std::mutex mutex_;
    std::vector<std::int64_t> points_;
};

/// The same frames, whose first is counted on its way. `tally` must outlive them.
[[nodiscard]] std::unique_ptr<Sequence> tallied(std::unique_ptr<Sequence> frames, ViewTally& tally);

}  // namespace stx::tools
