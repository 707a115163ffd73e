// Pictures of netpbm.

#include <cstdlib>

#include "formats/images/pnm.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data), size);
    Limits limits;
    limits.maxMemoryBytes = 8u << 20;
    if (!isPnm(bytes)) return 0;
    const auto image = decodePnm(bytes, limits);
    if (!image && image.error().message.empty()) std::abort();
    return 0;
}
