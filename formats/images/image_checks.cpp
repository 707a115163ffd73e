#include "formats/images/reader.hpp"

namespace stx {

namespace {

/// More pixels than `size` bytes of any such file can hold, whatever is in them? A few bytes that
/// claim gigabytes are refused before memory is taken.
Result<void> checkPlausible(const ImageInfo& info, std::uint64_t size) {
    const auto pixels = static_cast<std::uint64_t>(info.width) * info.height;
    const auto values = pixels * static_cast<std::uint64_t>(info.channels);
    // Small enough not to hurt anybody, and some formats code flat pictures in a handful of bytes.
    if (values <= (16u << 20)) return {};
    std::uint64_t most = size * 8192;  // TIFF, EXR, WebP, ...: deflate over runs
    // Deflate gives at most 1032 bytes for one; a byte may be eight pixels, each of a palette.
    if (info.format == "png") most = info.bits == 16 ? size * 516 : size * 1032 * 8 * 4;
    // One bit for each block of 8x8 in a progressive file's first scan.
    if (info.format == "jpeg") most = size * 8 * 64 * 4;
    if (values <= most) return {};
    return fail(ErrorCode::invalidInput,
                "the header claims {}x{} pixels of {} channels, more than a file of {} bytes can "
                "hold",
                info.width, info.height, info.channels, size);
}

}  // namespace

Result<void> checkImageHeader(const ImageInfo& info, std::size_t fileBytes, const Limits& limits) {
    if (info.width < 1 || info.height < 1 || info.channels < 1)
        return fail(ErrorCode::invalidInput,
                    "the header claims {}x{} pixels of {} channels; each must be 1 or more",
                    info.width, info.height, info.channels);
    if (info.width > limits.maxImageSide || info.height > limits.maxImageSide)
        return fail(ErrorCode::invalidInput,
                    "the header claims {}x{} pixels; at most {} pixels a side are read", info.width,
                    info.height, limits.maxImageSide);
    constexpr int kMaxChannels = 1024;
    if (info.channels > kMaxChannels)
        return fail(ErrorCode::invalidInput, "the header claims {} channels; at most {} are read",
                    info.channels, kMaxChannels);
    STX_CHECK(limits.checkAllocation(static_cast<std::uint64_t>(info.width) * info.height,
                                     static_cast<std::uint64_t>(info.channels) * info.bits / 8,
                                     "the image"));
    return checkPlausible(info, fileBytes);
}

Result<void> checkEncodable(int width, int height, std::string_view kind) {
    if (width >= 1 && height >= 1 && width <= 65535 && height <= 65535) return {};
    return fail(ErrorCode::failed,
                "cannot encode a {} of {}x{} pixels; 1 to 65535 a side is possible", kind, width,
                height);
}

}  // namespace stx
