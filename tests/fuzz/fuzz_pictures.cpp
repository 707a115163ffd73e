// PNG and JPEG: their headers, and their pixels by libspng and libjpeg-turbo. Other formats are
// decoded in processes of their own.

#include <cstdlib>
#include <string_view>

#include "formats/images/images.hpp"

using namespace stx;

namespace {

std::uint32_t crc32(ByteSpan bytes) {
    std::uint32_t crc = 0xffffffffu;
    for (const auto byte : bytes) {
        crc ^= std::to_integer<std::uint32_t>(byte);
        for (int k = 0; k < 8; ++k) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

/// Makes all checksums right, so that changed bytes reach what is behind them.
void repairChecksums(Bytes& png) {
    const auto byte = [&](std::size_t at) { return std::to_integer<std::size_t>(png[at]); };
    for (std::size_t at = 8; png.size() >= at + 12;) {
        const std::size_t length =
            byte(at) << 24 | byte(at + 1) << 16 | byte(at + 2) << 8 | byte(at + 3);
        if (length > png.size() - at - 12) return;
        const auto crc = crc32(ByteSpan(png).subspan(at + 4, length + 4));
        at += length + 12;
        for (std::size_t i = 0; i < 4; ++i)
            png[at - 4 + i] = static_cast<std::byte>(crc >> (24 - 8 * i));
    }
}

void decode(ByteSpan bytes) {
    Limits limits;
    limits.maxMemoryBytes = 8u << 20;
    const auto info = probeImage(bytes);
    if (info && (info->width < 1 || info->height < 1 || info->channels < 1)) std::abort();
    if (!info && info.error().code == ErrorCode::unsupported) return;
    const auto image = decodeImage(bytes, "fuzz", limits);
    const auto rgba = decodeRgba8(bytes, "fuzz", limits);
    if (!image) {
        // One clear error, whichever way is asked.
        if (image.error().message.empty() || rgba) std::abort();
        return;
    }
    if (image->width != info->width || image->height != info->height) std::abort();
    const auto count = static_cast<std::size_t>(image->width) * image->height * image->channels;
    if (std::visit([](const auto& values) { return values.size(); }, image->values) != count)
        std::abort();
    // RGBA of four bytes may be more than the limit.
    if (rgba && !(*rgba == rgba8From(*image))) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto* first = reinterpret_cast<const std::byte*>(data);
    decode({first, size});
    if (size > 0 && data[0] == 0x89) {
        Bytes repaired(first, first + size);
        repairChecksums(repaired);
        decode(repaired);
    }
    return 0;
}
