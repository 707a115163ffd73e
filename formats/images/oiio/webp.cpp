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
    // What WebPEncodeLosslessRGBA() does, which invents colours under alpha 0.
    constexpr float kEffort = 70;
    WebPConfig config;
    WebPPicture picture;
    if (!WebPConfigPreset(&config, WEBP_PRESET_DEFAULT, kEffort) || !WebPPictureInit(&picture))
        throw Failed{ErrorCode::failed, "libwebp is not the one that this was built for"};
    WebPMemoryWriter coded;
    WebPMemoryWriterInit(&coded);
    const std::unique_ptr<WebPPicture, void (*)(WebPPicture*)> freePicture(&picture,
                                                                           &WebPPictureFree);
    const std::unique_ptr<WebPMemoryWriter, void (*)(WebPMemoryWriter*)> freeCoded(
        &coded, &WebPMemoryWriterClear);
    config.lossless = config.exact = 1;
    picture.use_argb = 1;
    picture.width = request.width;
    picture.height = request.height;
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &coded;
    const auto take = request.channels == 4 ? WebPPictureImportRGBA : WebPPictureImportRGB;
    if (!take(&picture, request.values, request.width * request.channels) ||
        !WebPEncode(&config, &picture))
        throw Failed{ErrorCode::failed, "the picture cannot be coded as WebP"};
    std::FILE* file = std::fopen(request.path, "wb");
    if (!file) cannotWrite("the file cannot be opened");
    const bool written = std::fwrite(coded.mem, 1, coded.size, file) == coded.size;
    if (std::fclose(file) != 0 || !written) cannotWrite("the file cannot be written");
}

}  // namespace stx::codecs
