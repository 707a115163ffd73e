#include "formats/images/images.hpp"

#include <algorithm>
#include <cstring>

#include "formats/images/codec_module.hpp"
#include "formats/images/damage.hpp"
#include "formats/images/exr_image.hpp"
#include "formats/images/isolated_decode.hpp"
#include "formats/images/npy.hpp"
#include "formats/images/reader.hpp"

namespace stx {

namespace {

ErrorCode codeOf(const codecs::Failure& failure) {
    switch (failure.code) {
        case static_cast<int>(ErrorCode::invalidInput):
        case static_cast<int>(ErrorCode::unsupported):
        case static_cast<int>(ErrorCode::io):
            return static_cast<ErrorCode>(failure.code);
        default:
            return ErrorCode::failed;
    }
}

/// What the module's callback works with.
struct Decoding {
    ByteSpan bytes;
    const Limits& limits;
    DecodedImage image;
};

void* allocateImage(void* context, const codecs::Header& header, codecs::Failure& failure) {
    auto& decoding = *static_cast<Decoding*>(context);
    const ImageInfo claimed{"other", header.width, header.height, header.channels, header.bits};
    if (auto ok = checkImageHeader(claimed, decoding.bytes.size(), decoding.limits); !ok) {
        failure.code = static_cast<int>(ok.error().code);
        const auto& text = ok.error().message;
        const auto length = std::min(text.size(), sizeof(failure.message) - 1);
        std::memcpy(failure.message, text.data(), length);
        failure.message[length] = 0;
        return nullptr;
    }
    DecodedImage& image = decoding.image;
    image.width = header.width;
    image.height = header.height;
    image.channels = header.channels;
    image.originX = header.originX;
    image.originY = header.originY;
    image.displayWidth = header.displayWidth;
    image.displayHeight = header.displayHeight;
    image.linear = header.linear;
    image.premultiplied = header.premultiplied;
    image.channelNames.assign(header.channelNames, header.channelNames + header.channels);
    const auto count = static_cast<std::size_t>(header.width) * header.height * header.channels;
    if (header.bits == 8) return image.values.emplace<0>(count).data();
    if (header.bits == 16) return image.values.emplace<1>(count).data();
    return image.values.emplace<2>(count).data();
}

/// The reader of a PNG or JPEG, when what its header claims is allowed.
Result<std::unique_ptr<ImageReader>> openDirect(ByteSpan bytes, const Limits& limits) {
    // From a few bytes, before a library sees the file.
    STX_TRY(const auto claimed, probeImage(bytes));
    STX_CHECK(checkImageHeader(claimed, bytes.size(), limits));
    STX_TRY(auto reader, claimed.format == "png" ? openPng(bytes) : openJpeg(bytes, limits));
    STX_CHECK(checkImageHeader(reader->info(), bytes.size(), limits));
    return reader;
}

Result<DecodedImage> readDirect(ImageReader& reader) {
    const ImageInfo& info = reader.info();
    DecodedImage image;
    image.width = image.displayWidth = info.width;
    image.height = image.displayHeight = info.height;
    image.channels = info.channels;
    if (info.channels > 2) {
        image.channelNames = {"R", "G", "B", "A"};
    } else if (info.format == "png") {
        image.channelNames = {"Y", "A"};
    } else {  // a JPEG does not say what two components are
        image.channelNames = {info.channels == 1 ? "Y" : "R", "G"};
    }
    image.channelNames.resize(static_cast<std::size_t>(info.channels));
    const auto count = static_cast<std::size_t>(info.width) * info.height * info.channels;
    void* values = info.bits == 16 ? static_cast<void*>(image.values.emplace<1>(count).data())
                                   : image.values.emplace<0>(count).data();
    STX_CHECK(reader.read(values));
    return image;
}

Result<Image<glm::u8vec4>> readDirectRgba8(ImageReader& reader, const Limits& limits) {
    if (!reader.givesRgba8()) {
        STX_TRY(const auto image, readDirect(reader));
        return rgba8From(image);
    }
    const ImageInfo& info = reader.info();
    const auto count = static_cast<std::uint64_t>(info.width) * info.height;
    STX_CHECK(limits.checkAllocation(count, sizeof(glm::u8vec4), "the image"));
    Image<glm::u8vec4> image(info.width, info.height);
    STX_CHECK(reader.readRgba8(image.data()));
    return image;
}

Result<DecodedImage> decodeWithCodecs(ByteSpan bytes, const std::string& name,
                                      const Limits& limits) {
    STX_TRY(const auto* table, loadCodecs());
    Decoding decoding{bytes, limits, {}};
    codecs::DecodeRequest request;
    request.bytes = bytes.data();
    request.size = bytes.size();
    request.name = name.c_str();
    request.context = &decoding;
    request.allocate = allocateImage;
    codecs::Failure failure;
    if (!decodeIsolated(*table, request, limits.maxMemoryBytes, failure))
        return fail(codeOf(failure), "{}", failure.message);
    return std::move(decoding.image);
}

/// Neither read here: then OpenImageIO may know it.
bool isOtherKind(ByteSpan bytes) {
    const auto info = probeImage(bytes);
    return !info && info.error().code == ErrorCode::unsupported;
}

template <class T>
Result<T> at(std::string_view name, Result<T> result) {
    if (!result) return tl::unexpected(result.error().at(fmt::format("'{}'", name)));
    return result;
}

/// The same, and says what is wrong with pixels that are given all the same.
template <class T>
Result<T> at(std::string_view name, const ImageReader& reader, Result<T> result) {
    if (result && !reader.damage().empty())
        noteDamaged(fmt::format("'{}': {}", name, reader.damage()));
    return at(name, std::move(result));
}

}  // namespace

Result<DecodedImage> decodeImage(ByteSpan bytes, std::string_view name, const Limits& limits) {
    if (bytes.empty())
        return failAt(fmt::format("'{}'", name), ErrorCode::invalidInput,
                      "the image file is empty");
    if (isExr(bytes)) return decodeExr(bytes, name, limits);
    if (isNumpy(bytes)) return at(name, decodeNumpy(bytes, limits));
    if (isOtherKind(bytes)) return at(name, decodeWithCodecs(bytes, std::string(name), limits));
    const auto reader = openDirect(bytes, limits);
    if (!reader) return at<DecodedImage>(name, tl::unexpected(reader.error()));
    auto image = readDirect(**reader);
    return at(name, **reader, std::move(image));
}

Result<Image<glm::u8vec4>> decodeRgba8(ByteSpan bytes, std::string_view name,
                                       const Limits& limits) {
    if (bytes.empty() || isExr(bytes) || isOtherKind(bytes)) {
        STX_TRY(const auto image, decodeImage(bytes, name, limits));
        return rgba8From(image);
    }
    const auto reader = openDirect(bytes, limits);
    if (!reader) return at<Image<glm::u8vec4>>(name, tl::unexpected(reader.error()));
    auto image = readDirectRgba8(**reader, limits);
    return at(name, **reader, std::move(image));
}

}  // namespace stx
