#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "formats/files/files.hpp"
#include "lib/panorama/panorama.hpp"

namespace stx {

/// Opens what `inputs` name as the pictures of a turning camera: files in any order, or one folder
/// or pattern (`name_%04d.jpg`) of numbered ones. Turned upright by their EXIF orientation; focal
/// lengths of EXIF are told. Some stay decoded, as far as a small part of the memory goes. Errors:
/// io, invalidInput, of decoding only when a picture is asked for. A note when colours are rounded
/// to 8 bits. `job` must outlive it.
[[nodiscard]] Result<std::unique_ptr<PictureSource>> openPanoramaPictures(
    const std::vector<std::filesystem::path>& inputs, Job& job);

/// What a panorama can be written as.
enum class PanoramaFormat {
    picture,  ///< equirectangular, 8-bit sRGB (.png, .jpg, .tif, .webp), see PanoramaImage
    exr,      ///< linear half floats with the attribute `envmap`: latlong, or cube with a face size
    folder,   ///< front.png, back.png, left.png, right.png, top.png, bottom.png
    scene,    ///< a Background node (.mp4, .bt, .xmt)
};

/// By the ending; any other name is a folder's.
[[nodiscard]] PanoramaFormat panoramaFormat(const std::filesystem::path& path);

/// Error (unsupported) when panoramas are not written as that.
[[nodiscard]] Result<void> checkPanoramaFormat(const std::filesystem::path& path);

struct PanoramaWriteOptions {
    int faceSize = 0;  ///< of a cube; 0 = a quarter of the panorama's width. .exr: 0 = latlong
    int jpegQuality = 92;
    bool noClobber = false;
};

/// Writes a scene that has a Background of these faces and nothing else (.mp4, .bt, .xmt). Error
/// for now: unsupported.
[[nodiscard]] Result<void> writePanoramaScene(const PanoramaFaces& faces,
                                              const std::filesystem::path& path,
                                              const PanoramaWriteOptions& options, Job& job);

/// Writes it whole or not at all. Cube faces are VRML97's (faceDirection()); OpenEXR's maps have
/// its own axes, in which the panorama's middle is +Z (ours turned by half a turn about Y), and
/// pixels on the very edges. Errors: io; unsupported: a scene.
[[nodiscard]] Result<void> writePanorama(const PanoramaImage& panorama,
                                         const std::filesystem::path& path,
                                         const PanoramaWriteOptions& options, Job& job);

}  // namespace stx
