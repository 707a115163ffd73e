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
    /// In the world; when on, RasterImage::lit is made as well. `beyondOne` counts without lights,
    /// too.
    Lighting lighting;
};

/// A mesh seen by a camera. Depth and normal belong to the pixel's centre exactly; colour and
/// coverage are box-filtered over the pixel, so an edge pixel can have coverage but no depth.
struct RasterImage {
    /// sRGB-coded unless `linear`, premultiplied by coverage (alpha), 0..1; what is brighter than
    /// white is clipped when all surfaces are blended, or goes on beyond 1 (Lighting::beyondOne,
    /// and always of splats, which are clipped once a background has been put behind them).
    Image<glm::vec4> colour;
    Image<glm::vec4> lit;  ///< the same under RasterSettings::lighting; empty when that is off
    Image<float> depth;    ///< planar distance; kNoDepth where the centre misses
    /// Unit, world, of the side that is seen (MaterialSampler::normal()); zero where none; may be
    /// empty.
    Image<glm::vec3> normal;
    /// As in ReferenceView; empty unless asked for, and where no material of the mesh has them.
    Image<glm::vec2> metallicRoughness;
    Image<glm::vec3> emissive;
    bool linear = false;  ///< colour and lit are linear light: of splats whose colours are

    /// Makes colours that are linear light sRGB-coded ones, each under its coverage.
    void code();
};

/// Rasterises a mesh (which must pass check()) exactly: no cracks along shared edges, no clipping
/// artefacts, perspective-correct. Unlit base colour. Points of point clouds become discs that face
/// the camera and close the gaps between neighbours. A note says that more than Layers::kMost
/// translucent surfaces lie behind each other. The same result on any number of threads.
[[nodiscard]] Result<RasterImage> rasterise(const Mesh& mesh, const Camera& camera,
                                            const RasterSettings& settings, Job& job);

/// How the loose points of a mesh are drawn.
struct LoosePoints {
    /// Closes the gaps between them, scene units; 0 when the mesh has none.
    float radius = 0;
    /// They are too few for that, and stay dots, drawn as balls, which look alike from everywhere.
    /// Discs face their camera, so that each view has other ones: surface mode lost their rims, two
    /// thirds of each (20.8 instead of 45.1 dB). Where points are dense, discs are nearer to the
    /// surface that the points are on: 22.4 and 28.8 dB for a ball of 3,000 and 30,000 points, 20.3
    /// and 27.4 dB with bumps.
    bool apart = false;
};

/// By the distances to the nearest neighbours: a radius of at most the triangles' usual side, where
/// there are some, and at most a fiftieth of what all are in.
[[nodiscard]] LoosePoints loosePoints(const Mesh& mesh);

}  // namespace stx
