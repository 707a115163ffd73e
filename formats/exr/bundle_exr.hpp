#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/exr/environment_exr.hpp"
#include "formats/exr/exr_file.hpp"
#include "formats/files/files.hpp"
#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/view_table.hpp"

namespace stx {

/// What the header of one view says.
struct ExrViewHeader {
    ReferenceView view;  ///< its images are empty
    bool normals = false, splats = false;
    bool metallicRoughness = false, emissive = false;
    std::int64_t points = -1;  ///< -1 = the file does not say
    std::uint64_t bytes = 0;   ///< of the pixels in the file, compressed
    std::optional<ViewSummary> summary;
};

/// What the headers of an OpenEXR bundle say, without a pixel decoded.
struct ExrBundleHeader {
    std::string title;
    std::optional<Bounds> bounds;
    glm::dvec3 origin{0.0};                ///< as Bundle::origin
    std::optional<double> time, duration;  ///< as those of Bundle
    bool linear = false;                   ///< colour is linear floats, not 8-bit sRGB
    std::vector<ExrViewHeader> views;
    std::optional<ExrEnvironmentHeader> environment;

    [[nodiscard]] const char* nodeKind() const;
};

// clang-format off
/// Writes a bundle as one multi-part OpenEXR file, a part for each view (named as the view):
///  - R G B A: linear Rec. 709, premultiplied; half for 8-bit sRGB textures, which come back to the
///    bit (colours under alpha 0 are filled again from their neighbours), float32 for linear ones.
///  - Z: planar distance, float32 exactly, +inf where there is no point. That is what OpenEXR's
///    documentation asks for; Blender writes 1e10 instead, Nuke 1/z with 0.
///  - N.X N.Y N.Z and splatU.X .. splatV.Z: world vectors, float32 exactly, where the view has them.
///  - surface.metallic, surface.roughness (0..1), emissive.R emissive.G emissive.B (linear light
///    that R G B do not hold): float32 exactly, where the view has them.
///
/// Cameras are in the standard attributes worldToCamera, worldToNDC, screenWindowCenter and
/// screenWindowWidth (float, for other programs) and exactly in `stx:` ones (see bundle_exr.cpp).
/// The environment is a part of its own (environment_exr.hpp).
/// Views are written when they come: what their headers say of pixels (planes, points, bounds) is
/// put into the file at the end. `summarise`, if any: see SaveOptions.
/// Errors: what Bundle::check() says; files.
// clang-format on
[[nodiscard]] Result<void> writeExrViews(
    const ViewTable& table, const std::filesystem::path& path, Job& job,
    OutputFile::Options options = {},
    const std::function<ViewSummary(const ReferenceView&)>& summarise = {});

/// Reads what writeExrViews() wrote. Parts of other programs are views, too, when they have Z and
/// worldToCamera; their planes are fitted to their depth, and distances of 1e9 and more, NaN and
/// those below 0 are not points. The result passes Bundle::check().
[[nodiscard]] Result<Bundle> readExrBundle(ByteSpan bytes, std::string_view name, Job& job);
[[nodiscard]] Result<Bundle> readExrBundle(const std::filesystem::path& path, Job& job);
[[nodiscard]] Result<Bundle> readExrBundle(const ExrReader& reader, Job& job);
/// The same as a table of views whose pixels are read when they are asked for. Null for a file of
/// another program, whose planes are known with its pixels only.
[[nodiscard]] Result<std::unique_ptr<ViewTable>> openExrViews(const std::filesystem::path& path,
                                                              Job& job);

/// Cameras, sizes, bounds and bytes, in milliseconds.
[[nodiscard]] Result<ExrBundleHeader> readExrBundleHeader(const std::filesystem::path& path,
                                                          const Limits& limits);
[[nodiscard]] Result<ExrBundleHeader> readExrBundleHeader(const ExrReader& reader);

/// Views of other programs say nothing of their planes and points: both as readExrBundle() fits
/// them to the depth, which is read for it.
[[nodiscard]] Result<void> measureForeignViews(const ExrReader& reader, ExrBundleHeader& header);

/// The steps of readExrBundle(), for those who look at views that break rules (validation).
/// Error (unsupported) for a file of a newer version, (invalidInput) for another kind of content.
[[nodiscard]] Result<void> checkExrKind(const ExrReader& reader);
/// Whether we wrote this part as a view: it has stx:position.
[[nodiscard]] bool isOurView(const ExrPart& part);
/// Whether any part is such a view.
[[nodiscard]] bool isExrBundle(const ExrReader& reader);
/// Parts that are views: all of ours, and those of other programs with Z and a camera.
[[nodiscard]] std::vector<int> exrViewParts(const ExrReader& reader);
/// Memory that the images of a view take.
[[nodiscard]] std::uint64_t exrViewBytes(const ExrReader& reader, const ExrPart& part);
/// Reads the images of part `index` into a view without any check of what is in them. Only channels
/// that `part` lists are read: the part's own header, or a copy with fewer channels.
[[nodiscard]] Result<void> readExrView(const ExrReader& reader, int index, const ExrPart& part,
                                       ReferenceView& view);

/// The attributes of a camera, its planes and depthBits in an OpenEXR part whose display window is
/// as large as part.displayWidth and displayHeight say; and back. Shared with atlases and frames.
void setExrCamera(ExrPart& part, const ReferenceView& view);
/// Standard attributes only, without planes.
void setExrCamera(ExrPart& part, const Camera& camera, double nearPlane, double farPlane);
/// What the cameras of a file count from, as Bundle::origin, in its first part; 0 is left out.
void setExrOrigin(ExrPart& first, const glm::dvec3& origin);
[[nodiscard]] glm::dvec3 exrOrigin(const ExrReader& reader);
/// Whether another program has cut pixels off a view of ours, or put some around it: then what its
/// header says of them does not hold. `camera`: as exrCamera() gives it.
[[nodiscard]] bool isTrimmed(const ExrPart& part, const Camera& camera);
/// The view of a part's data window. Errors (invalidInput): the camera is missing, out of range, or
/// that of a picture of another size. Its images are empty.
[[nodiscard]] Result<ReferenceView> exrCamera(const ExrPart& part);

}  // namespace stx
