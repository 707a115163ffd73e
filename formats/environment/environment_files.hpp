#pragma once

#include <filesystem>
#include <memory>

#include "lib/base/job.hpp"
#include "lib/model/environment.hpp"

namespace stx {

/// Opens an environment:
///  - an equirectangular picture (.png, .jpg, HEIC and what else decodeImage() reads), twice as
///    wide as high, -Z in the middle, +Y up;
///  - an OpenEXR file: a part with the attribute `envmap`, latlong or cube, else a picture twice as
///    wide as high (environment_exr.hpp);
///  - a folder of six faces named front, back, left, right, top and bottom (any prefix that ends
///    in _ before), in VRML97's orientation (CubeFace), or one with environment.exr in it;
///  - an MPEG-4 presentation (.mp4, .bt, .xmt): the Background that it shows.
///
/// Errors: io; invalidInput, which says what was found and what is expected.
[[nodiscard]] Result<std::shared_ptr<const Environment>> openEnvironment(
    const std::filesystem::path& path, Job& job);

struct EnvironmentSaveOptions {
    int faceSize = 0;        ///< of six faces, pixels; 0: as the environment needs (cubeSizeOf())
    int jpegQuality = 0;     ///< faces as JPEG, 1..100; 0: PNG. A .jpg has 92 where it is 0
    bool noClobber = false;  ///< error (io) when the target exists
};

/// Writes an environment, whole or not at all, by the target's ending: .png and .jpg
/// (equirectangular, 8-bit sRGB), .exr (latlong, or cube where it is one or faceSize is given;
/// nothing is lost), .mp4, .bt and .xmt (a scene with a Background and nothing else), no ending: a
/// folder of six faces. Pictures without a scene hold the environment in the world's axes, with its
/// sky and ground. What is lossy is noted. Errors: usage (another ending, options out of range),
/// Environment::check(), io.
[[nodiscard]] Result<void> saveEnvironment(const Environment& environment,
                                           const std::filesystem::path& target,
                                           const EnvironmentSaveOptions& options, Job& job);

}  // namespace stx
