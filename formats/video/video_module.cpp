#include "formats/video/video_module.hpp"

#include "formats/files/module.hpp"

namespace stx {
namespace {

Result<const video::Table*> loadModule() {
    auto table = openModule<video::Table>("STX_VIDEO", "stx_video.so", video::kTableSymbol,
                                          video::kTableVersion);
    if (table) return table;
    return fail(ErrorCode::unsupported,
                "compressed video needs the module stx_video.so, which cannot be loaded: {}; "
                "install the Debian packages libavformat59, libavcodec59 and libswscale6, and stx "
                "with its module",
                table.error().message);
}

}  // namespace

Result<const video::Table*> loadVideo() {
    static const Result<const video::Table*> loaded = loadModule();
    return loaded;
}

VideoModule videoModule() {
    const auto table = loadVideo();
    if (!table) return {false, {}, table.error().message};
    return {true, (*table)->libraries(), {}};
}

}  // namespace stx
