#pragma once

#include <vector>

#include "lib/panorama/picture_source.hpp"
#include "lib/panorama/work_copy.hpp"

namespace stx::panorama {

/// Copies of all pictures, as large as is useful and memory allows. Errors: those of the source;
/// invalidInput: not even small copies fit; cancelled.
[[nodiscard]] Result<std::vector<WorkCopy>> readWorkCopies(PictureSource& source, Job& job);

/// For each picture an earlier one with the same pixels; -1 = none.
[[nodiscard]] Result<std::vector<int>> sameAs(const std::vector<WorkCopy>& copies, Job& job);

}  // namespace stx::panorama
