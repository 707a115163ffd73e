#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "formats/meshes/gltf/json.hpp"
#include "formats/meshes/mesh_builder.hpp"
#include "formats/meshes/model_files.hpp"

namespace stx::gltf {

/// A bufferView's bytes.
struct BufferView {
    ByteSpan bytes;
    std::uint64_t stride = 0;  ///< 0 = tightly packed
};

/// An accessor's elements as floats: normalised integers become 0..1 or -1..1, others keep their
/// value.
struct AccessorValues {
    std::size_t count = 0;
    int components = 0;
    std::vector<float> values;

    [[nodiscard]] float at(std::size_t element, int component) const {
        return values[element * static_cast<std::size_t>(components) +
                      static_cast<std::size_t>(component)];
    }
    /// Leaves the other elements out.
    void keep(const std::vector<bool>& kept);
};

/// A glTF 2.0 or GLB file: its JSON, its buffers (loaded when first used), its accessors.
class GltfFile {
  public:
    /// Errors: no glTF, another version, a required extension that is not known.
    [[nodiscard]] static Result<GltfFile> open(ByteSpan bytes, ModelFiles& files,
                                               MeshBuilder& builder);

    [[nodiscard]] const Json& root() const { return root_; }
    [[nodiscard]] ModelFiles& files() const { return *files_; }
    [[nodiscard]] Job& job() const { return files_->job(); }

    [[nodiscard]] Result<BufferView> bufferView(std::uint64_t index, const std::string& user);
    /// `types`: what is allowed, e.g. {"VEC3", "VEC4"}. `normalise`: integers are normalised even
    /// if the file forgets to say so.
    [[nodiscard]] Result<AccessorValues> accessor(std::uint64_t index, const std::string& user,
                                                  std::initializer_list<std::string_view> types,
                                                  bool normalise = false);
    /// Unsigned SCALARs.
    [[nodiscard]] Result<std::vector<std::uint32_t>> indices(std::uint64_t index,
                                                             const std::string& user);
    /// For extensions that are known and not read, where leaving one out changes the picture.
    /// Errors (unsupported): the file requires it (glTF 2.0, 3.12); `wayOut` ends the sentence.
    [[nodiscard]] Result<void> mayLack(std::string_view extension, std::string_view where,
                                       std::string_view wayOut) const;
    /// Bytes of a data: URI or of a file beside the model.
    [[nodiscard]] Result<Bytes> uri(const std::string& uri, const std::string& user);

  private:
    struct Layout;
    GltfFile() = default;
    [[nodiscard]] Result<void> parse(ByteSpan bytes);
    [[nodiscard]] Result<void> checkAsset();
    [[nodiscard]] Result<ByteSpan> buffer(std::uint64_t index, const std::string& user);
    /// The bytes of a bufferView that EXT_meshopt_compression packs.
    [[nodiscard]] Result<ByteSpan> unpacked(const Json& extension, std::uint64_t view,
                                            const std::string& viewWhere);
    [[nodiscard]] Result<Layout> layout(std::uint64_t index, const std::string& user,
                                        std::initializer_list<std::string_view> types);
    /// All elements' components as doubles would lose nothing; Component is float or uint32.
    template <class Component>
    [[nodiscard]] Result<std::vector<Component>> elements(const Layout& layout);

    Json root_;
    std::set<std::string, std::less<>> required_;  ///< extensions
    ByteSpan binaryChunk_;
    bool hasBinaryChunk_ = false;
    std::vector<std::optional<ByteSpan>> buffers_;
    std::vector<std::unique_ptr<Bytes>> owned_;
    std::map<std::uint64_t, Bytes> unpacked_;  ///< by bufferView
    ModelFiles* files_ = nullptr;
    MeshBuilder* builder_ = nullptr;
};

}  // namespace stx::gltf
