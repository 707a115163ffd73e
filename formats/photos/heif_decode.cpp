#include "formats/photos/heif_decode.hpp"

#include "formats/decoders/decoder_process.hpp"
#include "formats/images/foreign_decode.hpp"

namespace stx::photos {

Result<DecodedImage> decodeHeifItem(const PhotoImage& image, bool grey, const Limits& limits) {
    DecoderBounds bounds;
    // Planes, RGB, the answer, and what the decoder keeps: 62 MB for 4032x3024 as tiles.
    constexpr std::uint64_t kOwn = 96u << 20, kBytesPerPixel = 12;
    bounds.memoryBytes =
        kOwn + kBytesPerPixel * static_cast<std::uint64_t>(image.width) * image.height;
    constexpr int kMostSeconds = 30;
    bounds.cpuSeconds = kMostSeconds;
    STX_TRY(const auto process, DecoderProcess::start(decoders::kHeif, bounds, image.bytes));
    decoders::Packer request;
    request.put(image.item);
    request.put(static_cast<std::uint8_t>(grey));
    process->send(decoders::Tag::decodeItem, request.bytes);
    // What a HEVC stream of few bytes may hold has no bound; the size has been checked.
    STX_TRY(auto decoded, receivePicture(*process, std::size_t{1} << 40, limits));
    if (decoded.width != image.width || decoded.height != image.height ||
        decoded.channels != (grey ? 1 : 3) || decoded.bits() != 8)
        return fail(ErrorCode::invalidInput,
                    "its picture is {}x{} where {}x{} are claimed; the file is damaged",
                    decoded.width, decoded.height, image.width, image.height);
    return decoded;
}

}  // namespace stx::photos
