#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/exr_file.hpp"

namespace stx {

/// Pixels of an atlas' textures as the channels that OpenEXR files hold, and back.

/// Adds the channels of one attribute of a page, which must have it. `colour` is the page's,
/// premultiplied and linear, and is needed for "colour" only. What is added points into both.
void addAttribute(const AtlasPage& page, const std::string& attribute,
                  const Image<glm::vec4>& colour, std::vector<ExrConstPixels>& pixels);

/// The header of a part with these channels, as large as a page: colour in half where the atlas has
/// 8-bit sRGB, all else float32.
[[nodiscard]] ExrPart exrPartOf(const AtlasHeader& header,
                                const std::vector<ExrConstPixels>& pixels);

/// Writes one texture of a folder as an OpenEXR file. Errors: files.
[[nodiscard]] Result<void> writeFloatImage(const AtlasHeader& header, const AtlasPage& page,
                                           const AtlasTexture& t,
                                           const std::filesystem::path& path);

/// Reads the channels of these attributes from a part into a page. Errors: (invalidInput) a channel
/// that the part lacks; files.
[[nodiscard]] Result<void> readFloats(const ExrReader& reader, int part,
                                      const std::vector<std::string>& attributes, bool linear,
                                      AtlasPage& page);

}  // namespace stx
