#pragma once

#include <filesystem>
#include <vector>

#include "formats/validate/rules.hpp"
#include "lib/base/job.hpp"
#include "lib/model/atlas.hpp"
#include "lib/model/bundle.hpp"

namespace stx {

struct ValidateOptions {
    /// Decode the images and look at every pixel; without, only headers are read.
    bool pixels = true;
};

/// Every rule that a file breaks, in its order; empty when it breaks none. For .mp4, .bt, .xmt,
/// bundles and atlases in OpenEXR, atlas folders, image sets (each frame of one that moves); of a
/// mesh, whether it can be read.
/// Reading goes on behind a broken rule as far as it can; what cannot be read at all breaks rule
/// 1001. Errors: (io) the file does not exist or cannot be opened; (invalidInput) it is a picture;
/// (usage) an image set of a kind that needs options; (failed) stopped.
[[nodiscard]] Result<std::vector<Finding>> validateFile(const std::filesystem::path& path,
                                                        const ValidateOptions& options, Job& job);

/// The rules on cameras, depths, normals and splats, for a bundle of any container. Needs no
/// check() before.
[[nodiscard]] std::vector<Finding> validate(const Bundle& bundle);
/// The rules on cameras, depths, normals and the layout of an atlas. Needs no check() before.
[[nodiscard]] std::vector<Finding> validate(const Atlas& atlas);

}  // namespace stx
