#include "formats/images/codec_module.hpp"

#include <dlfcn.h>
#include <link.h>
#include <sys/auxv.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "formats/images/images.hpp"

namespace stx {

namespace {

namespace fs = std::filesystem;

/// The folder of the library or program that this code is linked into; empty when unknown.
fs::path ownFolder() {
    std::error_code ec;
    static const char inThisObject = 0;
    Dl_info info = {};
    link_map* object = nullptr;
    const bool found =
        ::dladdr1(&inThisObject, &info, reinterpret_cast<void**>(&object), RTLD_DL_LINKMAP) != 0;
    // The program itself has no name there.
    const bool isLibrary = found && object && object->l_name && *object->l_name;
    auto self = fs::canonical(isLibrary ? object->l_name : "/proc/self/exe", ec);
    // Without /proc, as in many a chroot: the name that the program was started by.
    const auto name = reinterpret_cast<const char*>(::getauxval(AT_EXECFN));
    if (ec && !isLibrary && name) self = fs::canonical(name, ec);
    return self.parent_path();
}

Result<const codecs::Table*> load() {
    std::string tried;
    std::error_code ec;
    for (const auto& place : placesOfModule("STX_CODECS", "stx_codecs.so")) {
        tried += tried.empty() ? "" : "; ";
        if (!fs::exists(place, ec)) {
            tried += fmt::format("'{}' does not exist", place);
            continue;
        }
        void* module = ::dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (!module) {
            const char* why = ::dlerror();
            tried += fmt::format("'{}': {}", place, why ? why : "cannot be loaded");
            continue;
        }
        using Entry = const codecs::Table* (*)();
        const auto entry = reinterpret_cast<Entry>(::dlsym(module, codecs::kTableSymbol));
        const codecs::Table* table = entry ? entry() : nullptr;
        if (table && table->version == codecs::kTableVersion) return table;
        tried += fmt::format("'{}' is of another version", place);
        ::dlclose(module);
    }
    return fail(ErrorCode::unsupported,
                "the image codecs (stx_codecs.so, with OpenImageIO) cannot be loaded: {}; install "
                "the stx package whole, or name the module in STX_CODECS",
                tried);
}

/// Waits for the loading at the process's end: unloading while loading crashes.
class Preloader {
  public:
    Preloader() : thread_([] { (void)loadCodecs(); }) {}
    ~Preloader() { thread_.join(); }

  private:
    std::thread thread_;
};

bool hasEnding(const fs::path& file, std::initializer_list<std::string_view> endings) {
    std::string ending = file.extension().string();
    for (char& c : ending) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

bool needsCodecs(const fs::path& file) {
    return hasEnding(file, {".tif", ".tiff", ".tga", ".bmp", ".webp", ".gif", ".hdr", ".psd",
                            ".pnm", ".ppm",  ".pgm", ".pbm", ".dds",  ".dpx", ".jp2", ".j2k",
                            ".j2c", ".jpc",  ".sgi", ".rgb", ".rgba", ".bw"});
}

bool holdsImageThatNeedsCodecs(const fs::path& folder) {
    constexpr int kMostFiles = 1000;  // a look must not take longer than the loading
    std::error_code ec;
    int files = 0;
    for (fs::directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec)) {
        if (needsCodecs(it->path())) return true;
        if (++files == kMostFiles) break;
    }
    return false;
}

}  // namespace

std::vector<std::string> placesOfModule(const char* variable, const char* module) {
    // Somebody who names a module wants that one and no other.
    if (const char* named = std::getenv(variable); named && *named) return {named};
    const fs::path file = fs::path("stx") / module;
    const fs::path folder = ownFolder();
    std::vector<std::string> places;
    if (!folder.empty()) {
        places.push_back(folder / file);  // of lib/libstx.so
        // Of bin/stx, installed or in the build tree.
        places.push_back((folder / STX_LIB_FROM_BIN / file).lexically_normal());
    }
    return places;
}

Result<const codecs::Table*> loadCodecs() {
    static const Result<const codecs::Table*> loaded = load();
    return loaded;
}

void preloadCodecs(const fs::path& input) {
    // These are read without OpenImageIO, whatever lies beside them.
    if (hasEnding(input, {".png", ".jpg", ".jpeg", ".exr", ".mp4", ".xmt", ".bt"})) return;
    std::error_code ec;
    const fs::path folder = fs::is_directory(input, ec) ? input : folderOf(input);
    if (needsCodecs(input) || holdsImageThatNeedsCodecs(folder)) {
        static const Preloader preloader;
    }
}

}  // namespace stx
