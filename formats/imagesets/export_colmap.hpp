#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/imagesets/export.hpp"

namespace stx::imagesets {

/// Writes views, when they are read, as COLMAP's dense workspace: images/ (8-bit PNG), sparse/
/// (text), and stereo/depth_maps/ (floats). `names` are those of the views, fit for files. Notes:
/// what linear colours lose; pruned views. Errors: io; invalidInput for orthographic cameras, which
/// COLMAP does not have.
[[nodiscard]] Result<void> exportColmap(const ViewTable& table, const std::filesystem::path& folder,
                                        const std::vector<std::string>& names,
                                        const ExportOptions& options, Job& job);

}  // namespace stx::imagesets
