// PNG and JPEG before any library sees them: headers, and the removal of metadata.

#include <cstdlib>

#include "formats/images/images.hpp"
#include "formats/images/strip.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data), size);
    const auto info = probeImage(bytes);
    if (info && (info->width < 1 || info->height < 1 || info->channels < 1)) std::abort();
    const auto stripped = stripMetadata(bytes);
    if (!stripped) return 0;
    // Nothing is added, and there is nothing left to remove.
    if (stripped->size() > size) std::abort();
    const auto again = stripMetadata(*stripped);
    if (!again || *again != *stripped) std::abort();
    return 0;
}
