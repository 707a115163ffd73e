#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "formats/files/file_spool.hpp"
#include "lib/model/view_table.hpp"

namespace stx::tools {

/// Reads views to be drawn, those of `wanted`: into memory, or where they and `drawing`
/// (drawingMemory()) take much (DrawingMemory::inSpool()) into `spool`, which is made in `folder`
/// then and must outlive the bundle. What the limit allows is in memory, too, where such a file
/// would cost much. `look`: as that of someViews(). Errors: those of the views; (invalidInput) even
/// from a spool it is more than the limit; (io) no file can be made.
[[nodiscard]] Result<Bundle> viewsToDraw(
    const ViewTable& table, const PeakMemory& drawing, const std::vector<bool>& wanted,
    const std::filesystem::path& folder, std::unique_ptr<FileSpool>& spool, Job& job,
    const std::function<Result<void>(std::size_t index, const ReferenceView& view)>& look = {});

/// Error (invalidInput) where drawing those views takes more than the limit, even from a spool.
[[nodiscard]] Result<void> checkDrawing(const ViewTable& table, const PeakMemory& drawing,
                                        const std::vector<bool>& wanted, const Limits& limits);

}  // namespace stx::tools
