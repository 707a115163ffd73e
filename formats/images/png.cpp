#include <libdeflate.h>
#include <spng.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <string_view>
#include <vector>

#include "formats/files/byte_io.hpp"
#include "formats/files/deflate.hpp"
#include "formats/images/png_unfilter.hpp"
#include "formats/images/reader.hpp"

namespace stx {

namespace {

struct FreeContext {
    void operator()(spng_ctx* context) const { spng_ctx_free(context); }
};
using Context = std::unique_ptr<spng_ctx, FreeContext>;

/// The chunks that pixels depend on, signature first. The library parses and keeps all others
/// (text, profiles, dates), which only gives hostile files something to attack.
Result<std::vector<ByteSpan>> pixelChunks(ByteSpan bytes) {
    std::vector<ByteSpan> chunks = {bytes.first(8)};
    std::size_t at = 8, paletteEntries = 0;
    unsigned colourType = 0;
    for (;;) {
        if (bytes.size() - at < 12)
            return fail(ErrorCode::invalidInput,
                        "the PNG ends at byte {} without an IEND chunk; it is cut off",
                        bytes.size());
        const std::size_t length = bigEndian(bytes, at, 4);
        const std::string_view kind(reinterpret_cast<const char*>(bytes.data()) + at + 4, 4);
        if (length > bytes.size() - at - 12)
            return fail(ErrorCode::invalidInput,
                        "the PNG chunk at byte {} claims {} bytes, but only {} follow; it is cut "
                        "off or damaged",
                        at, length, bytes.size() - at - 12);
        bool keep = kind == "IHDR" || kind == "IDAT" || kind == "IEND";
        if (kind == "IHDR" && length == 13)
            colourType = std::to_integer<unsigned>(bytes[at + 8 + 9]);
        // In other colour types a palette is a hint for poor screens.
        if (kind == "PLTE" && colourType == SPNG_COLOR_TYPE_INDEXED) {
            keep = true;
            paletteEntries = length / 3;
        }
        // One of a wrong length does not refuse the picture; libpng reads it, too.
        if (kind == "tRNS")
            keep =
                (colourType == SPNG_COLOR_TYPE_GRAYSCALE && length == 2) ||
                (colourType == SPNG_COLOR_TYPE_TRUECOLOR && length == 6) ||
                (colourType == SPNG_COLOR_TYPE_INDEXED && length > 0 && length <= paletteEntries);
        const bool critical = !std::to_integer<bool>(bytes[at + 4] & std::byte{0x20});
        if (critical && !keep && kind != "PLTE")
            return fail(ErrorCode::invalidInput, "the PNG has an unknown critical chunk at byte {}",
                        at);
        if (keep) chunks.push_back(bytes.subspan(at, length + 12));
        if (kind == "IEND") return chunks;
        at += length + 12;
    }
}

class PngReader final : public ImageReader {
  public:
    PngReader(ByteSpan file, std::vector<ByteSpan> chunks)
        : file_(file), chunks_(std::move(chunks)), context_(spng_ctx_new(0)) {}

    Result<void> open() {
        if (!context_) return failWith(SPNG_EMEM);
        if (const int error = spng_set_png_stream(context_.get(), readMore, this))
            return failWith(error);
        if (const int error = spng_get_ihdr(context_.get(), &header_)) return failWith(error);
        spng_trns transparency;
        const int error = spng_get_trns(context_.get(), &transparency);
        if (error && error != SPNG_ECHUNKAVAIL) return failWith(error);
        transparency_ = error == 0;
        info_.format = "png";
        info_.width = static_cast<int>(header_.width);
        info_.height = static_cast<int>(header_.height);
        info_.bits = header_.bit_depth == 16 ? 16 : 8;
        if (header_.color_type == SPNG_COLOR_TYPE_GRAYSCALE && header_.bit_depth < 8)
            info_.greyBits = header_.bit_depth;
        const bool grey = header_.color_type == SPNG_COLOR_TYPE_GRAYSCALE ||
                          header_.color_type == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA;
        const bool alpha = header_.color_type == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA ||
                           header_.color_type == SPNG_COLOR_TYPE_TRUECOLOR_ALPHA;
        info_.channels = (grey ? 1 : 3) + (alpha || transparency_ ? 1 : 0);
        return {};
    }

    Result<void> read(void* values) override {
        const bool wide = info_.bits == 16;
        const auto copy = [&](ByteRow row, std::size_t y) {
            copyRow(row, static_cast<std::uint8_t*>(values) + y * row.size());
        };
        if (inflateWhole(copy)) return {};
        // Host order and no conversion, unless bits, palettes or a transparent colour are spread.
        int format = SPNG_FMT_PNG;
        if (header_.color_type == SPNG_COLOR_TYPE_GRAYSCALE && transparency_)
            format = wide ? SPNG_FMT_GA16 : SPNG_FMT_GA8;
        else if (header_.color_type == SPNG_COLOR_TYPE_GRAYSCALE && !wide)
            format = SPNG_FMT_G8;
        else if (transparency_)
            format = wide ? SPNG_FMT_RGBA16 : SPNG_FMT_RGBA8;
        else if (header_.color_type == SPNG_COLOR_TYPE_INDEXED)
            format = SPNG_FMT_RGB8;
        return decode(format, values, info_.channels * info_.bits / 8);
    }

    [[nodiscard]] bool givesRgba8() const override {
        // Spreading grey to RGBA, libspng 0.7.3 compares a transparent grey's unused high bits too.
        return info_.bits == 8 &&
               !(header_.color_type == SPNG_COLOR_TYPE_GRAYSCALE && transparency_);
    }
    Result<void> readRgba8(glm::u8vec4* pixels) override {
        const auto spread = [&](ByteRow row, std::size_t y) {
            spreadRow(row, pixels + y * header_.width);
        };
        if (inflateWhole(spread)) return {};
        return decode(SPNG_FMT_RGBA8, pixels, 4);
    }

  private:
    using ByteRow = std::span<const std::uint8_t>;

    /// Gives all rows to take(row, y), in less time than the library. False for kinds of pictures
    /// that are rare, for large ones, which the library does row by row in no memory, and for
    /// whatever is wrong: the library says what.
    template <class Take>
    bool inflateWhole(const Take& take) {
        const auto step = static_cast<std::size_t>(info_.channels * info_.bits / 8);
        const std::size_t size = step * header_.width, count = (size + 1) * header_.height;
        constexpr std::size_t kMostBytes = 64u << 20, kMostFold = 1032;  // of deflate
        if (transparency_ || header_.interlace_method != 0 || header_.bit_depth < 8 ||
            header_.color_type == SPNG_COLOR_TYPE_INDEXED || count > kMostBytes)
            return false;
        Bytes joined;
        ByteSpan packed;
        int pieces = 0;
        for (const ByteSpan chunk : std::span(chunks_).subspan(1)) {
            const std::size_t length = chunk.size() - 12;
            if (libdeflate_crc32(0, chunk.data() + 4, length + 4) !=
                bigEndian(chunk, length + 8, 4))
                return false;
            if (std::memcmp(chunk.data() + 4, "IDAT", 4) != 0) continue;
            const ByteSpan data = chunk.subspan(8, length);
            if (++pieces == 2) joined.assign(packed.begin(), packed.end());
            if (pieces > 1) joined.insert(joined.end(), data.begin(), data.end());
            packed = pieces > 1 ? ByteSpan(joined) : data;
        }
        if (count / kMostFold > packed.size()) return false;
        const auto all = std::make_unique_for_overwrite<std::uint8_t[]>(count + kUnfilterSlack);
        const std::span rows(all.get(), count + kUnfilterSlack);
        return inflateZlib(packed, std::as_writable_bytes(rows.first(count))) &&
               unfilterPng(rows, header_.height, size, static_cast<int>(step),
                           [&](std::size_t from, std::size_t to) {
                               // While they are in the cache.
                               for (std::size_t y = from; y < to; ++y)
                                   take(rows.subspan(y * (size + 1) + 1, size), y);
                           });
    }

    /// The values of a row in the order of this machine.
    void copyRow(ByteRow row, std::uint8_t* to) const {
        if (info_.bits == 8) {
            std::copy(row.begin(), row.end(), to);
            return;
        }
        for (std::size_t i = 0; i < row.size(); i += 2) {
            const auto value = static_cast<std::uint16_t>(row[i] << 8 | row[i + 1]);
            std::memcpy(to + i, &value, 2);
        }
    }

    void spreadRow(ByteRow row, glm::u8vec4* to) const {
        static_assert(sizeof(glm::u8vec4) == 4);
        const auto each = static_cast<std::size_t>(info_.channels);
        if (each == 4) {
            std::memcpy(static_cast<void*>(to), row.data(), row.size());
            return;
        }
        for (const std::uint8_t* p = row.data(); p != row.data() + row.size(); p += each, ++to) {
            const std::uint8_t alpha = each == 2 ? p[1] : 255;
            *to = each == 3 ? glm::u8vec4(p[0], p[1], p[2], alpha)
                            : glm::u8vec4(p[0], p[0], p[0], alpha);
        }
    }

    Result<void> decode(int format, void* pixels, int bytesEach) {
        const auto size = std::size_t{header_.width} * header_.height * bytesEach;
        if (const int error =
                spng_decode_image(context_.get(), pixels, size, format, SPNG_DECODE_TRNS))
            return failWith(error);
        // To the end, for the checksum of the last chunk.
        if (const int error = spng_decode_chunks(context_.get())) return failWith(error);
        return {};
    }

    static int readMore(spng_ctx*, void* user, void* to, std::size_t size) {
        auto& self = *static_cast<PngReader*>(user);
        auto* out = static_cast<std::byte*>(to);
        while (size > 0) {
            if (self.chunk_ == self.chunks_.size()) return SPNG_IO_EOF;
            const ByteSpan rest = self.chunks_[self.chunk_].subspan(self.offset_);
            const std::size_t n = std::min(size, rest.size());
            std::memcpy(out, rest.data(), n);
            out += n;
            size -= n;
            self.offset_ += n;
            if (n < rest.size()) continue;
            self.offset_ = 0;
            ++self.chunk_;
        }
        return 0;
    }

    [[nodiscard]] tl::unexpected<Error> failWith(int error) const {
        if (error == SPNG_EMEM)
            return fail(ErrorCode::failed, "there is not enough memory for the image");
        // Where the library is, to the chunk: the one that it began last.
        const auto next = std::min(chunk_ + (offset_ > 0 ? 1 : 0), chunks_.size());
        const auto at = next == 0 ? 0 : chunks_[next - 1].data() - file_.data();
        return fail(ErrorCode::invalidInput, "the PNG is damaged in the chunk at byte {}: {}", at,
                    spng_strerror(error));
    }

    ByteSpan file_;
    std::vector<ByteSpan> chunks_;
    std::size_t chunk_ = 0, offset_ = 0;  ///< what the library reads next
    spng_ihdr header_{};
    bool transparency_ = false;
    Context context_;
};

int appendBytes(spng_ctx*, void* user, void* from, std::size_t size) {
    try {
        auto& out = *static_cast<Bytes*>(user);
        const auto* bytes = static_cast<const std::byte*>(from);
        out.insert(out.end(), bytes, bytes + size);
        return 0;
    } catch (const std::bad_alloc&) {
        return SPNG_IO_ERROR;  // an exception must not pass through C
    }
}

}  // namespace

Result<std::unique_ptr<ImageReader>> openPng(ByteSpan bytes) {
    STX_TRY(auto chunks, pixelChunks(bytes));
    auto reader = std::make_unique<PngReader>(bytes, std::move(chunks));
    STX_CHECK(reader->open());
    return reader;
}

Result<Bytes> encodePng(int width, int height, int channels, int bits, const void* values,
                        bool srgb, int level) {
    STX_CHECK(checkEncodable(width, height, "PNG"));
    if (channels < 1 || channels > 4 || (bits != 8 && bits != 16))
        return fail(ErrorCode::failed,
                    "cannot encode a PNG of {} channels of {} bits; 1 to 4 of 8 or 16 is possible",
                    channels, bits);
    level = std::clamp(level, 0, 9);
    // Larger ones in a stream, which takes no memory beside the result.
    constexpr std::uint64_t kWholeBytes = 256u << 20;
    if (std::uint64_t{1} * width * height * channels * bits / 8 <= kWholeBytes)
        return encodeWholePng(width, height, channels, bits, values, srgb, level);
    const Context context(spng_ctx_new(SPNG_CTX_ENCODER));
    Bytes out;
    int error = context ? 0 : SPNG_EMEM;
    const auto step = [&](auto function, auto... arguments) {
        if (!error) error = function(context.get(), arguments...);
    };
    constexpr std::uint8_t kColourTypes[] = {
        SPNG_COLOR_TYPE_GRAYSCALE, SPNG_COLOR_TYPE_GRAYSCALE_ALPHA, SPNG_COLOR_TYPE_TRUECOLOR,
        SPNG_COLOR_TYPE_TRUECOLOR_ALPHA};
    constexpr int kDefaultStrategy = 0;  // zlib's Z_DEFAULT_STRATEGY
    spng_ihdr header{};
    header.width = static_cast<std::uint32_t>(width);
    header.height = static_cast<std::uint32_t>(height);
    header.bit_depth = static_cast<std::uint8_t>(bits);
    header.color_type = kColourTypes[channels - 1];
    step(spng_set_png_stream, appendBytes, &out);
    step(spng_set_ihdr, &header);
    if (srgb) {
        // With the gamma and primaries that ISO/IEC 15948, 11.3.3.5 recommends beside it.
        constexpr std::uint8_t kAbsoluteColorimetric = 3;
        spng_chrm_int primaries = {31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000};
        step(spng_set_srgb, kAbsoluteColorimetric);
        step(spng_set_gama_int, std::uint32_t{45455});
        step(spng_set_chrm_int, &primaries);
    }
    step(spng_set_option, SPNG_IMG_COMPRESSION_LEVEL, level);
    // The library's own choice, Z_FILTERED, is larger by up to a third for flat pictures.
    step(spng_set_option, SPNG_IMG_COMPRESSION_STRATEGY, kDefaultStrategy);
    step(spng_encode_image, values,
         static_cast<std::size_t>(width) * height * channels * (bits / 8),
         static_cast<int>(SPNG_FMT_PNG), static_cast<int>(SPNG_ENCODE_FINALIZE));
    if (error)
        return fail(ErrorCode::failed, "cannot encode a PNG of {}x{} pixels: {}", width, height,
                    spng_strerror(error));
    return out;
}

}  // namespace stx
