#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "formats/imagesets/image_sets.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// The views of readImageSet() as a table. Where their images take more than `held` bytes, each
/// view is read once here, for its planes and marks, and again when it is asked for; a file that
/// changes meanwhile is an error (invalidInput). Views that are taken together are in memory all
/// the same: panoramas, and frames of video. That views disagree is noted when the last of them has
/// been asked for.
[[nodiscard]] Result<std::unique_ptr<ViewTable>> openSetViews(const std::filesystem::path& path,
                                                              const ImageSetOptions& options,
                                                              Job& job, std::uint64_t held);

}  // namespace stx
