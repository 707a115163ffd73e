#pragma once

#include "lib/base/image.hpp"
#include "lib/base/job.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/light/lighting.hpp"
#include "lib/model/mesh.hpp"

namespace stx {

struct RasterSettings {
    /// Colour and coverage samples per pixel and axis, 1..8; samples form a regular grid.
    int supersampling = 4;
    bool normals = false;  ///< also the surface normals at the pixel centres
    /// Also metallic-roughness and emissive at the pixel centres; colour is then without emission.
    bool materials = false;
    Lighting lighting;  ///< in the world; when on, RasterImage::lit is made as well
};

/// A mesh seen by a camera. Depth and normal belong to the pixel's centre exactly; colour and
/// coverage are box-filtered over the pixel, so an edge pixel can have coverage but no depth.
struct RasterImage {
    Image<glm::vec4> colour;  ///< sRGB-coded, premultiplied by coverage (alpha), 0..1
    Image<glm::vec4> lit;     ///< the same under RasterSettings::lighting; empty when that is off
    Image<float> depth;       ///< planar distance; kNoDepth where the centre misses
    Image<glm::vec3> normal;  ///< unit, world, towards the camera; zero where none; may be empty
    /// As in ReferenceView; empty unless asked for, and where no material of the mesh has them.
    Image<glm::vec2> metallicRoughness;
    Image<glm::vec3> emissive;
};

/// Rasterises a mesh (which must pass check()) exactly: no cracks along shared edges, no clipping
/// artefacts, perspective-correct. Unlit base colour. Points of point clouds become discs that face
/// the camera and close the gaps between neighbours. The same result on any number of threads.
[[nodiscard]] Result<RasterImage> rasterise(const Mesh& mesh, const Camera& camera,
                                            const RasterSettings& settings, Job& job);

/// A mesh without loose points: each became a disc of triangles, facing outward from `viewpoint`
/// (or, when orthographic, along `-forward`). Meshes without points come back as they are.
[[nodiscard]] Mesh pointsAsDiscs(const Mesh& mesh, const Camera& camera, float radius);

/// Radius that closes the gaps between the points of a point cloud: from the distances to the
/// nearest neighbours; at most the triangles' usual side, where there are some. 0 when the mesh has
/// no loose points.
[[nodiscard]] float pointRadius(const Mesh& mesh);

}  // namespace stx
