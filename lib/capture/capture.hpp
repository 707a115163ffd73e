#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/capture/rasterizer.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/mesh.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

struct CaptureSettings {
    int supersampling = 4;     ///< colour and coverage samples per pixel and axis
    int depthBits = 16;        ///< 8, 16 or 32 (float, only .exr holds it)
    bool meshNormals = false;  ///< the mesh's own normals become the view's (SimpleTextureV2)
    /// Metallic-roughness and emissive become images of the view; its colour is without emission.
    bool materials = false;
    /// Of captureBundle(): the names of the views, one for each camera; empty: view000, view001,
    /// ...
    std::vector<std::string> names;
};

/// One reference view of a mesh: colour and coverage supersampled, depth at the pixel centres,
/// nearPlane and farPlane fitted tightly to it, depth rounded to its code (so that the bundle is
/// what a reader of the file will see), straight colour bled past the silhouette.
/// A camera that sees nothing of the mesh gives a view without points.
[[nodiscard]] Result<ReferenceView> captureView(const Mesh& mesh, const Camera& camera,
                                                std::string name, const CaptureSettings& settings,
                                                Job& job);

/// All views of a bundle, several at a time, without the mesh's strays (findStrays()). Views
/// without points are dropped with a note; errors when none is left.
[[nodiscard]] Result<Bundle> captureBundle(const Mesh& mesh, const std::vector<Camera>& cameras,
                                           const CaptureSettings& settings, Job& job);

/// The same views as a table, each captured when it is asked for, whose planes come with its
/// pixels. A view without points shows then only: `use` fails at it, and is called again with the
/// others, so that it must leave nothing where it fails. It gets a job whose notes are passed on
/// when it is done. Errors: as captureBundle(), and those of `use`.
[[nodiscard]] Result<void> withCapturedViews(
    const Mesh& mesh, const std::vector<Camera>& cameras, const CaptureSettings& settings, Job& job,
    const std::function<Result<void>(std::unique_ptr<ViewTable> table, Job& job)>& use);

/// Sets nearPlane and farPlane to the least and greatest distance of a view's points, as floats
/// (the format's precision) that enclose them, and rounds the distances to their codes. Does
/// nothing to a view without points. `depthBits` 32 keeps the distances.
void fitDepthRange(ReferenceView& view);

/// What of a mesh is drawn, as points that cameras frame: the corners of its triangles, each vertex
/// once, those of the discs that its loose points become, and of splats the tips of what hides half
/// of what is behind it (SplatCloud::reach()); not its strays (findStrays()).
[[nodiscard]] std::vector<glm::vec3> drawnPoints(const Mesh& mesh);

}  // namespace stx
