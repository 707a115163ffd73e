#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/exr_file.hpp"

namespace stx {

/// Pixels of an atlas' textures as the channels that OpenEXR files hold, and back.

/// The header of a part with the channels of these attributes, as large as a page: colour in half
/// where the atlas has 8-bit sRGB, all else float32.
[[nodiscard]] ExrPart exrPartOf(const AtlasHeader& header,
                                const std::vector<std::string>& attributes);

/// Writes attributes of a page, which must have them, as a part with that header. Colour is made
/// linear a few rows at a time: of the whole page it would take twice the page. Errors: files.
[[nodiscard]] Result<void> writePage(ExrWriter& writer, int part, const AtlasPage& page,
                                     const std::vector<std::string>& attributes);

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
