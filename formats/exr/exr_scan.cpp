#include <algorithm>
#include <cstring>
#include <string_view>
#include <utility>

#include "formats/exr/exr_file.hpp"

namespace stx {

namespace {

/// A cursor over the header's bytes; every read is checked.
class Cursor {
  public:
    using ReadAt = std::function<bool(std::uint64_t offset, void* to, std::size_t size)>;
    Cursor(const ReadAt& readAt, std::uint64_t size) : readAt_(readAt), size_(size) {}

    bool read(void* to, std::size_t count) {
        if (count > size_ - at_) return false;
        auto* out = static_cast<char*>(to);
        while (count > 0) {
            const std::size_t inBlock = static_cast<std::size_t>(at_ - blockAt_);
            if (at_ < blockAt_ || inBlock >= blockSize_) {
                blockAt_ = at_;
                blockSize_ =
                    static_cast<std::size_t>(std::min<std::uint64_t>(sizeof(block_), size_ - at_));
                if (!readAt_(blockAt_, block_, blockSize_)) return false;
                continue;
            }
            const std::size_t n = std::min(count, blockSize_ - inBlock);
            std::memcpy(out, block_ + inBlock, n);
            out += n;
            at_ += n;
            count -= n;
        }
        return true;
    }
    bool skip(std::uint64_t count) {
        if (count > size_ - at_) return false;
        at_ += count;
        return true;
    }
    /// A string up to its zero byte; attribute names and types have at most 255.
    bool readName(std::string& name) {
        name.clear();
        char c = 0;
        while (name.size() < 256) {
            if (!read(&c, 1)) return false;
            if (c == 0) return true;
            name += c;
        }
        return false;
    }
    bool readInt(std::int32_t& value) {
        unsigned char b[4];
        if (!read(b, 4)) return false;
        value = static_cast<std::int32_t>(b[0] | b[1] << 8 | b[2] << 16 |
                                          static_cast<std::uint32_t>(b[3]) << 24);
        return true;
    }
    [[nodiscard]] std::uint64_t at() const { return at_; }
    bool readOffset(std::uint64_t& value) {
        unsigned char b[8];
        if (!read(b, 8)) return false;
        value = 0;
        for (int i = 7; i >= 0; --i) value = value << 8 | b[i];
        return true;
    }

  private:
    const ReadAt& readAt_;
    std::uint64_t size_;
    std::uint64_t at_ = 0;
    std::uint64_t blockAt_ = 0;
    std::size_t blockSize_ = 0;
    char block_[16384];
};

/// What a header says of how its pixels are cut.
struct Cut {
    std::int32_t chunkCount = 0;
    int compression = -1;
    std::int32_t window[4] = {};
    std::int32_t tile[2] = {};  ///< 0, 0 = scan lines
    unsigned tileMode = 0;      ///< levels in the low four bits, how their sizes are rounded above
};

/// Tiles of all levels (OpenEXR file layout, "Tile description"); 0 = not known.
std::uint64_t tilesOf(const Cut& cut, std::int64_t width, std::int64_t height) {
    if (cut.tile[0] < 1 || cut.tile[1] < 1) return 0;
    const bool up = cut.tileMode >> 4 & 1u;
    const auto levels = [up](std::int64_t size) {
        int n = 1;
        while (size > 1) {
            size = (size + (up ? 1 : 0)) / 2;
            ++n;
        }
        return n;
    };
    const auto tiles = [up](std::int64_t size, int level, std::int64_t tile) {
        const std::int64_t whole = std::int64_t{1} << level;
        size = std::max<std::int64_t>((size + (up ? whole - 1 : 0)) / whole, 1);
        return static_cast<std::uint64_t>((size + tile - 1) / tile);
    };
    std::uint64_t count = 0;
    switch (cut.tileMode & 15u) {
        case 0:
            return tiles(width, 0, cut.tile[0]) * tiles(height, 0, cut.tile[1]);
        case 1:
            for (int i = 0; i < levels(std::max(width, height)); ++i)
                count += tiles(width, i, cut.tile[0]) * tiles(height, i, cut.tile[1]);
            return count;
        case 2:
            for (int y = 0; y < levels(height); ++y) {
                for (int x = 0; x < levels(width); ++x)
                    count += tiles(width, x, cut.tile[0]) * tiles(height, y, cut.tile[1]);
            }
            return count;
        default:
            return 0;
    }
}

/// Chunks of a single-part file, which need not say how many it has; 0 = not known.
std::uint64_t chunksOf(const Cut& cut, bool tiled) {
    static constexpr int kLines[] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
    const std::int64_t width = std::int64_t{cut.window[2]} - cut.window[0] + 1;
    const std::int64_t height = std::int64_t{cut.window[3]} - cut.window[1] + 1;
    if (width < 1 || height < 1 || cut.compression < 0 || cut.compression > 9) return 0;
    if (tiled) return tilesOf(cut, width, height);
    const int lines = kLines[cut.compression];
    return static_cast<std::uint64_t>((height + lines - 1) / lines);
}

/// Bytes of a value of a type whose size is fixed, and which OpenEXR reads without a look at the
/// size that the file states; 0 for others.
std::uint64_t fixedSizeOf(std::string_view type) {
    static constexpr std::pair<std::string_view, int> kSizes[] = {{"box2i", 16},
                                                                  {"box2f", 16},
                                                                  {"chromaticities", 32},
                                                                  {"compression", 1},
                                                                  {"deepImageState", 1},
                                                                  {"double", 8},
                                                                  {"envmap", 1},
                                                                  {"float", 4},
                                                                  {"int", 4},
                                                                  {"keycode", 28},
                                                                  {"lineOrder", 1},
                                                                  {"m33f", 36},
                                                                  {"m33d", 72},
                                                                  {"m44f", 64},
                                                                  {"m44d", 128},
                                                                  {"rational", 8},
                                                                  {"tiledesc", 9},
                                                                  {"timecode", 8},
                                                                  {"v2i", 8},
                                                                  {"v2f", 8},
                                                                  {"v2d", 16},
                                                                  {"v3i", 12},
                                                                  {"v3f", 12},
                                                                  {"v3d", 24}};
    for (const auto& [name, size] : kSizes) {
        if (name == type) return static_cast<std::uint64_t>(size);
    }
    return 0;
}

/// Passes over a value whose length is in itself; false when that is not `size`.
bool skipSelfDelimited(Cursor& cursor, std::string_view type, std::uint64_t size) {
    const std::uint64_t end = cursor.at() + size;
    if (type == "chlist") {
        std::string channel;
        for (;;) {
            if (!cursor.readName(channel) || cursor.at() > end) return false;
            if (channel.empty()) return cursor.at() == end;
            if (!cursor.skip(16)) return false;  // its type, linearity and sampling
        }
    }
    if (type == "preview") {
        std::int32_t width = 0, height = 0;
        if (size < 8 || !cursor.readInt(width) || !cursor.readInt(height) || width < 0 ||
            height < 0 ||
            static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) !=
                (size - 8) / 4 ||
            size % 4 != 0)
            return false;
        return cursor.skip(size - 8);
    }
    return cursor.skip(size);
}

}  // namespace

Result<void> checkExrHeaders(
    const std::function<bool(std::uint64_t offset, void* to, std::size_t size)>& readAt,
    std::uint64_t fileSize) {
    Cursor cursor(readAt, fileSize);
    const auto cutShort = [&] {
        return fail(ErrorCode::invalidInput, "its header is cut short or damaged at byte {}",
                    cursor.at());
    };
    std::int32_t magic = 0, version = 0;
    if (!cursor.readInt(magic) || !cursor.readInt(version)) return cutShort();
    const bool multi = version & 0x1000;
    std::string name, type;
    for (;;) {
        if (!cursor.readName(name)) return cutShort();
        if (name.empty()) return {};
        while (!name.empty()) {
            std::int32_t size = 0;
            if (!cursor.readName(type) || !cursor.readInt(size)) return cutShort();
            const std::uint64_t at = cursor.at(), fixed = fixedSizeOf(type);
            const auto claimed = static_cast<std::uint64_t>(std::max(size, 0));
            if (size < 0 || claimed > fileSize - at || (fixed != 0 && claimed != fixed) ||
                !skipSelfDelimited(cursor, type, claimed))
                return fail(ErrorCode::invalidInput,
                            "its header has {} bytes for '{}' of type '{}' at byte {}, which is "
                            "not what such a value takes",
                            size, name, type, at);
            if (!cursor.readName(name)) return cutShort();
        }
        if (!multi) return {};
    }
}

std::vector<ExrChunks> exrChunksOfParts(
    const std::function<bool(std::uint64_t offset, void* to, std::size_t size)>& readAt,
    std::uint64_t fileSize) {
    Cursor cursor(readAt, fileSize);
    std::int32_t magic = 0, version = 0;
    if (!cursor.readInt(magic) || magic != 20000630 || !cursor.readInt(version)) return {};
    const bool multi = version & 0x1000, tiled = version & 0x200;
    std::vector<std::uint64_t> chunks;
    std::string name, type;
    for (;;) {
        if (!cursor.readName(name)) return {};
        if (name.empty()) break;  // the end of the list of headers
        Cut cut;
        while (!name.empty()) {
            std::int32_t size = 0;
            if (!cursor.readName(type) || !cursor.readInt(size) || size < 0) return {};
            if (name == "chunkCount" && size == 4) {
                if (!cursor.readInt(cut.chunkCount)) return {};
            } else if (name == "compression" && size == 1) {
                unsigned char c = 0;
                if (!cursor.read(&c, 1)) return {};
                cut.compression = c;
            } else if (name == "dataWindow" && size == 16) {
                for (auto& v : cut.window) {
                    if (!cursor.readInt(v)) return {};
                }
            } else if (name == "tiles" && size == 9) {
                unsigned char mode = 0;
                if (!cursor.readInt(cut.tile[0]) || !cursor.readInt(cut.tile[1]) ||
                    !cursor.read(&mode, 1))
                    return {};
                cut.tileMode = mode;
            } else if (!cursor.skip(static_cast<std::uint64_t>(size))) {
                return {};
            }
            if (!cursor.readName(name)) return {};
        }
        const auto count =
            cut.chunkCount > 0 ? static_cast<std::uint64_t>(cut.chunkCount) : chunksOf(cut, tiled);
        if (count == 0 || count > fileSize / 8) return {};
        chunks.push_back(count);
        if (!multi) break;
    }
    // A chunk ends where the next one begins, whichever part that belongs to.
    std::vector<std::pair<std::uint64_t, std::size_t>> starts;
    std::vector<ExrChunks> parts(chunks.size());
    for (std::size_t part = 0; part < chunks.size(); ++part) {
        for (std::uint64_t i = 0; i < chunks[part]; ++i) {
            std::uint64_t offset = 0;
            if (!cursor.readOffset(offset)) return {};
            if (offset == 0 || offset > fileSize) return {};
            starts.emplace_back(offset, part);
            parts[part].offsets.push_back(offset);
        }
    }
    std::sort(starts.begin(), starts.end());
    for (std::size_t i = 0; i < starts.size(); ++i) {
        const std::uint64_t end = i + 1 < starts.size() ? starts[i + 1].first : fileSize;
        parts[starts[i].second].bytes += end - starts[i].first;
    }
    return parts;
}

}  // namespace stx
