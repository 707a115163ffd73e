#include "formats/images/images.hpp"

#include <cstdio>

#include "formats/images/exr_image.hpp"
#include "formats/images/foreign_decode.hpp"
#include "formats/images/npy.hpp"
#include "formats/images/pnm.hpp"
#include "formats/images/reader.hpp"
#include "lib/base/placed.hpp"

namespace stx {

namespace {

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
    if (info.greyBits > 0) image.storedLargest = (1 << info.greyBits) - 1;
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

Result<Image<glm::u8vec4>> readDirectRgba8(ImageReader& reader, const Limits& limits,
                                           Rgba8Loss* loss) {
    if (!reader.givesRgba8()) {
        STX_TRY(const auto image, readDirect(reader));
        return rgba8From(image, loss);
    }
    const ImageInfo& info = reader.info();
    const auto count = static_cast<std::uint64_t>(info.width) * info.height;
    STX_CHECK(limits.checkAllocation(count, sizeof(glm::u8vec4), "the image"));
    Image<glm::u8vec4> image(info.width, info.height);
    STX_CHECK(reader.readRgba8(image.data()));
    return image;
}

/// Neither read here: then OpenImageIO may know it.
bool isOtherKind(ByteSpan bytes) {
    const auto info = probeImage(bytes);
    return !info && info.error().code == ErrorCode::unsupported;
}

/// Lays what is stored into the picture that it is a part of (OpenEXR's display window).
Result<void> placeInDisplay(DecodedImage& image, const Limits& limits) {
    const glm::ivec2 stored(image.width, image.height), at(image.originX, image.originY),
        whole(image.displayWidth, image.displayHeight);
    if (whole.x < 1 || whole.y < 1 || (at == glm::ivec2(0) && stored == whole)) return {};
    const auto pixels = static_cast<std::uint64_t>(whole.x) * static_cast<std::uint64_t>(whole.y);
    const auto each = static_cast<std::uint64_t>(image.channels);
    STX_CHECK(limits.checkAllocation(pixels, each * image.bits() / 8, "the picture"));
    std::visit(
        [&](auto& values) {
            std::decay_t<decltype(values)> all(pixels * each);
            place(values.data(), stored, at, all.data(), whole, image.channels);
            values = std::move(all);
        },
        image.values);
    image.width = whole.x;
    image.height = whole.y;
    image.originX = image.originY = 0;
    return {};
}

/// What is said of a Radiance picture whose values were multiplied with factors; else empty.
std::string noteOfFactors(ByteSpan bytes) {
    constexpr std::size_t kMostHeader = 4096;
    std::string_view header(reinterpret_cast<const char*>(bytes.data()),
                            std::min(bytes.size(), kMostHeader));
    if (!header.starts_with("#?")) return {};
    header = header.substr(0, header.find("\n\n"));
    for (const char* name : {"EXPOSURE", "COLORCORR"}) {
        const std::string field = fmt::format("\n{}=", name);
        // Each multiplies; many programs write ones.
        for (std::size_t at = header.find(field); at != std::string_view::npos;
             at = header.find(field, at + 1)) {
            const auto from = at + field.size();
            const std::string factors(header.substr(from, header.find('\n', from) - from));
            float k[3] = {1, 1, 1};
            (void)std::sscanf(factors.c_str(), "%f %f %f", &k[0], &k[1], &k[2]);
            if (k[0] != 1 || k[1] != 1 || k[2] != 1)
                return fmt::format(
                    "its values are taken as they are, though {} in its header says that light "
                    "was multiplied",
                    name);
        }
    }
    return {};
}

template <class T>
Result<T> at(std::string_view name, Result<T> result) {
    if (!result) return tl::unexpected(result.error().at(fmt::format("'{}'", name)));
    return result;
}

/// The same, and says what is wrong with pixels that are given all the same.
template <class T>
Result<T> at(std::string_view name, const ImageReader& reader, const Limits& limits,
             Result<T> result) {
    if (result && !reader.damage().empty())
        limits.keepDamaged(fmt::format("'{}': {}", name, reader.damage()));
    return at(name, std::move(result));
}

}  // namespace

Result<DecodedImage> decodeDepthImage(ByteSpan bytes, std::string_view name, const Limits& limits) {
    if (!isExr(bytes)) return decodeImage(bytes, name, limits);
    STX_TRY(auto image, decodeExr(bytes, name, limits, true));
    STX_CHECK(at(name, placeInDisplay(image, limits)));
    return image;
}

Result<DecodedImage> decodeImage(ByteSpan bytes, std::string_view name, const Limits& limits) {
    if (bytes.empty())
        return failAt(fmt::format("'{}'", name), ErrorCode::invalidInput,
                      "the image file is empty");
    if (isExr(bytes)) {
        STX_TRY(auto image, decodeExr(bytes, name, limits));
        STX_CHECK(at(name, placeInDisplay(image, limits)));
        return image;
    }
    if (isNumpy(bytes)) return at(name, decodeNumpy(bytes, limits));
    if (isPnm(bytes)) return at(name, decodePnm(bytes, limits));
    if (isOtherKind(bytes)) {
        STX_TRY(auto image, at(name, decodeForeign(bytes, name, limits)));
        STX_CHECK(at(name, placeInDisplay(image, limits)));
        image.coloursNote = noteOfFactors(bytes);
        return image;
    }
    const auto reader = openDirect(bytes, limits);
    if (!reader) return at<DecodedImage>(name, tl::unexpected(reader.error()));
    auto image = readDirect(**reader);
    return at(name, **reader, limits, std::move(image));
}

Result<Image<glm::u8vec4>> decodeRgba8(ByteSpan bytes, std::string_view name, const Limits& limits,
                                       Rgba8Loss* loss) {
    if (bytes.empty() || isExr(bytes) || isOtherKind(bytes)) {
        STX_TRY(auto image, decodeImage(bytes, name, limits));
        (void)toRec709(image);
        return rgba8From(image, loss);
    }
    const auto reader = openDirect(bytes, limits);
    if (!reader) return at<Image<glm::u8vec4>>(name, tl::unexpected(reader.error()));
    auto image = readDirectRgba8(**reader, limits, loss);
    return at(name, **reader, limits, std::move(image));
}

}  // namespace stx
