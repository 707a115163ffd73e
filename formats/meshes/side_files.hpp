#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>

#include "formats/meshes/model_files.hpp"
#include "formats/meshes/mtl_notes.hpp"

namespace stx {

/// What the process that reads a model gets of the files that the model names: those that
/// ModelFiles opens beside it, and no others.
class SideFiles {
  public:
    explicit SideFiles(ModelFiles& files) : files_(files) {}

    [[nodiscard]] bool exists(std::string_view name);
    /// The text of one as plainMtl() gives it, with a note of what it cannot read; nothing when it
    /// is not there. Where a name is of several files that are, as in `mtllib a.mtl b.mtl`, the
    /// text of all.
    [[nodiscard]] std::optional<Bytes> read(std::string_view name);

    /// A file that is there but cannot be read.
    [[nodiscard]] const std::optional<Error>& error() const { return error_; }
    /// The first name that does not exist beside the model, and why; empty when all do.
    [[nodiscard]] const std::string& missing() const { return missing_; }
    /// Whether a material file was opened, and the materials of all, by name.
    [[nodiscard]] bool hasMaterialFile() const { return hasMaterialFile_; }
    [[nodiscard]] const std::map<std::string, MtlMaterial>& materials() const { return materials_; }

  private:
    std::optional<std::filesystem::path> find(const std::string& file);
    std::optional<std::string> readFound(const std::string& file,
                                         const std::filesystem::path& path);

    ModelFiles& files_;
    std::optional<Error> error_;
    std::string missing_;
    bool hasMaterialFile_ = false;
    std::map<std::string, MtlMaterial> materials_;
    std::set<std::string> opened_;  ///< paths of side files
};

}  // namespace stx
