#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/geometry/camera.hpp"

namespace stx {

struct NamedCamera {
    std::string name;
    Camera camera;
    std::optional<double> time = {};  ///< seconds, where the file says it
    bool aligned = false;             ///< an export of ours says that refining moved it already
};

/// The cameras of a file, in its order, without any image: transforms.json (NeRF, nerfstudio,
/// Blender), camera_path.json (nerfstudio), MIV/RVS JSON, or our own cameras.json; distinguished by
/// their keys; or a COLMAP model (its folder or one of its files, cameras in the order of the
/// numbers in names). Lenses are left out, with a note. Each camera has its own intrinsics and
/// size; `size` is for those whose file does not tell it (without it 512x512, with a note). The
/// poses of a camera_path.json are taken out of nerfstudio's normalised world by `dataparser`, or
/// where it is empty by a dataparser_transforms.json beside the file; a note says so, or that there
/// is none. Errors: io, invalidInput with file and key.
[[nodiscard]] Result<std::vector<NamedCamera>> readCameraFile(
    const std::filesystem::path& path, Job& job, std::optional<glm::ivec2> size = {},
    const std::filesystem::path& dataparser = {});

}  // namespace stx
