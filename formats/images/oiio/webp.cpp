#include "formats/images/oiio/webp.hpp"

#include <webp/decode.h>
#include <webp/encode.h>

#include <cstdio>
#include <memory>

#include "formats/images/oiio/failed.hpp"

namespace stx::codecs {

bool decodeWebp(std::span<const std::byte> file, PictureAnswer& answer) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(file.data());
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(bytes, file.size(), &features) != VP8_STATUS_OK)
        throw Failed{ErrorCode::invalidInput, "the WebP's header is damaged or cut off"};
    if (features.has_animation) return false;
    decoders::PictureFacts header;
    header.width = header.displayWidth = features.width;
    header.height = header.displayHeight = features.height;
    header.channels = features.has_alpha ? 4 : 3;
    header.bits = 8;
    std::vector<std::string> names = {"R", "G", "B"};
    if (features.has_alpha) names.emplace_back("A");
    auto* values = static_cast<std::uint8_t*>(answer.begin(header, names));
    const int stride = header.width * header.channels;
    const std::size_t size = static_cast<std::size_t>(stride) * features.height;
    const auto* done = features.has_alpha
                           ? WebPDecodeRGBAInto(bytes, file.size(), values, size, stride)
                           : WebPDecodeRGBInto(bytes, file.size(), values, size, stride);
    if (!done) throw Failed{ErrorCode::invalidInput, "the WebP is damaged or cut off"};
    return true;
}

void encodeWebp(const EncodeRequest& request) {
    std::uint8_t* bytes = nullptr;
    const int stride = request.width * request.channels;
    const std::size_t size =
        request.channels == 4
            ? WebPEncodeLosslessRGBA(request.values, request.width, request.height, stride, &bytes)
            : WebPEncodeLosslessRGB(request.values, request.width, request.height, stride, &bytes);
    const std::unique_ptr<std::uint8_t, void (*)(void*)> owner(bytes, &WebPFree);
    if (size == 0) throw Failed{ErrorCode::failed, "the picture cannot be coded as WebP"};
    std::FILE* file = std::fopen(request.path, "wb");
    if (!file) cannotWrite("the file cannot be opened");
    const bool written = std::fwrite(bytes, 1, size, file) == size;
    if (std::fclose(file) != 0 || !written) cannotWrite("the file cannot be written");
}

}  // namespace stx::codecs
