#pragma once

#include <map>
#include <optional>
#include <set>
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
    /// `replacesColour`: the caller has a texture that wins over the model's. `materials`: it wants
    /// metallic-roughness.
    ModelFiles(std::filesystem::path folder, Job& job, bool replacesColour = false,
               bool materials = false)
        : folder_(std::move(folder)),
          job_(job),
          replacesColour_(replacesColour),
          materials_(materials) {}

    /// The bytes of a file that the model names. Backslashes are tried as separators when the name
    /// as it is does not exist. Errors as resolveInside() and readFile().
    [[nodiscard]] Result<Bytes> read(std::string_view name) const;

    /// Where a texture or material file is whose name may be of another machine
    /// (`D:\work\t.png`, `/home/x/t.png`, `../t.png`): as named, else its last part in `alsoIn`,
    /// beside the model, or in a folder `textures` there; the latter with a note, once. Errors as
    /// resolveInside() for the name itself.
    [[nodiscard]] Result<std::filesystem::path> find(std::string_view name,
                                                     const std::string& alsoIn = {}) const;

    /// What a note says of a file that find() did not find, with its error.
    [[nodiscard]] std::string_view whyNotThere(std::string_view name, const Error& error) const;

    /// Base colour textures of materials need not be opened: readers give materials whose parts
    /// have texture coordinates a texture of one pixel, which keeps how theirs is sampled. These
    /// get another picture, and no others do.
    [[nodiscard]] bool replacesColour() const { return replacesColour_; }

    /// A new texture of one pixel for that; -1 where nothing is replaced, or nothing has texture
    /// coordinates.
    [[nodiscard]] int placeOfColour(std::vector<MeshTexture>& textures, bool hasUvs) const;

    /// Metallic-roughness is asked for.
    [[nodiscard]] bool materials() const { return materials_; }

    /// Index into `textures` of the image file `name`, looked for as find() does, or -1, with a
    /// note, when it is missing, outside of the folder or cannot be decoded. Errors only when
    /// memory runs out.
    [[nodiscard]] Result<int> textureFromFile(std::string_view name, SamplerState sampler,
                                              std::vector<MeshTexture>& textures,
                                              const std::string& alsoIn = {});
    /// The same for an image in memory; `name` is for messages and must be the image's own.
    [[nodiscard]] Result<int> textureFromBytes(ByteSpan bytes, std::string_view name,
                                               SamplerState sampler,
                                               std::vector<MeshTexture>& textures);

    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
    [[nodiscard]] Job& job() const { return job_; }

  private:
    using Key = std::tuple<std::string, MeshTexture::Wrap, MeshTexture::Wrap, bool>;
    /// The texture known by this id: with the same sampler itself, else a copy; nothing when new.
    std::optional<int> known(const std::string& id, SamplerState sampler,
                             std::vector<MeshTexture>& textures);
    /// A new one.
    Result<int> decode(ByteSpan bytes, std::string_view name, const std::string& id,
                       SamplerState sampler, std::vector<MeshTexture>& textures);

    std::filesystem::path folder_;
    Job& job_;
    bool replacesColour_ = false, materials_ = false;
    mutable std::set<std::string, std::less<>> told_;  ///< names that were found elsewhere
    std::set<std::string, std::less<>> missing_;       ///< names that notes say so of
    // By ids: paths of files, names of images in memory.
    std::map<Key, int> textures_;
    std::map<std::string, int> first_;  ///< -1: it cannot be decoded
    std::uint64_t pixelBytes_ = 0;
};

/// "%20" and the like of a URI made bytes again.
[[nodiscard]] std::string percentDecoded(std::string_view uri);

/// True for `scheme:...` with a scheme of two letters or more.
[[nodiscard]] bool hasUriScheme(std::string_view name);

}  // namespace stx
