#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/exr/exr_file.hpp"
#include "formats/files/files.hpp"
#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

/// What the headers of an OpenEXR bundle tell, without a pixel decoded.
struct ExrBundleHeader {
    struct View {
        ReferenceView view;  ///< its images are empty
        bool normals = false, splats = false;
        std::int64_t points = -1;  ///< -1 = the file does not tell
        std::uint64_t bytes = 0;   ///< of the pixels in the file, compressed
    };
    std::string title;
    std::optional<Bounds> bounds;
    bool linear = false;  ///< colour was linear floats, not 8-bit sRGB
    std::vector<View> views;

    [[nodiscard]] const char* nodeKind() const;
};

/// Writes a bundle as one multi-part OpenEXR file, a part for each view (named as the view):
/// - R G B A: linear Rec. 709, premultiplied; half for 8-bit sRGB textures, which come back to the
///   bit (bled colours under alpha 0 are bled anew), float32 for linear ones;
/// - Z: planar distance, float32 exactly, +inf where there is no point (what OpenEXR's documents
/// ask
///   for; OpenImageIO's tools count it as Inf; Blender writes 1e10 instead, Nuke 1/z with 0);
/// - N.X N.Y N.Z and splatU.X .. splatV.Z: world vectors, float32 exactly, where the view has them.
/// Cameras stand in the standard attributes worldToCamera, worldToNDC, screenWindowCenter and
/// screenWindowWidth (float, for others) and exactly in `stx:` ones (see bundle_exr.cpp).
[[nodiscard]] Result<void> writeExrBundle(const Bundle& bundle, OutputFile& file, Job& job);
/// The same with creating and committing the file.
[[nodiscard]] Result<void> writeExrBundle(const Bundle& bundle, const std::filesystem::path& path,
                                          Job& job, OutputFile::Options options = {});

/// Reads what writeExrBundle() wrote. Parts of other programs are views, too, when they have Z and
/// worldToCamera; their planes are fitted to their depth, and distances of 1e9 and more, NaN and
/// those below 0 are no points.
[[nodiscard]] Result<Bundle> readExrBundle(ByteSpan bytes, std::string_view name, Job& job);
[[nodiscard]] Result<Bundle> readExrBundle(const std::filesystem::path& path, Job& job);
[[nodiscard]] Result<Bundle> readExrBundle(const ExrReader& reader, Job& job);

/// Cameras, sizes, bounds and bytes, in milliseconds.
[[nodiscard]] Result<ExrBundleHeader> readExrBundleHeader(const std::filesystem::path& path,
                                                          const Limits& limits);
[[nodiscard]] Result<ExrBundleHeader> readExrBundleHeader(const ExrReader& reader);

/// The attributes of a camera, its planes and depthBits in an OpenEXR part whose display window is
/// as large as part.displayWidth and displayHeight say; and back. Shared with atlases and frames.
void setExrCamera(ExrPart& part, const ReferenceView& view);
/// Standard attributes only, without planes.
void setExrCamera(ExrPart& part, const Camera& camera, double nearPlane, double farPlane);
/// Error (invalidInput) when there is none, or it makes no sense. Its images are empty.
[[nodiscard]] Result<ReferenceView> exrCamera(const ExrPart& part);

}  // namespace stx
