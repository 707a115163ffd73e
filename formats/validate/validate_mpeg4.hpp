#pragma once

#include <filesystem>
#include <vector>

#include "formats/mpeg4/mapping/mapping.hpp"
#include "formats/validate/validate.hpp"

namespace stx {

/// Where the images of a presentation come from.
struct PresentationImages {
    /// Images that the scene names by a string are looked for in here; empty: they are findings.
    std::filesystem::path folder;
    mpeg4::ImageDecoder decode = decodeImage;
};

/// Every rule that a presentation breaks, in order of the scene; empty when it breaks none.
[[nodiscard]] std::vector<Finding> validate(const Mpeg4Document& document,
                                            const ValidateOptions& options,
                                            const PresentationImages& images, Job& job);

/// Reads the presentation first: one that cannot be read breaks rule 1001, a wrong ending 1002.
/// Errors (io): the file does not exist or cannot be opened.
[[nodiscard]] Result<std::vector<Finding>> validateMpeg4File(const std::filesystem::path& path,
                                                             const ValidateOptions& options,
                                                             Job& job);

}  // namespace stx
