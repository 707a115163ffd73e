#include "formats/video/video_module.hpp"

#include <dlfcn.h>

#include <filesystem>

#include "formats/images/codec_module.hpp"

namespace stx {
namespace {

Result<const video::Table*> loadModule() {
    std::string tried;
    std::error_code ec;
    for (const auto& place : placesOfModule("STX_VIDEO", "stx_video.so")) {
        tried += tried.empty() ? "" : "; ";
        if (!std::filesystem::exists(place, ec)) {
            tried += fmt::format("'{}' does not exist", place);
            continue;
        }
        void* module = ::dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (!module) {
            const char* why = ::dlerror();
            tried += fmt::format("'{}': {}", place, why ? why : "cannot be loaded");
            continue;
        }
        using Entry = const video::Table* (*)();
        const auto entry = reinterpret_cast<Entry>(::dlsym(module, video::kTableSymbol));
        const video::Table* table = entry ? entry() : nullptr;
        if (table && table->version == video::kTableVersion) return table;
        tried += fmt::format("'{}' is of another version", place);
        ::dlclose(module);
    }
    return fail(ErrorCode::unsupported,
                "compressed video needs the module stx_video.so, which cannot be loaded: {}; "
                "install the Debian packages libavformat59, libavcodec59 and libswscale6, and stx "
                "with its module",
                tried);
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
