#include "formats/images/strip.hpp"

#include <array>
#include <string_view>

namespace stx {

namespace {

unsigned byteAt(ByteSpan bytes, std::size_t at) {
    return std::to_integer<unsigned>(bytes[at]);
}

bool startsWith(ByteSpan bytes, std::string_view head) {
    if (bytes.size() < head.size()) return false;
    for (std::size_t i = 0; i < head.size(); ++i) {
        if (byteAt(bytes, i) != static_cast<unsigned char>(head[i])) return false;
    }
    return true;
}

/// CRC-32 of ISO/IEC 15948, Annex D, eight bytes at a time.
class Crc32 {
  public:
    Crc32() {
        for (std::uint32_t n = 0; n < 256; ++n) {
            std::uint32_t c = n;
            for (int k = 0; k < 8; ++k) c = (c & 1) ? 0xedb88320u ^ (c >> 1) : c >> 1;
            tables_[0][n] = c;
        }
        for (std::size_t t = 1; t < 8; ++t) {
            for (std::size_t n = 0; n < 256; ++n) {
                const std::uint32_t c = tables_[t - 1][n];
                tables_[t][n] = tables_[0][c & 0xff] ^ (c >> 8);
            }
        }
    }
    [[nodiscard]] std::uint32_t of(ByteSpan bytes) const {
        std::uint32_t c = 0xffffffffu;
        std::size_t i = 0;
        for (; i + 8 <= bytes.size(); i += 8) {
            std::uint32_t next = 0;
            for (std::size_t k = 0; k < 8; ++k) {
                const std::uint32_t low = k < 4 ? (c >> (8 * k)) & 0xff : 0;
                next ^= tables_[7 - k][byteAt(bytes, i + k) ^ low];
            }
            c = next;
        }
        for (; i < bytes.size(); ++i) c = tables_[0][(c ^ byteAt(bytes, i)) & 0xff] ^ (c >> 8);
        return c ^ 0xffffffffu;
    }

  private:
    std::array<std::array<std::uint32_t, 256>, 8> tables_;
};

void append(Bytes& out, ByteSpan bytes) {
    out.insert(out.end(), bytes.begin(), bytes.end());
}

Result<Bytes> stripPng(ByteSpan bytes) {
    static const Crc32 crc;
    Bytes out;
    out.reserve(bytes.size());
    append(out, bytes.first(8));
    std::size_t at = 8;
    for (;;) {
        if (bytes.size() - at < 12)
            return fail(ErrorCode::invalidInput,
                        "the PNG ends at byte {} without an IEND chunk; it is cut off",
                        bytes.size());
        const std::size_t length = std::size_t{byteAt(bytes, at)} << 24 |
                                   byteAt(bytes, at + 1) << 16 | byteAt(bytes, at + 2) << 8 |
                                   byteAt(bytes, at + 3);
        const std::string_view kind(reinterpret_cast<const char*>(bytes.data()) + at + 4, 4);
        const bool critical = kind == "IHDR" || kind == "PLTE" || kind == "IDAT" || kind == "IEND";
        if (length > bytes.size() - at - 12)
            return fail(ErrorCode::invalidInput,
                        "the PNG chunk at byte {} claims {} bytes, but only {} follow; it is cut "
                        "off or damaged",
                        at, length, bytes.size() - at - 12);
        const ByteSpan chunk = bytes.subspan(at, length + 12);
        if (critical || kind == "tRNS" || kind == "sRGB" || kind == "gAMA" || kind == "cHRM") {
            const ByteSpan stored = chunk.last(4);
            const std::uint32_t claimed = byteAt(stored, 0) << 24 | byteAt(stored, 1) << 16 |
                                          byteAt(stored, 2) << 8 | byteAt(stored, 3);
            const bool sound = crc.of(chunk.subspan(4, length + 4)) == claimed;
            if (!sound && critical)
                return fail(ErrorCode::invalidInput,
                            "the PNG chunk '{}' at byte {} fails its checksum; it is damaged", kind,
                            at);
            if (sound) append(out, chunk);
        } else if (!(byteAt(chunk, 4) & 0x20)) {
            return fail(ErrorCode::invalidInput, "the PNG has an unknown critical chunk at byte {}",
                        at);
        }
        if (kind == "IEND") return out;
        at += length + 12;
    }
}

Result<Bytes> stripJpeg(ByteSpan bytes) {
    Bytes out;
    out.reserve(bytes.size());
    append(out, bytes.first(2));
    std::size_t at = 2;
    while (at + 4 <= bytes.size()) {
        // Wrong lengths of comments are common; libjpeg looks for the next marker, too.
        if (byteAt(bytes, at) != 0xff) {
            ++at;
            continue;
        }
        const unsigned marker = byteAt(bytes, at + 1);
        if (marker == 0xff) {
            ++at;
            continue;
        }
        // From the first scan on there is nothing but pixels.
        if (marker == 0xda || marker == 0xd9) {
            append(out, bytes.subspan(at));
            return out;
        }
        if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8)) {
            at += 2;
            continue;
        }
        const std::size_t length = byteAt(bytes, at + 2) << 8 | byteAt(bytes, at + 3);
        if (length < 2 || length > bytes.size() - at - 2)
            return fail(ErrorCode::invalidInput,
                        "the JPEG segment at byte {} claims {} bytes, but only {} follow; it is "
                        "cut off or damaged",
                        at, length, bytes.size() - at - 2);
        const ByteSpan segment = bytes.subspan(at, length + 2);
        const bool application = (marker >= 0xe0 && marker <= 0xef) || marker == 0xfe;
        // JFIF and Adobe's segment say what the components mean.
        const bool meaning = (marker == 0xe0 && startsWith(segment.subspan(4), "JFIF")) ||
                             (marker == 0xee && startsWith(segment.subspan(4), "Adobe"));
        if (!application || meaning) append(out, segment);
        at += length + 2;
    }
    return fail(ErrorCode::invalidInput, "the JPEG ends at byte {} without a scan; it is cut off",
                bytes.size());
}

}  // namespace

Result<Bytes> stripMetadata(ByteSpan bytes) {
    using namespace std::string_view_literals;
    if (startsWith(bytes, "\x89PNG\r\n\x1a\n"sv)) return stripPng(bytes);
    if (startsWith(bytes, "\xff\xd8"sv)) return stripJpeg(bytes);
    return Bytes(bytes.begin(), bytes.end());
}

}  // namespace stx
