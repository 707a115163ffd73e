#pragma once

#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

struct PackSettings {
    enum class Layout { grid, tight };
    Layout layout = Layout::grid;
    int padding = 2;      ///< pixels around each rectangle, 0..64
    int maxSize = 16384;  ///< largest width and height of a texture: what a GPU takes
};

/// Merges the views of a bundle into one atlas of at most four textures. Padding repeats each
/// rectangle's edge so that filters stay inside. Errors when the views cannot fit, with the size
/// that would be needed and what to change.
[[nodiscard]] Result<Atlas> pack(const Bundle& bundle, const PackSettings& settings, Job& job);

/// The bundle of an atlas: every pixel of every rectangle back in its view; pixels in no rectangle
/// are background. unpack(pack(b)) == b for the pixels that are points or have coverage.
[[nodiscard]] Result<Bundle> unpack(const Atlas& atlas, Job& job);

}  // namespace stx
