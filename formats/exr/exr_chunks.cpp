#include "formats/exr/exr_chunks.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/files/deflate.hpp"
#include "lib/base/parallel.hpp"

namespace stx::exr {
namespace {

/// Pixels of a chunk, in the coordinates of the data window.
struct ChunkPixels {
    int x = 0, y = 0, width = 0, height = 0;
};

/// Multiples of `step` among `count` numbers from `first` on.
std::uint64_t samplesOf(int first, int count, int step) {
    const auto before = [step](std::int64_t n) {  // multiples below n, from some point on
        return n >= 0 ? (n + step - 1) / step : -(-n / step);
    };
    return static_cast<std::uint64_t>(before(std::int64_t{first} + count) - before(first));
}

std::uint64_t samplesOf(const ChunkPixels& box, const ExrChannel& channel) {
    return samplesOf(box.x, box.width, channel.xSampling) *
           samplesOf(box.y, box.height, channel.ySampling);
}

std::uint64_t bytesOf(const ExrChannel& channel) {
    return channel.type == ExrChannel::Type::half ? 2 : 4;
}

/// PXR24 keeps three bytes of a float.
std::uint64_t pxr24BytesOf(const ExrChannel& channel) {
    return channel.type == ExrChannel::Type::float32 ? 3 : bytesOf(channel);
}

template <class BytesOf>
std::uint64_t totalOf(const ExrPart& part, const ChunkPixels& box, const BytesOf& each) {
    std::uint64_t total = 0;
    for (const auto& channel : part.channels) total += samplesOf(box, channel) * each(channel);
    return total;
}

bool inflatesTo(ByteSpan stored, std::uint64_t size) {
    // Deflate gives at most 1032 bytes for one; memory is taken for no more.
    if (size / 1032 > stored.size()) return false;
    const auto room = std::make_unique_for_overwrite<std::byte[]>(size);
    return inflateZlib(stored, {room.get(), static_cast<std::size_t>(size)});
}

/// A count below 0 stands before that many bytes as they are, another one before a byte that comes
/// once more than the count.
bool runsGive(ByteSpan stored, std::uint64_t size) {
    std::uint64_t given = 0;
    for (std::size_t at = 0; at < stored.size();) {
        const int count = static_cast<signed char>(stored[at]);
        given += static_cast<std::uint64_t>(count < 0 ? -count : count + 1);
        at += count < 0 ? 1 + static_cast<std::size_t>(-count) : 2;
        if (at > stored.size()) return false;
    }
    return given == size;
}

enum class DwaScheme { unknown, lossyDct, rle };

/// Which channels DWA codes how: the end of a name, a type, a scheme. The last that fits counts.
struct DwaRule {
    std::string_view ending;
    bool anyCase = false;
    ExrChannel::Type type{};
    DwaScheme scheme{};
};

bool sameWord(std::string_view a, std::string_view b, bool anyCase) {
    const auto low = [anyCase](char c) {
        return anyCase && c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    };
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [&](char x, char y) { return low(x) == low(y); });
}

constexpr std::array kTypes = {ExrChannel::Type::uint32, ExrChannel::Type::half,
                               ExrChannel::Type::float32};  // in the file's order

/// The rules of files before they were stored in them.
std::vector<DwaRule> firstRules() {
    std::vector<DwaRule> rules;
    for (const auto type : kTypes) {
        rules.push_back({"a", true, type, DwaScheme::rle});
        if (type == ExrChannel::Type::uint32) continue;
        for (const char* ending : {"r", "g", "b", "y", "by", "ry"})
            rules.push_back({ending, true, type, DwaScheme::lossyDct});
    }
    return rules;
}

/// Empty when they are damaged; `text` begins with their length.
std::optional<std::vector<DwaRule>> rulesOf(ByteSpan text) {
    if (text.size() < 2) return std::nullopt;
    const auto size = std::to_integer<std::size_t>(text[0]) | std::to_integer<std::size_t>(text[1])
                                                                  << 8;
    if (size < 2 || size > text.size()) return std::nullopt;
    std::string_view left(reinterpret_cast<const char*>(text.data()) + 2, size - 2);
    std::vector<DwaRule> rules;
    while (!left.empty()) {
        const std::size_t end = left.find('\0');
        if (end == std::string_view::npos || left.size() < end + 3) return std::nullopt;
        const auto how = static_cast<unsigned char>(left[end + 1]);
        const auto type = static_cast<unsigned char>(left[end + 2]);
        const unsigned scheme = how >> 2 & 3u;
        if (type >= kTypes.size() || scheme > 2) return std::nullopt;
        rules.push_back(
            {left.substr(0, end), (how & 1u) != 0, kTypes[type], static_cast<DwaScheme>(scheme)});
        left.remove_prefix(end + 3);
    }
    return rules;
}

/// What its header claims, against what the channels take (ImfDwaCompressor.cpp, "Data layout").
bool isWholeDwa(ByteSpan stored, const ExrPart& part, const ChunkPixels& box) {
    enum Size {
        version,
        unknown,
        unknownPacked,
        acPacked,
        dcPacked,
        rlePacked,
        rle,
        rleRaw,
        ac,
        dc
    };
    constexpr std::size_t kSizes = 11;
    if (stored.size() < kSizes * 8) return false;
    std::array<std::uint64_t, kSizes> sizes{};
    for (std::size_t i = 0; i < kSizes; ++i) {
        for (std::size_t b = 8; b-- > 0;)
            sizes[i] = sizes[i] << 8 | std::to_integer<std::uint64_t>(stored[i * 8 + b]);
    }
    const auto rules =
        sizes[version] < 2 ? std::optional(firstRules()) : rulesOf(stored.subspan(kSizes * 8));
    if (!rules) return false;
    std::uint64_t plain = 0, runs = 0, blocks = 0;
    for (const auto& channel : part.channels) {
        const std::string_view name = channel.name;
        const auto ending = name.substr(name.rfind('.') + 1);
        auto scheme = DwaScheme::unknown;
        for (const auto& rule : *rules) {
            if (rule.type == channel.type && sameWord(ending, rule.ending, rule.anyCase))
                scheme = rule.scheme;
        }
        const std::uint64_t across = samplesOf(box.x, box.width, channel.xSampling);
        const std::uint64_t down = samplesOf(box.y, box.height, channel.ySampling);
        if (scheme == DwaScheme::unknown) plain += across * down * bytesOf(channel);
        if (scheme == DwaScheme::rle) runs += across * down * bytesOf(channel);
        if (scheme == DwaScheme::lossyDct) blocks += (across + 7) / 8 * ((down + 7) / 8);
    }
    // Each block has its mean and, if only to say that there are none, a word of coefficients.
    if (sizes[unknown] != plain || sizes[rleRaw] != runs || sizes[dc] != blocks ||
        sizes[ac] < blocks)
        return false;
    const std::uint64_t packed[] = {sizes[unknownPacked], sizes[rlePacked], sizes[dcPacked],
                                    sizes[acPacked]};
    const std::uint64_t holds[] = {plain, runs, blocks, blocks};
    for (std::size_t i = 0; i < 4; ++i) {
        if (holds[i] != 0 && packed[i] == 0) return false;
    }
    return true;
}

bool isWhole(ByteSpan stored, const ExrPart& part, const ChunkPixels& box) {
    const std::uint64_t raw = totalOf(part, box, bytesOf);
    // What packing would not make smaller is stored as it is.
    if (stored.size() >= raw) return stored.size() == raw;
    if (stored.empty()) return false;
    const std::string_view by = part.compression;
    if (by == "none") return false;
    if (by == "rle") return runsGive(stored, raw);
    if (by == "zip" || by == "zips") return inflatesTo(stored, raw);
    if (by == "pxr24") return inflatesTo(stored, totalOf(part, box, pxr24BytesOf));
    if (by == "dwaa" || by == "dwab") return isWholeDwa(stored, part, box);
    return true;  // PIZ and B44, whose decoders miss what is not there
}

}  // namespace

int linesOfChunk(std::string_view compression) {
    constexpr std::pair<std::string_view, int> kLines[] = {
        {"none", 1},   {"rle", 1},  {"zips", 1},  {"zip", 16},  {"piz", 32},
        {"pxr24", 16}, {"b44", 32}, {"b44a", 32}, {"dwaa", 32}, {"dwab", 256}};
    for (const auto& [name, lines] : kLines) {
        if (name == compression) return lines;
    }
    return 0;
}

Result<void> checkChunks(const ExrPart& part, const ChunkLayout& layout, const ExrChunks& chunks,
                         const ReadAt& readAt) {
    const bool tiled = layout.tileWidth > 0;
    const int stepX = tiled ? layout.tileWidth : part.width;
    const int stepY = tiled ? layout.tileHeight : linesOfChunk(part.compression);
    if (stepX < 1 || stepY < 1) return {};  // a compression of later days: the library's matter
    const std::int64_t across = (std::int64_t{part.width} + stepX - 1) / stepX;
    const std::int64_t down = (std::int64_t{part.height} + stepY - 1) / stepY;
    const auto count = static_cast<std::size_t>(across * down);
    if (chunks.offsets.size() < count)
        return fail(ErrorCode::invalidInput,
                    "its table of chunks is damaged: it names {} of the {} that its pixels take",
                    chunks.offsets.size(), count);
    const auto boxOf = [&](std::size_t i) {
        ChunkPixels box;
        const auto x = static_cast<std::int64_t>(i) % across * stepX;
        const auto y = static_cast<std::int64_t>(i) / across * stepY;
        box.x = static_cast<int>(x);
        box.y = static_cast<int>(y);
        box.width = static_cast<int>(std::min<std::int64_t>(stepX, part.width - x));
        box.height = static_cast<int>(std::min<std::int64_t>(stepY, part.height - y));
        return box;
    };
    const auto isGood = [&](std::size_t i) {
        ChunkPixels box = boxOf(i);
        box.x += layout.firstX;
        box.y += layout.firstY;
        // The part where there are several, the first line or a tile's place, the size.
        std::vector<std::int32_t> expected;
        if (layout.part >= 0) expected.push_back(layout.part);
        if (tiled) {
            expected.push_back(static_cast<std::int32_t>(static_cast<std::int64_t>(i) % across));
            expected.push_back(static_cast<std::int32_t>(static_cast<std::int64_t>(i) / across));
            expected.insert(expected.end(), {0, 0});  // the largest level
        } else {
            expected.push_back(box.y);
        }
        std::vector<std::int32_t> head(expected.size() + 1);
        const std::size_t headBytes = head.size() * sizeof(std::int32_t);
        if (!readAt(chunks.offsets[i], head.data(), headBytes)) return false;
        const std::int32_t size = head.back();
        head.pop_back();
        if (head != expected || size < 1 ||
            static_cast<std::uint64_t>(size) > totalOf(part, box, bytesOf))
            return false;
        const auto stored =
            std::make_unique_for_overwrite<std::byte[]>(static_cast<std::size_t>(size));
        return readAt(chunks.offsets[i] + headBytes, stored.get(),
                      static_cast<std::size_t>(size)) &&
               isWhole({stored.get(), static_cast<std::size_t>(size)}, part, box);
    };
    // The first one is named, on any number of threads.
    std::atomic<std::size_t> firstBad = count;
    parallelFor(0, count, [&](std::size_t i) {
        if (i > firstBad || isGood(i)) return;
        std::size_t known = firstBad;
        while (i < known && !firstBad.compare_exchange_weak(known, i)) {
        }
    });
    if (firstBad == count) return {};
    const ChunkPixels box = boxOf(firstBad);
    return fail(ErrorCode::invalidInput,
                "the {} of {}x{} pixels at {},{} is damaged: it does not hold all of its pixels; "
                "the file was cut off or changed",
                tiled ? "tile" : "block", box.width, box.height, box.x, box.y);
}

}  // namespace stx::exr
