// COLMAP's models. The first byte chooses the file and the form.

#include <cmath>
#include <cstdlib>

#include "formats/imagesets/colmap.hpp"
#include "formats/imagesets/pictures.hpp"

using namespace stx;
using namespace stx::imagesets;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 1) return 0;
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data) + 1, size - 1);
    Limits limits;
    limits.maxImageSide = 4096;
    const bool binary = (data[0] & 1) != 0;
    switch (data[0] >> 1 & 3) {
        case 0:
            if (const auto cameras = parseColmapCameras(bytes, binary, limits))
                for (const auto& [id, camera] : *cameras)
                    if (!camera.unknown && !(camera.fx > 0 && camera.fy > 0 && camera.width > 0))
                        std::abort();
            break;
        case 1:
            if (const auto images = parseColmapImages(bytes, binary, limits))
                for (const auto& image : *images)
                    if (!std::isfinite(image.translation.x)) std::abort();
            break;
        case 2:
            (void)parseColmapDepth(bytes, "depth", limits);
            break;
        default:
            (void)parsePfm(bytes, "disparity", limits);
            break;
    }
    return 0;
}
