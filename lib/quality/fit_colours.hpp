#pragma once

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

/// What fitting was worth: PSNR of pictures from all source views against them, RGB as the bundle
/// codes it, dB.
struct ColourFit {
    double before = 0, after = 0;  ///< the same where nothing was changed
};

/// Fits the colours that a pruned bundle kept to the views that it was pruned from: what pictures
/// from the source cameras (surface mode) lack is projected back onto the points that those views
/// see, and 0.35 of its mean is added, once. The pictures are drawn again, and where they are not
/// nearer to the source all stays as it was. Depth, alpha and what is pruned do not change.
///
/// `source` has the views of `pruned`, in the same order. Errors: other views; those of rendering;
/// memory; cancelled.
[[nodiscard]] Result<ColourFit> fitColours(const Bundle& source, Bundle& pruned, Job& job);

}  // namespace stx
