// NumPy's arrays, alone and in archives.

#include <cstdlib>

#include "formats/images/npy.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data), size);
    Limits limits;
    limits.maxMemoryBytes = 8u << 20;
    if (!isNumpy(bytes)) return 0;
    const auto image = decodeNumpy(bytes, limits);
    if (!image) {
        if (image.error().message.empty()) std::abort();
        return 0;
    }
    const auto count = static_cast<std::size_t>(image->width) * image->height * image->channels;
    if (std::visit([](const auto& values) { return values.size(); }, image->values) != count)
        std::abort();
    return 0;
}
