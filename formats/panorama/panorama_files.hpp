#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "formats/files/files.hpp"
#include "lib/panorama/panorama.hpp"

namespace stx {

/// Opens what `inputs` name as the pictures of a turning camera: files in any order, or one folder
/// or pattern (`name_%04d.jpg`) of numbered ones. Turned upright by their EXIF orientation; focal
/// lengths of EXIF are given. Some stay decoded, as far as a small part of the memory goes. Errors:
/// io, invalidInput, of decoding only when a picture is asked for. What the pictures lose as 8-bit
/// sRGB is a note when it is destroyed. `job` must outlive it.
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

struct PanoramaWriteOptions {
    int faceSize = 0;  ///< of a cube, pixels; 0 = see panoramaFaceSize()
    int jpegQuality = 92;
    bool noClobber = false;
};

/// The faces that a panorama of a width is written with; 0 = equirectangular: `faceSize`, else a
/// quarter of the width in folders and scenes.
[[nodiscard]] int panoramaFaceSize(const std::filesystem::path& path, int width, int faceSize);

/// Writes it whole or not at all, as an environment (saveEnvironment()): cube faces are VRML97's
/// (faceDirection()), and the panorama's middle is -Z. Errors: those of saveEnvironment(), io.
[[nodiscard]] Result<void> writePanorama(PanoramaImage panorama, const std::filesystem::path& path,
                                         const PanoramaWriteOptions& options, Job& job);
/// Writes a bundle or film again with the panorama as its environment. Errors: those of
/// openSequence() and saveSequence().
[[nodiscard]] Result<void> writePanoramaInto(PanoramaImage panorama,
                                             const std::filesystem::path& bundle,
                                             const std::filesystem::path& path,
                                             const PanoramaWriteOptions& options, Job& job);

}  // namespace stx
