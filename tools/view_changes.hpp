#pragma once

#include <filesystem>
#include <memory>

#include "formats/stx/mesh_views.hpp"
#include "lib/model/view_table.hpp"

namespace stx::tools {

/// Gives each view these depth bits. `codes`, which outlive it, hear of those that had others.
[[nodiscard]] ViewChange withDepthBits(int bits, CodedDepth& codes);

/// cubeFromInside() of views, which are in a spool in `folder` meanwhile where memory does not hold
/// them.
[[nodiscard]] Result<std::unique_ptr<ViewTable>> cubeOf(std::unique_ptr<ViewTable> table,
                                                        const std::filesystem::path& folder,
                                                        Job& job);

}  // namespace stx::tools
