#pragma once

#include <string>
#include <string_view>

#include "formats/atlas/atlas_files.hpp"

namespace stx {

/// atlas.json: views, rectangles and textures; the same input gives the same text.
[[nodiscard]] std::string atlasJson(const AtlasHeader& header);
/// The inverse. Every number is checked for its kind and range, sizes against the limits;
/// rectangles and cameras are checked by Atlas::check() once there are pixels. `where` is for
/// messages. Errors: invalidInput with the path inside the document ("views[3].fx"). With
/// AtlasChecks::format, planes, rectangles and sizes of textures may be anything that is a number.
[[nodiscard]] Result<AtlasHeader> atlasFromJson(std::string_view text, const std::string& where,
                                                const Limits& limits,
                                                AtlasChecks checks = AtlasChecks::all);

}  // namespace stx
