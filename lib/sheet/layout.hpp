#pragma once

#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "lib/base/job.hpp"
#include "lib/sheet/sheet.hpp"
#include "lib/sheet/tiles.hpp"

namespace stx {

/// What belongs together on a sheet: lines of text, and below them pictures from left to right.
struct SheetGroup {
    std::vector<std::string> lines;
    std::vector<Tile> tiles;
};

/// What is to be placed.
struct SheetContent {
    int groups = 1;              ///< from 1
    int tiles = 1;               ///< of each group, from 1
    int lines = 1;               ///< of text above each group's pictures
    int headerLines = 1;         ///< above everything
    glm::ivec2 largest{1};       ///< pixels of the largest picture
    const char* what = "views";  ///< the groups' name, for messages
};

/// Where everything goes.
struct SheetPlan {
    SheetContent content;
    int columns = 1, rows = 1;
    int shown = 1;        ///< groups that fit, at most all
    glm::ivec2 cell{1};   ///< room of each picture, pixels
    glm::ivec2 group{1};  ///< room of each group, pixels
    glm::ivec2 size{1};   ///< of the sheet, pixels

    /// Of memory, that the sheet takes with its pictures.
    [[nodiscard]] std::uint64_t bytes() const {
        return static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) *
               kBytesPerPixel;
    }
    static constexpr std::uint64_t kBytesPerPixel = sizeof(glm::u8vec3) * 2;
    /// The number of the group at place `i` (below `shown`): evenly spread when not all fit.
    [[nodiscard]] int groupAt(int i) const {
        return static_cast<int>(static_cast<std::int64_t>(i) * content.groups / shown);
    }
};

/// The columns for which the pictures get largest, none larger than it is (but for very small
/// ones). When not all groups fit at their least size, as many as do. Errors (usage) when not one
/// fits, or `columns` do not, with the size that would do; memory over the limit.
[[nodiscard]] Result<SheetPlan> planSheet(const SheetContent& content,
                                          const SheetSettings& settings, const Limits& limits);

/// `groups`: plan.shown of them.
[[nodiscard]] Rgb8Image drawSheet(const SheetPlan& plan, const std::vector<std::string>& header,
                                  const std::vector<SheetGroup>& groups);

}  // namespace stx
