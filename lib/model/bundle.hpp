#pragma once

#include <optional>
#include <string>
#include <vector>

#include "lib/model/reference_view.hpp"

namespace stx {

/// An object (or several) as reference views: what a SimpleTexture file holds.
struct Bundle {
    std::string title;
    std::vector<ReferenceView> views;
    /// World bounds of all points, when known (WorldInfo, an EXR attribute).
    std::optional<Bounds> bounds;

    /// "SimpleTextureV2" when a view carries normals or splats, else "SimpleTexture".
    [[nodiscard]] const char* nodeKind() const;
    [[nodiscard]] std::int64_t pointCount() const;
    /// Some view was pruned.
    [[nodiscard]] bool pruned() const;
    /// The bounds of all points, computed from the pixels.
    [[nodiscard]] Bounds computeBounds() const;
    /// Each view's check(), with its index; at least one view; one colour space in all views.
    [[nodiscard]] Result<void> check() const;
};

}  // namespace stx
