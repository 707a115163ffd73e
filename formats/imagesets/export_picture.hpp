#pragma once

#include <filesystem>

#include "formats/files/files.hpp"
#include "lib/base/job.hpp"
#include "lib/model/reference_view.hpp"

namespace stx {

/// How a view becomes a picture with depth for programs that take one photograph.
enum class DepthPicture {
    sideBySide,  ///< one file: the colour on the left, its depth on the right
    pair,        ///< two: NAME.jpg and NAME_depth.jpg
};

/// The file of a pair that holds the depth: NAME_depth.jpg of NAME.jpg.
[[nodiscard]] std::filesystem::path depthFileOf(const std::filesystem::path& picture);

/// Writes a view as a picture with depth, each file whole or not at all, as PNG or JPEG by its
/// ending. Colour is 8-bit sRGB with black behind it. Depth is grey of 8 bits, white near, linear
/// in 1 / distance from the nearest point to the farthest; black, too, where there is none. What
/// reads it gets no scale: a note says the range, and another what linear colours lose in 8
/// bits. `jpegQuality`: 1..100, of the colour, and of the depth where both are in one file; a
/// depth of its own has 100. Errors: (usage) another ending; (invalidInput) a view without a point;
/// files.
[[nodiscard]] Result<void> exportPicture(const ReferenceView& view,
                                         const std::filesystem::path& path, DepthPicture kind,
                                         int jpegQuality, OutputFile::Options options, Job& job);

}  // namespace stx
