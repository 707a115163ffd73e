#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "formats/files/files.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/render/api/frame_picture.hpp"

namespace stx {

/// Files that a rendered picture can become.
enum class FrameFormat {
    png,   ///< 8-bit sRGB, straight alpha, tagged
    jpeg,  ///< 8-bit sRGB without alpha; lossy; at most 65500 pixels a side
    exr,   ///< linear, premultiplied; depth, normals and albedo with it
    tiff,  ///< as PNG
    webp,  ///< as PNG, lossless; at most 16383 pixels a side
};

/// The format by a name's ending: .png, .jpg, .jpeg, .exr, .tif, .tiff, .webp in any case; "-" is
/// PNG. Error (usage) else.
[[nodiscard]] Result<FrameFormat> frameFormat(const std::filesystem::path& path);

/// Error (usage) for a picture that has no room in the format of its name.
[[nodiscard]] Result<void> checkFrameSize(const std::filesystem::path& path, int width, int height);

struct FrameOptions {
    /// Put behind the picture, which gets opaque: sRGB-coded 0..1. Without it PNG and EXR keep
    /// their alpha, and JPEG has black behind.
    std::optional<glm::vec3> background;
    int jpegQuality = 92;  ///< 1..100
    int pngLevel = 1;      ///< 0 (fast, large) to 9
    bool noClobber = false;
    /// EXR: gets into the standard attributes worldToCamera, worldToNDC, screenWindow...
    std::optional<Camera> camera;
    glm::dvec3 origin{0.0};  ///< EXR: what the camera counts from; gets into stx:origin
    /// EXR: the picture is equirectangular (renderAround()): it gets the attribute envmap, and Z is
    /// the length of the ray.
    bool around = false;
};

/// A frame in the types of an OpenEXR file, which take half of the memory.
struct ExrFrame {
    /// Channels of type half, each with its plane; albedo that is the colour has no planes of its
    /// own.
    std::vector<std::pair<std::string, int>> channels;
    std::unique_ptr<std::uint16_t[]> planes;  ///< of width x height, one after the other
    int width = 0, height = 0;
    Image<float> depth;  ///< empty where the frame has none
};

/// Writes one picture whole or not at all, by the name's ending. Linear frames are coded as sRGB
/// for all but EXR, sRGB-coded ones are made linear for EXR. EXR channels: R G B A (half,
/// premultiplied), Z (float32, +inf where nothing was drawn), N.X N.Y N.Z (half) when there are
/// normals, albedo.R G B A (half) when there is albedo. TIFF and WebP need the module of image
/// codecs: error (unsupported) without it. Safe to call from several threads.
[[nodiscard]] Result<void> writeFrame(const Frame& frame, const std::filesystem::path& path,
                                      const FrameOptions& options = {});
/// The 8-bit picture that a frame becomes in a file that is not EXR: with the background behind it,
/// for JPEG a black one at least.
[[nodiscard]] Rgba8Image pictureOf(const Frame& frame, FrameFormat format,
                                   const std::optional<glm::vec3>& background);
/// What a frame becomes in an EXR file: linear, with the background behind it.
[[nodiscard]] ExrFrame exrFrameOf(const Frame& frame, const std::optional<glm::vec3>& background);
/// Writes what exrFrameOf() gave as writeFrame() would the frame. `path` ends in .exr.
[[nodiscard]] Result<void> writeExrFrame(const ExrFrame& frame, const std::filesystem::path& path,
                                         const FrameOptions& options = {});
/// Writes what pictureOf() gave as writeFrame() would the frame. Error (failed) for EXR.
[[nodiscard]] Result<void> writePicture(const Rgba8Image& picture,
                                        const std::filesystem::path& path,
                                        const FrameOptions& options = {});
/// PNG or JPEG as bytes. Error (failed) for the others, which are written to files only.
[[nodiscard]] Result<Bytes> encodePicture(const Rgba8Image& picture, FrameFormat format,
                                          const FrameOptions& options = {});

}  // namespace stx
