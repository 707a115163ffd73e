// OpenEXR files: bundles, their headers, atlases and plain images.

#include <cstdlib>

#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "formats/images/exr_image.hpp"

using namespace stx;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    Job job;
    job.limits.maxMemoryBytes = 64u << 20;
    const ByteSpan bytes(reinterpret_cast<const std::byte*>(data), size);
    const auto bundle = readExrBundle(bytes, "fuzz", job);
    if (!bundle && bundle.error().message.empty()) std::abort();
    if (bundle && !bundle->check()) std::abort();
    const auto image = decodeExr(bytes, "fuzz", job.limits);
    if (image && image->channelNames.size() != static_cast<std::size_t>(image->channels))
        std::abort();
    return 0;
}
