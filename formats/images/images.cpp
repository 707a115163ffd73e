#include "formats/images/images.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <shared_mutex>

#include "formats/exr/exr_image.hpp"
#include "formats/images/codec_module.hpp"
#include "formats/images/isolated_decode.hpp"
#include "formats/images/strip.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/texture.hpp"

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

/// More pixels than `size` bytes of any such file can hold, whatever is in them? A few bytes that
/// claim gigabytes are refused before memory is taken.
Result<void> checkPlausible(ByteSpan bytes, const codecs::Header& header) {
    const auto pixels = static_cast<std::uint64_t>(header.width) * header.height;
    const auto values = pixels * static_cast<std::uint64_t>(header.channels);
    // Small enough not to hurt anybody, and some formats code flat pictures in a handful of bytes.
    if (values <= (16u << 20)) return {};
    const std::uint64_t size = bytes.size();
    std::uint64_t most = size * 8192;  // TIFF, EXR, WebP, ...: deflate over runs
    const auto info = probeImage(bytes);
    // Deflate gives at most 1032 bytes for one; a byte may be eight pixels, each of a palette.
    if (info && info->format == "png") most = size * 1032 * 8 * 4;
    if (info && info->format == "png" && info->bits == 16) most = size * 516;
    // One bit for each block of 8x8 in a progressive file's first scan.
    if (info && info->format == "jpeg") most = size * 8 * 64 * 4;
    if (values <= most) return {};
    return fail(ErrorCode::invalidInput,
                "the header claims {}x{} pixels of {} channels, more than a file of {} bytes can "
                "hold",
                header.width, header.height, header.channels, size);
}

Result<void> checkHeader(ByteSpan bytes, const codecs::Header& header, const Limits& limits) {
    if (header.width < 1 || header.height < 1 || header.channels < 1)
        return fail(ErrorCode::invalidInput,
                    "the header claims {}x{} pixels of {} channels; each must be 1 or more",
                    header.width, header.height, header.channels);
    if (header.width > limits.maxImageSide || header.height > limits.maxImageSide)
        return fail(ErrorCode::invalidInput,
                    "the header claims {}x{} pixels; at most {} pixels a side are read",
                    header.width, header.height, limits.maxImageSide);
    constexpr int kMaxChannels = 1024;
    if (header.channels > kMaxChannels)
        return fail(ErrorCode::invalidInput, "the header claims {} channels; at most {} are read",
                    header.channels, kMaxChannels);
    STX_CHECK(limits.checkAllocation(static_cast<std::uint64_t>(header.width) * header.height,
                                     static_cast<std::uint64_t>(header.channels) * header.bits / 8,
                                     "the image"));
    return checkPlausible(bytes, header);
}

/// What the module's callback works with.
struct Decoding {
    ByteSpan bytes;
    const Limits& limits;
    DecodedImage image;
};

void* allocateImage(void* context, const codecs::Header& header, codecs::Failure& failure) {
    auto& decoding = *static_cast<Decoding*>(context);
    if (auto ok = checkHeader(decoding.bytes, header, decoding.limits); !ok) {
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

void appendBytes(void* context, const void* bytes, std::size_t size) {
    const auto* from = static_cast<const std::byte*>(bytes);
    static_cast<Bytes*>(context)->insert(static_cast<Bytes*>(context)->end(), from, from + size);
}

/// Shared while a thread is inside the codecs, alone while a process is forked for one: the copy
/// must not find their locks taken by threads that it has not.
std::shared_mutex& codecsInUse() {
    static std::shared_mutex mutex;
    return mutex;
}

Result<Bytes> encode(codecs::EncodeRequest request, std::string_view kind) {
    STX_TRY(const auto* table, loadCodecs());
    Bytes bytes;
    request.context = &bytes;
    request.emit = appendBytes;
    codecs::Failure failure;
    const std::shared_lock lock(codecsInUse());
    if (!table->encode(request, failure))
        return fail(ErrorCode::failed, "cannot encode a {} of {}x{} pixels: {}", kind,
                    request.width, request.height, failure.message);
    return stripMetadata(bytes);
}

Result<void> checkEncodable(int width, int height, std::string_view kind) {
    if (width >= 1 && height >= 1 && width <= 65535 && height <= 65535) return {};
    return fail(ErrorCode::failed,
                "cannot encode a {} of {}x{} pixels; 1 to 65535 a side is possible", kind, width,
                height);
}

/// Index of the channel with that name, in the main layer if there are several; -1 = none.
int channelNamed(const DecodedImage& image, std::string_view name) {
    for (int i = 0; i < image.channels; ++i) {
        if (image.channelNames[i] == name) return i;
    }
    return -1;
}

struct ColourChannels {
    int r = 0, g = 0, b = 0, a = -1;  ///< indices; a = -1: there is no alpha
};

/// Where an image's colour stands: by name, else by position.
ColourChannels colourChannels(const DecodedImage& image) {
    int r = channelNamed(image, "R"), g = channelNamed(image, "G"), b = channelNamed(image, "B");
    int a = channelNamed(image, "A");
    if (r < 0 || g < 0 || b < 0) {
        const bool grey = image.channels < 3;
        r = 0;
        g = grey ? 0 : 1;
        b = grey ? 0 : 2;
        if (a < 0 && (image.channels == 2 || image.channels == 4)) a = image.channels - 1;
        if (a == 0) a = -1;
    }
    return {r, g, b, a};
}

}  // namespace

Result<DecodedImage> decodeImage(ByteSpan bytes, std::string_view name, const Limits& limits) {
    const std::string shown(name);
    const auto where = fmt::format("'{}'", shown);
    if (bytes.empty()) return failAt(where, ErrorCode::invalidInput, "the image file is empty");
    if (isExr(bytes)) return decodeExr(bytes, name, limits);
    // Told from a few bytes, before a library is loaded or trusted.
    const auto info = probeImage(bytes);
    if (info) {
        codecs::Header header;
        header.width = info->width;
        header.height = info->height;
        header.channels = info->channels;
        header.bits = info->bits > 8 ? 16 : 8;
        if (auto ok = checkHeader(bytes, header, limits); !ok)
            return tl::unexpected(ok.error().at(where));
    }
    auto stripped = stripMetadata(bytes);
    if (!stripped) return tl::unexpected(stripped.error().at(where));
    const auto table = loadCodecs();
    if (!table) return tl::unexpected(table.error().at(where));
    Decoding decoding{bytes, limits, {}};
    codecs::DecodeRequest request;
    request.bytes = stripped->data();
    request.size = stripped->size();
    request.name = shown.c_str();
    request.context = &decoding;
    request.allocate = allocateImage;
    codecs::Failure failure;
    bool decoded = false;
    if (info) {
        const std::shared_lock lock(codecsInUse());
        decoded = (*table)->decode(request, failure);
    } else {
        // PNG and JPEG reach their decoders without metadata; the others' fail on less.
        const std::unique_lock lock(codecsInUse());
        decoded = decodeIsolated(**table, request, limits.maxMemoryBytes, failure);
    }
    if (!decoded) return failAt(where, codeOf(failure), "{}", failure.message);
    return std::move(decoding.image);
}

Image<glm::u8vec4> rgba8From(const DecodedImage& image) {
    Image<glm::u8vec4> out(image.width, image.height);
    const ColourChannels at = colourChannels(image);
    const int r = at.r, g = at.g, b = at.b, a = at.a;
    const auto pixel = [&](const auto* values, const auto& coded) {
        parallelFor(0, image.height, [&](std::int64_t y) {
            const auto* p = values + static_cast<std::size_t>(y) * image.width * image.channels;
            for (auto& q : out.row(static_cast<int>(y))) {
                q = coded(p[r], p[g], p[b], a < 0 ? nullptr : p + a);
                p += image.channels;
            }
        });
    };
    if (const auto* v8 = std::get_if<0>(&image.values)) {
        pixel(v8->data(), [](auto red, auto green, auto blue, const auto* alpha) {
            return glm::u8vec4(red, green, blue, alpha ? *alpha : 255);
        });
    } else if (const auto* v16 = std::get_if<1>(&image.values)) {
        const auto to8 = [](std::uint32_t v) {
            return static_cast<std::uint8_t>((v * 255u + 32767u) / 65535u);
        };
        pixel(v16->data(), [&](auto red, auto green, auto blue, const auto* alpha) {
            return glm::u8vec4(to8(red), to8(green), to8(blue), alpha ? to8(*alpha) : 255);
        });
    } else {
        const auto to8 = [](float v) {
            return static_cast<std::uint8_t>(std::clamp(v, 0.0f, 1.0f) * 255.0f + 0.5f);
        };
        const bool premultiplied = image.premultiplied && a >= 0;
        const auto colour = [&](float v, float alpha) {
            if (premultiplied && alpha > 0.0f) v /= alpha;
            return to8(image.linear ? srgbFromLinear(v) : v);
        };
        pixel(std::get<2>(image.values).data(),
              [&](float red, float green, float blue, const float* alpha) {
                  const float cover = alpha ? *alpha : 1.0f;
                  return glm::u8vec4(colour(red, cover), colour(green, cover), colour(blue, cover),
                                     to8(cover));
              });
    }
    return out;
}

Result<Bytes> encodePng(int width, int height, int channels, int bits, const void* values,
                        bool srgb, int level) {
    STX_CHECK(checkEncodable(width, height, "PNG"));
    if (channels < 1 || channels > 4 || (bits != 8 && bits != 16))
        return fail(ErrorCode::failed,
                    "cannot encode a PNG of {} channels of {} bits; 1 to 4 of 8 or 16 is possible",
                    channels, bits);
    codecs::EncodeRequest request;
    request.format = "png";
    request.width = width;
    request.height = height;
    request.channels = channels;
    request.bits = bits;
    request.values = values;
    request.srgb = srgb;
    request.level = std::clamp(level, 0, 9);
    return encode(request, "PNG");
}

Result<Bytes> encodeJpeg(int width, int height, int channels, const std::uint8_t* values,
                         int quality) {
    STX_CHECK(checkEncodable(width, height, "JPEG"));
    if ((channels != 1 && channels != 3) || quality < 1 || quality > 100)
        return fail(ErrorCode::failed,
                    "cannot encode a JPEG of {} channels at quality {}; 1 or 3 at 1 to 100 is "
                    "possible",
                    channels, quality);
    codecs::EncodeRequest request;
    request.format = "jpeg";
    request.width = width;
    request.height = height;
    request.channels = channels;
    request.values = values;
    request.srgb = true;
    request.quality = quality;
    return encode(request, "JPEG");
}

Image<glm::vec4> rgbaFloatFrom(const DecodedImage& image) {
    Image<glm::vec4> out(image.width, image.height);
    const ColourChannels at = colourChannels(image);
    const int r = at.r, g = at.g, b = at.b, a = at.a;
    std::visit(
        [&](const auto& values) {
            using Value = typename std::decay_t<decltype(values)>::value_type;
            constexpr float kScale = std::is_same_v<Value, std::uint8_t>    ? 1.0f / 255.0f
                                     : std::is_same_v<Value, std::uint16_t> ? 1.0f / 65535.0f
                                                                            : 1.0f;
            const auto* p = values.data();
            for (auto& q : out.pixels()) {
                const float alpha = a < 0 ? 1.0f : static_cast<float>(p[a]) * kScale;
                q = glm::vec4(p[r] * kScale, p[g] * kScale, p[b] * kScale, alpha);
                if (image.premultiplied && alpha > 0.0f) q = glm::vec4(glm::vec3(q) / alpha, alpha);
                p += image.channels;
            }
        },
        image.values);
    return out;
}

}  // namespace stx
