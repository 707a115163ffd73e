#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"
#include "lib/base/result.hpp"

namespace draco {
class PointCloud;
}

namespace stx {

/// A decoded Draco stream: a .drc file, or a primitive of KHR_draco_mesh_compression.
class DracoGeometry {
  public:
    enum class Kind { position, normal, colour, texCoord, generic };
    struct Attribute {
        Kind kind = Kind::generic;
        int index = 0;  ///< in the stream; unique ids of old files are not always unique
        std::uint32_t uniqueId = 0;
        int components = 0;
        bool isFloat = false;
    };
    /// Is asked for memory before Draco takes it: (count, bytes each).
    using Charge = std::function<Result<void>(std::uint64_t, std::uint64_t)>;

    /// Errors (invalidInput) when the stream is not of Draco or is damaged; those of `charge`.
    [[nodiscard]] static Result<DracoGeometry> decode(ByteSpan bytes, const Charge& charge);

    [[nodiscard]] bool isMesh() const { return isMesh_; }
    [[nodiscard]] std::size_t pointCount() const;
    [[nodiscard]] const std::vector<Attribute>& attributes() const { return attributes_; }
    [[nodiscard]] std::vector<glm::uvec3> triangles() const;
    /// pointCount() x components values of an attribute; integers are divided by their type's
    /// largest value when `normalise`.
    [[nodiscard]] Result<std::vector<float>> values(const Attribute& attribute,
                                                    bool normalise) const;

  private:
    std::shared_ptr<draco::PointCloud> geometry_;
    bool isMesh_ = false;
    std::vector<Attribute> attributes_;
};

}  // namespace stx
