#include "formats/images/codec_module.hpp"

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <system_error>

#include "formats/decoders/decoder_process.hpp"
#include "formats/files/module.hpp"
#include "formats/images/images.hpp"

namespace stx {

namespace {

namespace fs = std::filesystem;

Result<const codecs::Table*> load() {
    const DecoderKind& kind = decoders::kImages;
    auto table = openModule<codecs::Table>(placesOfModule(kind.variable, kind.module),
                                           codecs::kTableSymbol, codecs::kTableVersion);
    if (table) return table;
    return fail(ErrorCode::unsupported, "{}: {}; {}", kind.missing, table.error().message,
                kind.wayOut);
}

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
    if (needsCodecs(input) || holdsImageThatNeedsCodecs(folder)) prepareDecoder(decoders::kImages);
}

}  // namespace stx
