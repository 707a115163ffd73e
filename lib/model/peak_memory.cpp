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

struct Sums {
    std::uint64_t pixels = 0, points = 0, largest = 0, held = 0;

    Sums(const std::vector<ReferenceView>& views, bool countPoints) {
        for (const ReferenceView& view : views) {
            const auto own = static_cast<std::uint64_t>(view.camera.width) *
                             static_cast<std::uint64_t>(view.camera.height);
            const auto shown = countPoints ? static_cast<std::uint64_t>(view.pointCount()) : own;
            pixels += own;
            points += shown;
            largest = std::max(largest, shown);
            held += bytesOf(view);
        }
    }
};

Result<void> checkBytes(std::string_view what, std::uint64_t pixels, std::uint64_t bytes,
                        std::uint64_t atMost, const Limits& limits) {
    if (bytes <= limits.maxMemoryBytes) return {};
    constexpr std::uint64_t kMiB = 1 << 20;
    const std::uint64_t needed = (std::max(bytes, atMost) + kMiB - 1) / kMiB;
    return fail(ErrorCode::invalidInput,
                "{} with views of {} pixels needs {} MiB, more than the memory limit of {} MiB; "
                "raise it with --max-memory {} if the file is to be trusted",
                what, pixels, needed, limits.maxMemoryBytes / kMiB, needed);
}

}  // namespace

Result<void> checkPeak(const PeakMemory& step, const std::vector<ReferenceView>& views,
                       const Limits& limits) {
    const Sums of(views, step.perEmpty != step.perPixel);
    const std::uint64_t bytes = of.held + of.points * step.perPixel +
                                (of.pixels - of.points) * step.perEmpty +
                                of.largest * step.perPixelOfLargest;
    return checkBytes(step.what, of.pixels, bytes, of.held + of.pixels * step.perPixelAtMost,
                      limits);
}

Result<void> checkPeakOfTriangles(std::uint64_t triangles, const std::vector<ReferenceView>& views,
                                  const Limits& limits) {
    const Sums of(views, false);
    return checkBytes(
        peak::kFewerTriangles.what, of.pixels,
        of.held + of.pixels * peak::kPerPixelOfTriangles + triangles * peak::kPerTriangle, 0,
        limits);
}

Result<void> checkPeak(const PeakMemory& step, std::uint64_t pixels, std::uint64_t largest,
                       std::uint64_t held, const Limits& limits) {
    return checkBytes(step.what, pixels,
                      held + pixels * step.perPixel + largest * step.perPixelOfLargest,
                      held + pixels * step.perPixelAtMost, limits);
}

}  // namespace stx
