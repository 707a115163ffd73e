#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/geometry/camera.hpp"
#include "lib/model/sequence.hpp"

namespace stx {

namespace photos {
struct Photo;
}

/// What an image set says of itself, before a pixel is read.
struct ImageSetSummary {
    struct View {
        std::string name;
        Camera camera;          ///< in our axes; width and height are 0 when only its missing
                                ///< picture would tell them
        bool panorama = false;  ///< equirectangular: the camera has position and orientation only
        bool video = false;     ///< a frame of video files
        bool later = false;     ///< of a set that moves: another is shown at its first moment
        std::string colour;     ///< names as the set has them; empty where one file holds all
        std::string depth;
        std::vector<std::string> missing;  ///< those of the two that are not there
        bool lost = false;                 ///< tracking was, so that the camera has no meaning
    };
    std::string kind;  ///< one of imageSetKinds()
    std::string title;
    int frames = 1;     ///< of sets that have time
    Timeline timeline;  ///< theirs
    std::vector<View> views;
    std::uint64_t bytes = 0;  ///< of all files that the views name
    /// The kind needs options of `convert` for its cameras (--focal, --intrinsics): cameras here
    /// have names, but no meaning.
    bool camerasKnown = true;
    /// Of a photograph with depth what its file says; else null.
    std::shared_ptr<const photos::Photo> photo;
    /// What its camera follows from: "matrix", "focal35" (EXIF), "assumed".
    std::string cameraFrom;
};

/// Reads cameras and looks for the files that a set names. Errors: (io) the file or
/// folder does not exist; (invalidInput) it is not an image set, or its cameras cannot be read.
[[nodiscard]] Result<ImageSetSummary> summariseImageSet(const std::filesystem::path& path,
                                                        Job& job);

}  // namespace stx
