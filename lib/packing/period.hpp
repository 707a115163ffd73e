#pragma once

#include <cstdint>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/packing/prune.hpp"

namespace stx {

/// Frames of a sequence that are packed alike: rectangles that stay where they are let video code
/// what changes alone, and a pixel that came and went with its replacement would flicker. Frames
/// are taken in first; then each is pruned by what all of them keep, and packed by
/// PackSettings::contentOf.
class PackPeriod {
  public:
    /// Takes in a frame as it is, and as prune() leaves it (the same where nothing is pruned).
    /// Errors (invalidInput): other views, or other sizes, than the first frame has.
    [[nodiscard]] Result<void> add(const Bundle& whole, const Bundle& pruned);
    /// Takes away of a frame that was taken in what no frame keeps. It keeps at least what pruning
    /// it alone does, so no hole opens. The report has no PSNR.
    PruneReport prune(Bundle& frame) const;
    /// Views with content wherever one of the frames has it, after prune(). Only sizes, depth and
    /// alpha mean anything.
    [[nodiscard]] Bundle content() const;

  private:
    struct View {
        Camera camera;
        std::string name;
        Image<std::uint8_t> kept;   ///< some frame keeps a point here
        Image<std::uint8_t> rim;    ///< some frame, as it was, has partial coverage here
        Image<std::uint8_t> stays;  ///< some frame has it when it is pruned, too
    };
    std::vector<View> views_;
};

}  // namespace stx
