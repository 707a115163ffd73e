#pragma once

#include <cstddef>
#include <filesystem>

#include "formats/files/files.hpp"
#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

/// How a model of surfaces is written.
struct SurfacesOptions {
    std::size_t mostTriangles = 0;  ///< as takeFewerTriangles(); 0: all
    int jpegQuality = 0;            ///< of textures: 0 = PNG, exact; 1..100 = JPEG
    OutputFile::Options output = {};
    /// Where the bundle's pixels are, if not in memory. Then what is made of them is kept there,
    /// and no limit is checked, but of fewer triangles, which take memory for all views.
    PixelSpool* spool = nullptr;
};

/// What a model of surfaces holds.
struct SurfacesReport {
    std::size_t views = 0;
    std::int64_t triangles = 0;
    std::int64_t points = 0;  ///< that are on no triangle
};

/// Writes a bundle as binary glTF 2.0, whole or not at all: for each view a mesh (viewSurfaces())
/// with the view's colour as texture (triangles beside another surface, whose colour a filter would
/// mix in, have colours of their corners), and one of points for what is on no surface. Bundles
/// with normals (SimpleTextureV2) have them in the model and take the viewer's light; others show
/// their colours as they are (KHR_materials_unlit). The coordinates are the bundle's; where
/// its up (upOfCameras()) is not +Y, as glTF has it, a node above all others turns them. A bundle
/// with an origin stays at it, and the origin, turned, too, is in `asset.extras.origin`.
///
/// Notes: an origin, a turn, colours of linear light, normals that some views lack, translucent
/// surfaces, which become opaque.
/// Errors: a bundle that fails check(), no surface and no point, points beyond floats, more than
/// GLB's 4 GiB, memory over the limit, files, cancelled.
[[nodiscard]] Result<SurfacesReport> writeSurfaces(const std::filesystem::path& path, Bundle bundle,
                                                   const SurfacesOptions& options, Job& job);

}  // namespace stx
