#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>

#include "formats/meshes/model_files.hpp"

namespace stx {

/// The only files that Assimp sees: the model's bytes in memory, and what ModelFiles opens beside
/// it.
class AssimpFiles final : public Assimp::IOSystem {
  public:
    /// A name that does not exist on any disk, so that nothing is opened but through this class.
    static constexpr const char* kFolder = "stx-model/";

    AssimpFiles(ByteSpan model, std::string modelName, ModelFiles& files)
        : model_(model), modelName_(std::move(modelName)), files_(files) {}

    bool Exists(const char* name) const override;
    char getOsSeparator() const override { return '/'; }
    Assimp::IOStream* Open(const char* name, const char* mode) override;
    void Close(Assimp::IOStream* stream) override { delete stream; }

    /// A file that is there but cannot be read.
    [[nodiscard]] const std::optional<Error>& error() const { return error_; }
    /// The first name that does not exist beside the model, and why; empty when all do.
    [[nodiscard]] const std::string& missing() const { return missing_; }
    /// Folder of the first material file, relative to the model's; empty when it is the same.
    [[nodiscard]] const std::string& materialFolder() const { return materialFolder_; }
    /// Text of the material files that were opened, in order.
    [[nodiscard]] const std::vector<std::string>& sideTexts() const { return sideTexts_; }

  private:
    [[nodiscard]] std::string relative(const char* name) const;

    ByteSpan model_;
    std::string modelName_;
    ModelFiles& files_;
    mutable std::optional<Error> error_;
    mutable std::string missing_;
    std::string materialFolder_;
    std::vector<std::string> sideTexts_;
    std::set<std::string> opened_;  ///< paths of side files
};

}  // namespace stx
