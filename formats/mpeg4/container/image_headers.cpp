#include "formats/mpeg4/container/image_headers.hpp"

#include "formats/files/byte_io.hpp"
#include "formats/mpeg4/scene/document.hpp"

namespace stx::mpeg4 {
namespace {

std::optional<ImageHeader> readPng(ByteReader in) {
    if (in.u64() != 0x89504E470D0A1A0Aull || in.u32() != 13 || in.u32() != 0x49484452) return {};
    ImageHeader header;
    header.objectTypeIndication = oti::kPng;
    const std::uint32_t width = in.u32();
    const std::uint32_t height = in.u32();
    header.bitDepth = in.u8();
    const std::uint8_t colourType = in.u8();
    if (in.failed() || width == 0 || height == 0 || width > 0x7FFFFFFF || height > 0x7FFFFFFF)
        return {};
    header.width = static_cast<int>(width);
    header.height = static_cast<int>(height);
    switch (colourType) {
        case 0:
            header.components = 1;
            break;
        case 4:
            header.components = 2;
            break;
        case 6:
            header.components = 4;
            break;
        default:
            header.components = 3;
            break;
    }
    return header;
}

std::optional<ImageHeader> readJpeg(ByteReader in) {
    if (in.u16() != 0xFFD8) return {};
    ImageHeader header;
    header.objectTypeIndication = oti::kJpeg;
    header.headerLength = 2;
    while (true) {
        if (in.u8() != 0xFF || in.failed()) return {};
        std::uint8_t marker = in.u8();
        while (marker == 0xFF) marker = in.u8();  // fill bytes
        const bool alone = marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7);
        if (alone) continue;
        if (marker == 0xD9 || marker == 0xDA || marker == 0) return {};
        const std::uint16_t length = in.u16();
        if (in.failed() || length < 2 || length - 2u > in.left()) return {};
        ByteReader segment = in.sub(length - 2u);
        if (marker == 0xE0 && header.headerLength == 2) {
            const std::string identifier = segment.text(5);
            segment.skip(3);
            const int x = segment.u16();
            const int y = segment.u16();
            if (identifier == std::string("JFIF\0", 5) && !segment.failed()) {
                header.headerLength = static_cast<int>(in.offset());
                header.xDensity = x;
                header.yDensity = y;
            }
        }
        const bool frame =
            marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
        if (!frame) continue;
        header.bitDepth = segment.u8();
        header.height = segment.u16();
        header.width = segment.u16();
        header.components = segment.u8();
        if (segment.failed() || header.width == 0 || header.height == 0) return {};
        return header;
    }
}

}  // namespace

std::optional<ImageHeader> readImageHeader(ByteSpan head) {
    const ByteReader in(head);
    if (const auto png = readPng(in)) return png;
    return readJpeg(in);
}

Bytes jpegDecoderSpecificInfo(const ImageHeader& header) {
    ByteWriter out;
    out.u16(static_cast<std::uint16_t>(header.headerLength));
    out.u16(static_cast<std::uint16_t>(header.xDensity));
    out.u16(static_cast<std::uint16_t>(header.yDensity));
    out.u8(static_cast<std::uint8_t>(header.components));
    return out.take();
}

}  // namespace stx::mpeg4
