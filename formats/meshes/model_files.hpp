#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "formats/files/files.hpp"
#include "lib/base/job.hpp"
#include "lib/model/mesh.hpp"

namespace stx {

/// How a texture is sampled.
struct SamplerState {
    MeshTexture::Wrap wrapU = MeshTexture::Wrap::repeat;
    MeshTexture::Wrap wrapV = MeshTexture::Wrap::repeat;
    bool nearest = false;
};

/// Opens what a model's file names, inside the model's folder only.
class ModelFiles {
  public:
    ModelFiles(std::filesystem::path folder, Job& job) : folder_(std::move(folder)), job_(job) {}

    /// The bytes of a file that the model names. Backslashes are tried as separators when the name
    /// as it is does not exist. Errors as resolveInside() and readFile().
    [[nodiscard]] Result<Bytes> read(std::string_view name) const;

    /// Index into `textures` of the image file `name`, or -1, with a note, when it is missing or
    /// cannot be decoded. Errors only when the name leaves the folder or memory runs out.
    [[nodiscard]] Result<int> textureFromFile(std::string_view name, SamplerState sampler,
                                              std::vector<MeshTexture>& textures);
    /// The same for an image in memory; `name` is for messages and must be the image's own.
    [[nodiscard]] Result<int> textureFromBytes(ByteSpan bytes, std::string_view name,
                                               SamplerState sampler,
                                               std::vector<MeshTexture>& textures);

    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
    [[nodiscard]] Job& job() const { return job_; }

  private:
    using Key = std::tuple<std::string, MeshTexture::Wrap, MeshTexture::Wrap, bool>;
    /// The texture known by this name: with the same sampler itself, else a copy; nothing when new.
    std::optional<int> known(std::string_view name, SamplerState sampler,
                             std::vector<MeshTexture>& textures);

    std::filesystem::path folder_;
    Job& job_;
    std::map<Key, int> textures_;
    std::map<std::string, int, std::less<>> first_;  ///< by name alone
    std::uint64_t pixelBytes_ = 0;
};

/// "%20" and the like of a URI made bytes again.
[[nodiscard]] std::string percentDecoded(std::string_view uri);

/// True for `scheme:...` with a scheme of two letters or more.
[[nodiscard]] bool hasUriScheme(std::string_view name);

}  // namespace stx
