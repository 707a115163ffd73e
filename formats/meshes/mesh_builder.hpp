#pragma once

#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/mesh.hpp"

namespace stx {

/// One primitive of a model in world space; arrays are empty or as long as `positions`.
struct MeshPart {
    std::string where;  ///< for messages: `meshes[2].primitives[0]`
    /// Doubles, so that coordinates far from 0 are not rounded before the origin is known.
    std::vector<glm::dvec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::vec4> tangents;
    std::vector<glm::vec4> colours;
    std::vector<glm::vec2> uvs;
    // Of the other textures, where they differ from uvs.
    std::vector<glm::vec2> normalUvs;
    std::vector<glm::vec2> metallicRoughnessUvs;
    std::vector<glm::vec2> emissiveUvs;
    std::vector<glm::uvec3> triangles;
    bool points = false;  ///< the vertices are drawn as points
    std::uint32_t material = 0;
};

/// Collects parts with unlike sets of attributes into one Mesh.
class MeshBuilder {
  public:
    explicit MeshBuilder(Job& job) : job_(job) {}

    /// The mesh's materials and textures, for the reader to fill.
    std::vector<Material>& materials() { return mesh_.materials; }
    std::vector<MeshTexture>& textures() { return mesh_.textures; }

    /// Counts memory that reading this model takes; errors when the sum passes the limit.
    [[nodiscard]] Result<void> charge(std::uint64_t count, std::uint64_t bytesEach,
                                      std::string_view what);

    /// Appends a part. Errors (invalidInput) name part and vertex: a position that is not finite,
    /// an index out of range. Points of a cloud at no finite place are skipped and counted.
    /// Triangles without area are left out and counted; normals that are not directions are
    /// replaced by those of the triangles, of points by none; uvs and colours that are not finite
    /// become 0. The colour of points is that of their vertices times that of their material; its
    /// texture is not used.
    [[nodiscard]] Result<void> add(MeshPart part);

    /// How many were appended.
    [[nodiscard]] int parts() const { return parts_; }

    /// The positions of all parts count from here in the world: a reader took it away already.
    void setOrigin(glm::dvec3 origin) { mesh_.origin = origin; }

    /// The positions of parts were floats before, whatever the file has: that is said of large
    /// ones.
    void setRounded() { rounded_ = true; }

    /// The mesh, checked. Attributes that only some parts have are filled in for the others. Large
    /// coordinates count from an origin then (originFor()), and what lies far off is said.
    [[nodiscard]] Result<Mesh> finish();

  private:
    void repair(MeshPart& part);
    void dropBrokenPoints(MeshPart& part);
    void paintPoints(MeshPart& part);
    void fillNormals();
    void roundPositions();
    void dropUnusedTextures();
    [[nodiscard]] double largestStep() const;

    Job& job_;
    Mesh mesh_;                          ///< its positions come at the end
    std::vector<glm::dvec3> positions_;  ///< of all parts
    std::uint64_t charged_ = 0;
    int parts_ = 0;
    bool rounded_ = false;
    std::uint64_t flatTriangles_ = 0;
    std::uint64_t points_ = 0, brokenPoints_ = 0;
};

/// Says that coordinates count from an origin, unless it is 0.
void noteOrigin(glm::dvec3 origin, Job& job);

/// Leaves the other vertices out: a part of points has no more than those that are drawn.
void keepVertices(MeshPart& part, const std::vector<bool>& kept);

/// Gives each vertex the normal of its triangle; a vertex of several unlike triangles is doubled.
void addFlatNormals(MeshPart& part);

/// Tangents from the uvs of the normal map (Lengyel's method); needs normals. Vertices at which
/// mirrored uvs meet others are doubled.
void addTangents(MeshPart& part);

/// Merges vertices that are alike in every bit, in order of first use.
void weldVertices(MeshPart& part);

}  // namespace stx
