#pragma once

#include <string>

#include "formats/video/video_table.hpp"
#include "lib/base/result.hpp"

namespace stx {

/// The module of compressed video, `stx_video.so`, and with it libavformat and libavcodec; the
/// first call loads them (about 100 ms). Looked for as the module of image codecs is, $STX_VIDEO
/// first. Error (unsupported) with every place that was tried and the Debian packages.
[[nodiscard]] Result<const video::Table*> loadVideo();

/// Whether compressed video can be read and written here.
struct VideoModule {
    bool present = false;
    std::string libraries;  ///< "libavformat 59.27.100, libavcodec 59.37.100"
    std::string reason;     ///< why it is not present
};
/// Loads the module to find out.
[[nodiscard]] VideoModule videoModule();

}  // namespace stx
