#include "lib/model/peak_memory.hpp"

#include <algorithm>

namespace stx {
namespace {

template <class Pixel>
std::uint64_t bytesOf(const Image<Pixel>& image) {
    return std::uint64_t{image.count()} * sizeof(Pixel);
}

std::uint64_t bytesOf(const ReferenceView& v) {
    const auto colour =
        v.texture.rgba8() ? bytesOf(*v.texture.rgba8()) : bytesOf(*v.texture.rgbaFloat());
    return colour + bytesOf(v.depth) + bytesOf(v.normal) + bytesOf(v.splatU) + bytesOf(v.splatV) +
           bytesOf(v.metallicRoughness) + bytesOf(v.emissive);
}

}  // namespace

Result<void> checkPeak(const PeakMemory& step, const std::vector<ReferenceView>& views,
                       const Limits& limits) {
    std::uint64_t pixels = 0, largest = 0, held = 0;
    for (const ReferenceView& view : views) {
        const auto own = static_cast<std::uint64_t>(view.camera.width) *
                         static_cast<std::uint64_t>(view.camera.height);
        pixels += own;
        largest = std::max(largest, own);
        held += bytesOf(view);
    }
    return checkPeak(step, pixels, largest, held, limits);
}

Result<void> checkPeak(const PeakMemory& step, std::uint64_t pixels, std::uint64_t largest,
                       std::uint64_t held, const Limits& limits) {
    const std::uint64_t bytes = held + pixels * step.perPixel + largest * step.perPixelOfLargest;
    if (bytes <= limits.maxMemoryBytes) return {};
    constexpr std::uint64_t kMiB = 1 << 20;
    return fail(ErrorCode::invalidInput,
                "{} with views of {} pixels needs {} MiB, more than the memory limit of {} MiB; "
                "raise it with --max-memory {} if the file is to be trusted",
                step.what, pixels, (bytes + kMiB - 1) / kMiB, limits.maxMemoryBytes / kMiB,
                (bytes + kMiB - 1) / kMiB);
}

}  // namespace stx
