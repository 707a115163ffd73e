#include "formats/images/codec_module.hpp"

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>

#include "formats/files/module.hpp"
#include "formats/images/images.hpp"

namespace stx {

namespace {

namespace fs = std::filesystem;

Result<const codecs::Table*> load() {
    auto table = openModule<codecs::Table>("STX_CODECS", "stx_codecs.so", codecs::kTableSymbol,
                                           codecs::kTableVersion);
    if (table) return table;
    return fail(ErrorCode::unsupported,
                "the image codecs (stx_codecs.so, with OpenImageIO) cannot be loaded: {}; install "
                "the stx package whole, or name the module in STX_CODECS",
                table.error().message);
}

/// Waits for the loading at the process's end: unloading while loading crashes.
class Preloader {
  public:
    Preloader() {
        try {
            thread_ = std::thread([] { (void)loadCodecs(); });
        } catch (const std::system_error&) {
            // No thread to be had: it is loaded when it is needed.
        }
    }
    ~Preloader() {
        if (thread_.joinable()) thread_.join();
    }

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
