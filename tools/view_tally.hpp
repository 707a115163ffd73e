#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "lib/model/sequence.hpp"

namespace stx::tools {

/// The sizes of pictures, in pixels: "48x36", or "of 48x36 to 1600x1200".
class PictureSizes {
  public:
    void add(const Camera& camera);
    [[nodiscard]] std::string text() const;

  private:
    glm::ivec2 smallest_{0}, largest_{0};  ///< by their pixels, then by their width
};

/// What a command's report tells of the views that passed: those of the first frame.
class ViewTally {
  public:
    /// From any thread; a view that passes again counts once.
    void add(std::size_t index, const ReferenceView& view);
    /// From any thread.
    void addSize(const Camera& camera);
    /// Before they pass anew.
    void clear() { points_.clear(); }

    [[nodiscard]] std::size_t views() const { return points_.size(); }
    [[nodiscard]] std::int64_t points() const;
    /// Of all frames that passed by tallied().
    [[nodiscard]] const PictureSizes& sizes() const { return sizes_; }

  private:
    std::mutex mutex_;
    std::map<std::size_t, std::int64_t> points_;  ///< by the view's number
    PictureSizes sizes_;
};

/// The same frames, whose first is counted on its way. `tally` must outlive them.
[[nodiscard]] std::unique_ptr<Sequence> tallied(std::unique_ptr<Sequence> frames, ViewTally& tally);

}  // namespace stx::tools
