// Photographs with depth: boxes of HEIF, segments and trailers of JPEG, packets of XMP. Nothing is
// decoded.

#include <cmath>
#include <cstdlib>

#include "formats/photos/photo.hpp"
#include "formats/photos/xmp.hpp"
#include "tests/fuzz/violated.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data), size);
    Limits limits;
    limits.maxMemoryBytes = 64 << 20;
    const auto file = std::make_shared<const Bytes>(bytes.begin(), bytes.end());
    const auto photo = photos::openPhoto(file, {}, limits);
    if (!photo && photo.error().message.empty()) violated("an error has a message");
    if (photo) {
        const glm::ivec2 depth = photo->uprightSize(photo->depth);
        if (depth.x < 1 || depth.y < 1) violated("depth has a size");
        if (photo->orientation < 1 || photo->orientation > 8) violated("an orientation is 1 to 8");
        if (!std::isfinite(photo->code.zero) || !std::isfinite(photo->code.one))
            violated("a range is finite");
    }
    const auto xmp = photos::Xmp::parse(bytes);
    if (xmp) (void)xmp->numbers("http://ns.apple.com/depthData/1.0/", "IntrinsicMatrix");
    return 0;
}
