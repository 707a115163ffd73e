#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lib/base/result.hpp"

namespace stx::tools {

/// A file or folder that the command line names.
struct NamedPath {
    std::string option;  ///< "-o"; empty of an input that stands alone
    std::string path;    ///< "-" is a standard stream, and no file
    /// Of an output: the input that stands alone whose place it may take; empty: none. A numbered
    /// film keeps its place: its files change one by one, and are others where it is cut.
    std::string replaces = {};
};

/// The same for all names of one file or folder, which need not be there yet. Nothing of devices
/// and pipes: several may write to /dev/null. Numbered names are taken as they are.
[[nodiscard]] std::optional<std::string> placeOf(const std::string& path);

/// The path from the root, without links as far as it is there, and without a slash at its end.
[[nodiscard]] std::filesystem::path wholePath(const std::string& path);

/// Whether an input names a film of numbered files: a file may have such a name itself.
[[nodiscard]] bool isNumberedFilm(const std::string& path);

/// Whether it names standard output, whatever that leads to.
[[nodiscard]] bool isStandardOutput(std::string_view path);

/// Whether both names are of one file or folder, by placeOf().
[[nodiscard]] bool samePath(const std::string& a, const std::string& b);

/// Errors (usage), before anything is written, where an output is an input, which would be lost, or
/// another output, of which one would be, or where two are standard output, which would be mixed.
/// An input that is the main file of a folder, or COLMAP's folder in one, is that folder, too.
[[nodiscard]] Result<void> checkOutputNames(const std::vector<NamedPath>& outputs,
                                            const std::vector<NamedPath>& inputs);

/// Those of many inputs that may be an output, or a folder that one lies in: their last name is in
/// its path, or its last name is that of a folder whose main file they are. To look at each of a
/// million files takes minutes where they are far away; a link of another name is not found so.
[[nodiscard]] std::vector<NamedPath> alikeAmong(const std::vector<std::string>& inputs,
                                                const std::vector<NamedPath>& outputs);

/// The name of a file or folder without the folders that it is in.
[[nodiscard]] std::string lastName(const std::string& path);

/// Remembers the files of numbered inputs (`name_%04d.png`) as files that an input names. Where an
/// output is numbered or a folder that is there, its files may have the names of inputs, which
/// checkOutputNames() does not see: inputs are remembered then, but for those that an output
/// replaces.
void rememberInputs(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs);

/// Error (usage) where a report would be the main file of a folder that is an input or an output:
/// an atlas' atlas.json, a set's transforms.json, cameras.json or files of COLMAP. It would be
/// written where reading the folder fails, too.
[[nodiscard]] Result<void> checkReportIsNoMainFile(const std::string& report,
                                                   const std::vector<NamedPath>& folders);

/// Error (usage) where a report would be in the folder that -o names. That folder is replaced as a
/// whole, and the next run would find a file in it that it does not write.
[[nodiscard]] Result<void> checkReportIsBeside(const std::string& report,
                                               const std::vector<NamedPath>& outputs);

/// Error (usage) where a report's name ends like that of a picture, a film, a scene or a model: it
/// would take the place of one, perhaps of a texture that the input names.
[[nodiscard]] Result<void> checkReportName(std::string_view path);

/// Whether a mistake may be reported there: none of the errors above, and none of `others` is the
/// file.
[[nodiscard]] bool mayHoldReport(const std::string& report, const std::vector<NamedPath>& others);

/// ".png", where a name ends like the file of a picture, a film, a scene, a model or an archive;
/// else empty. Text and JSON are none of these.
[[nodiscard]] std::string endingOfMedia(std::string_view path);

}  // namespace stx::tools
