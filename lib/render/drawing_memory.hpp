#pragma once

#include <cstdint>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// What drawing from views of a table takes, in memory and from a spool, and which of both it
/// should be.
class DrawingMemory {
  public:
    /// Of the views of `wanted`, one value for each. `drawing`: drawingMemory().
    DrawingMemory(const ViewTable& table, const PeakMemory& drawing,
                  const std::vector<bool>& wanted);

    /// The images of the views, bytes, and their pixels.
    [[nodiscard]] std::uint64_t images() const { return images_; }
    /// What drawing takes with all of it in memory, bytes; a spool takes about as much on a disk.
    [[nodiscard]] std::uint64_t inMemory() const { return inMemory_; }
    [[nodiscard]] std::uint64_t pixels() const { return pixels_; }
    /// The least that drawing can do with, bytes.
    [[nodiscard]] std::uint64_t least() const;
    /// Whether pixels should be in a spool: they take more than a picture needs of them, and less
    /// there.
    [[nodiscard]] bool inSpool(const Limits& limits) const;
    /// What a spool should hold of them in memory, bytes.
    [[nodiscard]] std::uint64_t spoolHolds(const Limits& limits) const;
    /// What drawing takes then, bytes.
    [[nodiscard]] std::uint64_t most(const Limits& limits) const;

  private:
    std::uint64_t images_ = 0, pixels_ = 0;
    std::uint64_t inMemory_ = 0;
    std::uint64_t beside_ = 0;  ///< what is not in the spool, if there is one
};

}  // namespace stx
