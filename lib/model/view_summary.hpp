#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "lib/geometry/bounds.hpp"

namespace stx {

/// What renderers need to know of a view that has no part in a picture, so that its pixels need not
/// be read: what is asked of all views together, and how far it sees. Made by summaryOfView()
/// (lib/render/factory.hpp) and kept by OpenEXR bundles (`stx:summary`).
struct ViewSummary {
    /// Cells along each side of a picture.
    static constexpr int kCells = 8;

    std::int64_t points = 0;   ///< pixels with a depth
    double validShare = 1;     ///< of the pixels of the object those with a depth, 0..1
    double border = 0;         ///< share of the picture's border where the object is, 0..1
    bool open = false;         ///< some pixel is not covered in full
    bool faint = false;        ///< where it is drawn as splats, some are not covered in full
    bool translucent = false;  ///< alpha inside of the object says that it is seen through
    Bounds bounds;             ///< of all that is drawn of it, in the world; empty: nothing is
    /// By cell, row by row from the upper left: no surface in it, nor what is drawn of it, is
    /// farther from the camera's plane, scene units; infinite where some pixel has no depth. Cell
    /// (i, j) has the pixels from i * width / kCells on, rounded down, to those of the next.
    std::array<float, kCells * kCells> farthest{};

    /// As containers keep it: always of the same length.
    [[nodiscard]] std::string text() const;
    /// Of such a text. None of others, of those of another version, and of values that make no
    /// sense.
    [[nodiscard]] static std::optional<ViewSummary> from(std::string_view text);
    bool operator==(const ViewSummary&) const = default;
};

}  // namespace stx
