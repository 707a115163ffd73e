#pragma once

#include <filesystem>

#include "formats/files/files.hpp"
#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/sequence.hpp"

namespace stx {

struct ExportOptions {
    enum class Kind {
        transforms,  ///< transforms.json with images/ and depth/
        miv,         ///< NAME.json of MIV with NAME_color and NAME_depth16 files
        colmap,      ///< COLMAP's dense workspace: images/, sparse/, stereo/depth_maps/ (floats);
                     ///< perspective cameras only, planes are fitted again when it is read
    };
    Kind kind = Kind::transforms;
    enum class Depth {
        exr,  ///< OpenEXR floats, which come back exactly
        png,  ///< 16 bits: millimetres (or what fits small and large scenes) in transforms.json,
              ///< normalised disparity in MIV, with a note of the rounding
        npy,  ///< NumPy's floats, as exact; transforms.json only
    };
    Depth depth = Depth::exr;
    /// Linear colour as PNG of 16 bits, sRGB, instead of OpenEXR. A note says when that rounds or
    /// clips; colours that were PNG of 16 bits come back to the bit. Not of COLMAP's workspace.
    bool linearAsPng = false;
    bool noClobber = false;
};

/// Writes views as an image set: a folder that appears whole or not at all. They are written when
/// they are read, which takes the memory of one for each thread. Cameras are exact;
/// 8-bit colour is PNG with its coverage, linear colour OpenEXR or PNG. Normals and splats are
/// dropped with a note. Cameras are in the world's coordinates, the bundle's origin added (it is
/// kept as stx:origin). The environment is environment.exr, named as stx:environment (not for
/// COLMAP). readImageSet() gives the same bundle again. Background views are left out of COLMAP's
/// workspace, which has no mark for them, with a note. Errors: io; invalidInput for what the kind
/// cannot say, and for COLMAP's workspace of background views alone; (usage) Depth::npy of another
/// kind than transforms.
[[nodiscard]] Result<void> exportViews(const ViewTable& table, const std::filesystem::path& folder,
                                       const ExportOptions& options, Job& job);

/// The same of a sequence: transforms.json with `time` and `camera`, a picture and a depth for each
/// frame of a view; frames that repeat the one before name its files. openImageSet() gives the same
/// sequence again. A sequence of one frame is exported as its views. Errors: as exportViews();
/// (usage) another kind, which has one moment only.
[[nodiscard]] Result<void> exportFrames(Sequence& frames, const std::filesystem::path& folder,
                                        const ExportOptions& options, Job& job);

}  // namespace stx
