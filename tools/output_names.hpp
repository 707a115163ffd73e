#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lib/base/result.hpp"

namespace stx::tools {

/// A file or folder that the command line names.
struct NamedPath {
    std::string option;  ///< "-o"; empty of an input that stands alone
    std::string path;    ///< "-" is a standard stream, and no file
    /// Of an output: may take the place of the input, where that is the only one, and one file or
    /// folder: the files of a numbered film change one by one, and are others where it is cut.
    bool replaces = false;
};

/// Whether both names are of one file or folder, which need not be there yet. Devices and pipes are
/// none: several may write to /dev/null. Numbered names are compared as they are.
[[nodiscard]] bool samePath(const std::string& a, const std::string& b);

/// Errors (usage), before anything is written, where an output is an input, which would be lost, or
/// another output, of which one would be.
[[nodiscard]] Result<void> checkOutputNames(const std::vector<NamedPath>& outputs,
                                            const std::vector<NamedPath>& inputs);

/// Remembers the files of numbered inputs (`name_%04d.png`) as files that an input names.
void rememberNumberedInputs(const std::vector<NamedPath>& inputs);

/// Error (usage) where a report would be the main file of a folder that is an input or an output:
/// an atlas' atlas.json, a set's transforms.json, cameras.json or files of COLMAP. It would be
/// written where reading the folder fails, too.
[[nodiscard]] Result<void> checkReportIsNoMainFile(const std::string& report,
                                                   const std::vector<NamedPath>& folders);

/// Error (usage) where a report's name ends like that of a picture, a film, a scene or a model: it
/// would take the place of one, perhaps of a texture that the input names.
[[nodiscard]] Result<void> checkReportName(std::string_view path);

/// ".png", where a name ends like the file of a picture, a film, a scene, a model or an archive;
/// else empty. Text and JSON are none of these.
[[nodiscard]] std::string endingOfMedia(std::string_view path);

}  // namespace stx::tools
