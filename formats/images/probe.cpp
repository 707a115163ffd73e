#include "formats/images/images.hpp"

#include "formats/files/byte_io.hpp"

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

bool isChunk(ByteSpan bytes, std::size_t at, std::string_view kind) {
    return startsWith(bytes.subspan(at + 4), kind);
}

/// PNG (ISO/IEC 15948): signature, then IHDR.
Result<ImageInfo> probePng(ByteSpan bytes) {
    constexpr std::size_t kHeaderEnd = 8 + 8 + 13 + 4;
    if (bytes.size() < kHeaderEnd || !isChunk(bytes, 8, "IHDR") || bigEndian(bytes, 8, 4) != 13)
        return fail(ErrorCode::invalidInput, "the PNG has no whole IHDR chunk at byte 8");
    const std::uint32_t width = bigEndian(bytes, 16, 4), height = bigEndian(bytes, 20, 4);
    if (width == 0 || height == 0 || width > 0x7fffffff || height > 0x7fffffff)
        return fail(ErrorCode::invalidInput, "the PNG claims {}x{} pixels", width, height);
    ImageInfo info;
    info.format = "png";
    info.width = static_cast<int>(width);
    info.height = static_cast<int>(height);
    info.bits = byteAt(bytes, 24) == 16 ? 16 : 8;
    const unsigned type = byteAt(bytes, 25);
    switch (type) {
        case 0:
            info.channels = 1;
            if (byteAt(bytes, 24) < 8) info.greyBits = static_cast<int>(byteAt(bytes, 24));
            break;
        case 2:
            info.channels = 3;
            break;
        case 3:
            info.channels = 3;
            break;
        case 4:
            info.channels = 2;
            break;
        case 6:
            info.channels = 4;
            break;
        default:
            return fail(ErrorCode::invalidInput,
                        "the PNG has colour type {}; 0, 2, 3, 4 and 6 exist", type);
    }
    // A tRNS chunk, which stands before the pixels, makes an alpha channel.
    std::size_t at = kHeaderEnd;
    while (at + 12 <= bytes.size() && !isChunk(bytes, at, "IDAT")) {
        if (isChunk(bytes, at, "tRNS") && (type == 0 || type == 2 || type == 3)) {
            ++info.channels;
            break;
        }
        at += 12 + static_cast<std::size_t>(bigEndian(bytes, at, 4));
    }
    return info;
}

/// JPEG (ISO/IEC 10918-1): the frame header behind any number of other segments.
Result<ImageInfo> probeJpeg(ByteSpan bytes) {
    std::size_t at = 2;
    while (at + 4 <= bytes.size()) {
        if (byteAt(bytes, at) != 0xff) {  // behind a segment of a wrong length
            ++at;
            continue;
        }
        const unsigned marker = byteAt(bytes, at + 1);
        if (marker == 0xff) {  // filling
            ++at;
            continue;
        }
        if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8)) {  // without a length
            at += 2;
            continue;
        }
        if (marker == 0xd9 || marker == 0xda) break;
        const std::size_t length = byteAt(bytes, at + 2) << 8 | byteAt(bytes, at + 3);
        const bool frame =
            marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
        if (frame) {
            if (length < 8 || at + 10 > bytes.size()) break;
            ImageInfo info;
            info.format = "jpeg";
            info.bits = static_cast<int>(byteAt(bytes, at + 4));
            info.height = static_cast<int>(byteAt(bytes, at + 5) << 8 | byteAt(bytes, at + 6));
            info.width = static_cast<int>(byteAt(bytes, at + 7) << 8 | byteAt(bytes, at + 8));
            info.channels = static_cast<int>(byteAt(bytes, at + 9));
            if (info.width == 0 || info.height == 0 || info.channels == 0 || info.channels > 4)
                return fail(ErrorCode::invalidInput,
                            "the JPEG claims {}x{} pixels of {} components", info.width,
                            info.height, info.channels);
            return info;
        }
        if (length < 2) break;
        at += 2 + length;
    }
    return fail(ErrorCode::invalidInput, "the JPEG has no whole frame header");
}

}  // namespace

Result<ImageInfo> probeImage(ByteSpan bytes) {
    using namespace std::string_view_literals;
    if (startsWith(bytes, "\x89PNG\r\n\x1a\n"sv)) return probePng(bytes);
    if (startsWith(bytes, "\xff\xd8"sv)) return probeJpeg(bytes);
    return fail(ErrorCode::unsupported, "it is neither a PNG nor a JPEG");
}

}  // namespace stx
