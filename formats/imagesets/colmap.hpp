#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/files.hpp"
#include "formats/imagesets/lens.hpp"

/// COLMAP's models, text and binary.
namespace stx::imagesets {

struct ColmapCamera {
    int width = 0, height = 0;
    double fx = 1, fy = 1, cx = 0, cy = 0;  ///< pixels; the first pixel's centre is (0.5, 0.5)
    Lens lens;
    std::optional<Error> unknown;  ///< its model is not read: an error where an image has it
};

struct ColmapImage {
    std::string name;
    std::uint32_t camera = 0;
    glm::dvec4 rotation{0, 0, 0, 1};  ///< camera from world, x y z w
    glm::dvec3 translation{0.0};
};

/// How the cameras.txt of our own exports begins.
inline constexpr std::string_view kWrittenByUs = "# written by stx";

using ColmapCameras = std::map<std::uint32_t, ColmapCamera>;

/// Errors name the line, or the camera or image and the byte. Cameras of lens models that cannot be
/// undone (FULL_OPENCV, FOV...) are `unknown`.
[[nodiscard]] Result<ColmapCameras> parseColmapCameras(ByteSpan bytes, bool binary,
                                                       const Limits& limits);
[[nodiscard]] Result<std::vector<ColmapImage>> parseColmapImages(ByteSpan bytes, bool binary,
                                                                 const Limits& limits);

}  // namespace stx::imagesets
