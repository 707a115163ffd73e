// Runs a fuzz target over files without libFuzzer: each file as it is, cut at every length, and
// with single bytes changed; those that a fuzzer has grown (grown_*) at a few lengths and with few
// changes. The same runs each time. `--every N` takes each N-th length and change only.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Input = std::vector<std::uint8_t>;

/// Files up to this size are cut at every length; larger ones at that many lengths.
constexpr std::size_t kCuts = 6000;
constexpr int kFlips = 300;
/// As many cuts and changes of a grown file: it is one of many changes already.
constexpr int kOfGrown = 16;

std::size_t runs = 0, every = 1;

void run(const std::uint8_t* data, std::size_t size) {
    // A copy of exactly that size, so that a sanitizer sees reads past its end.
    const Input exact(data, data + size);
    LLVMFuzzerTestOneInput(exact.data(), exact.size());
    ++runs;
}

void replay(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    Input bytes{std::istreambuf_iterator<char>(in), {}};
    run(bytes.data(), bytes.size());
    const bool grown = path.filename().string().starts_with("grown_");
    const std::size_t step = (bytes.size() / (grown ? kOfGrown : kCuts) + 1) * every;
    for (std::size_t length = 0; length < bytes.size(); length += step) run(bytes.data(), length);
    if (bytes.empty()) return;
    std::mt19937 random(static_cast<std::uint32_t>(bytes.size()));
    for (int i = 0; i < (grown ? kOfGrown : kFlips); ++i) {
        Input changed = bytes;
        const int changes = 1 + i % 3;
        for (int k = 0; k < changes; ++k) {
            const std::size_t at = random() % changed.size();
            changed[at] = i % 2 == 0 ? static_cast<std::uint8_t>(changed[at] ^ (1u << random() % 8))
                                     : static_cast<std::uint8_t>(random());
        }
        if (static_cast<std::size_t>(i) % every == 0) run(changed.data(), changed.size());
    }
}

}  // namespace

int main(int argc, char** argv) {
    std::vector<std::filesystem::path> files;
    for (int i = 1; i < argc; ++i) {
        if (std::string(argv[i]) == "--every" && i + 1 < argc) {
            every = std::max(1ul, std::stoul(argv[++i]));
            continue;
        }
        const std::filesystem::path path(argv[i]);
        std::error_code ignored;
        if (std::filesystem::is_directory(path, ignored)) {
            for (const auto& entry : std::filesystem::recursive_directory_iterator(path))
                if (entry.is_regular_file()) files.push_back(entry.path());
        } else if (std::filesystem::is_regular_file(path, ignored)) {
            files.push_back(path);
        }
    }
    std::sort(files.begin(), files.end());
    for (const auto& file : files) replay(file);
    std::printf("%zu inputs from %zu files\n", runs, files.size());
    return files.empty() ? 1 : 0;
}
