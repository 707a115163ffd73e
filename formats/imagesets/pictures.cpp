#include "formats/imagesets/pictures.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

#include "formats/files/messages.hpp"
#include "formats/images/images.hpp"
#include "formats/images/more_pictures.hpp"
#include "formats/imagesets/text_lines.hpp"
#include "formats/photos/file_colours.hpp"
#include "formats/video/film.hpp"
#include "lib/base/parallel.hpp"

namespace stx::imagesets {
namespace {

Result<DecodedImage> decode(const std::string& name, ByteSpan bytes, Job& job,
                            decltype(decodeImage)* decoder = decodeImage) {
    noteMorePictures(bytes, name, job);
    auto image = decoder(bytes, name, job.limits);
    if (image && (image->width < 1 || image->height < 1))
        return failAt(inQuotes(name), ErrorCode::invalidInput, "the image has no pixels");
    return image;
}

/// The image's channel that holds depth: by its name, or the only one.
Result<int> depthChannel(const DecodedImage& image, std::string_view name) {
    const int at = depthChannelOf(image.channelNames);
    if (at >= 0) return at;
    if (image.channels <= 2) return 0;
    // Blender and others write a depth three times, as grey.
    const bool grey = std::visit(
        [&](const auto& values) {
            const std::size_t step = static_cast<std::size_t>(image.channels);
            for (std::size_t i = 0; i + 2 < values.size(); i += step)
                // NaN (nothing) is not a difference.
                if ((values[i] != values[i + 1] || values[i] != values[i + 2]) &&
                    (values[i] == values[i] || values[i + 1] == values[i + 1] ||
                     values[i + 2] == values[i + 2]))
                    return false;
            return true;
        },
        image.values);
    if (grey) return 0;
    return failAt(inQuotes(name), ErrorCode::invalidInput,
                  "{} channels of different values; a depth image has one, or one named Z",
                  image.channels);
}

/// Linear floats of integers that code sRGB. Floats are finer than 16 bits everywhere, so that
/// these come back.
RgbaFloatImage linearFromCoded(RgbaFloatImage out) {
    parallelFor(0, out.height(), [&](std::int64_t y) {
        for (glm::vec4& c : out.row(static_cast<int>(y)))
            c = {linearFromSrgb(c.r), linearFromSrgb(c.g), linearFromSrgb(c.b), c.a};
    });
    return out;
}

Result<Image<float>> floatsFrom(ByteSpan bytes, int width, int height, bool littleEndian,
                                int channels, std::string_view name) {
    const std::uint64_t need = static_cast<std::uint64_t>(width) * height * channels * 4;
    if (bytes.size() < need)
        return failAt(inQuotes(name), ErrorCode::invalidInput,
                      "{} bytes of pixels; {}x{} floats need {} (is the file cut short?)",
                      bytes.size(), width, height, need);
    Image<float> out(width, height);
    const auto* from = reinterpret_cast<const std::uint8_t*>(bytes.data());
    for (std::size_t i = 0; i < out.count(); ++i) {
        const std::uint8_t* b = from + i * 4 * static_cast<std::size_t>(channels);
        const std::uint32_t bits =
            littleEndian ? b[0] | b[1] << 8 | b[2] << 16 | static_cast<std::uint32_t>(b[3]) << 24
                         : b[3] | b[2] << 8 | b[1] << 16 | static_cast<std::uint32_t>(b[0]) << 24;
        out.data()[i] = std::bit_cast<float>(bits);
    }
    return out;
}

Result<void> checkSide(double width, double height, std::string_view name, const Limits& limits) {
    if (!(width >= 1 && height >= 1 && width <= limits.maxImageSide &&
          height <= limits.maxImageSide))
        return failAt(inQuotes(name), ErrorCode::invalidInput,
                      "the image claims {}x{} pixels; each side must be 1 to {}", width, height,
                      limits.maxImageSide);
    return {};
}

/// The channel of that name; -1: there is none.
int channelIn(const DecodedImage& image, std::string_view name) {
    const auto it = std::ranges::find(image.channelNames, name);
    return it == image.channelNames.end() ? -1 : static_cast<int>(it - image.channelNames.begin());
}

/// Channels by their names: R G B, or one grey for all three.
Result<RgbaFloatImage> colourOfFloats(const DecodedImage& image, std::string_view name) {
    int at[4] = {channelIn(image, "R"), channelIn(image, "G"), channelIn(image, "B"),
                 channelIn(image, "A")};
    if (at[0] < 0 && at[1] < 0 && at[2] < 0) {
        const int grey = channelIn(image, "Y") >= 0 ? channelIn(image, "Y")
                         : image.channels <= 2      ? 0
                                                    : -1;
        if (grey < 0)
            return failAt(inQuotes(name), ErrorCode::invalidInput,
                          "there are no channels R, G, B or Y in it");
        at[0] = at[1] = at[2] = grey;
    }
    const auto& values = std::get<std::vector<float>>(image.values);
    RgbaFloatImage pixels(image.width, image.height);
    for (std::size_t i = 0; i < pixels.count(); ++i) {
        glm::vec4 p(0, 0, 0, 1);
        for (int k = 0; k < 4; ++k) {
            if (at[k] < 0) continue;
            const float v = values[i * static_cast<std::size_t>(image.channels) +
                                   static_cast<std::size_t>(at[k])];
            if (!std::isfinite(v))
                return failAt(inQuotes(name), ErrorCode::invalidInput,
                              "a colour at column {}, row {} is not finite",
                              i % static_cast<std::size_t>(image.width),
                              i / static_cast<std::size_t>(image.width));
            p[k] = v;
        }
        if (at[3] >= 0) {
            p.a = std::clamp(p.a, 0.0f, 1.0f);
            if (image.premultiplied && p.a > 0) p = glm::vec4(glm::vec3(p) / p.a, p.a);
        }
        pixels.data()[i] = p;
    }
    return pixels;
}

/// Said even where the notes of a film's later frames are dropped.
void noteRounding(int bits, std::string_view remedy, Job& job) {
    job.noteOnce(fmt::format("colour of {} bits is rounded to 8{}", bits, remedy));
}

}  // namespace

Result<StoredColour> readColour(const PictureSource& source, const YuvColour& colour, bool deep,
                                Job& job) {
    StoredColour out;
    if (source.yuv) {
        STX_TRY(auto image,
                readYuvColour(source.path, *source.yuv, source.frame, colour, job.limits));
        if (source.yuv->bits > 8) noteRounding(source.yuv->bits, "", job);
        out.texture = std::move(image);
        return out;
    }
    if (source.film) {
        STX_TRY(const auto picture, source.film->picture(source.frame));
        if (picture.bits() > 8) noteRounding(picture.bits(), "", job);
        if (const std::string note = picture.notConverted(); !note.empty())
            job.note(inQuotes(source.name) + ": " + note + VideoPicture::kConvertFirst);
        STX_TRY(auto image, within(inQuotes(source.name), picture.colour(job.limits)));
        out.alpha = picture.hasAlpha();
        out.texture = std::move(image);
        return out;
    }
    STX_TRY(const auto bytes, readFile(source.path, job.limits));
    return colourOfFile(bytes, source.name, deep, job);
}

Result<StoredColour> colourOfFile(ByteSpan bytes, const std::string& name, bool deep, Job& job) {
    StoredColour out;
    std::string colours;  // what is to be said of them
    if (const auto info = probeImage(bytes); info && info->bits == 8) {
        // What two components of a JPEG are, it does not say.
        out.alpha = info->format == "png" && info->channels % 2 == 0;
        STX_TRY(auto pixels, decodeRgba8(bytes, name, job.limits));
        photos::fileToSrgb(pixels, bytes, colours);
        if (!colours.empty()) job.note(colours);
        out.texture = std::move(pixels);
        return out;
    }
    STX_TRY(auto image, decode(name, bytes, job));
    out.alpha = image.channelNames.empty() ? image.channels == 2 || image.channels == 4
                                           : channelIn(image, "A") >= 0;
    if (!image.linear) {
        if (image.bits() > 8 && deep) {
            out.texture = linearFromCoded(photos::srgbFloatFrom(image, bytes, colours));
        } else {
            if (image.bits() > 8)
                noteRounding(image.bits(), "; stx convert -o NAME.exr keeps it", job);
            out.texture = photos::srgb8From(image, bytes, colours);
        }
        if (!colours.empty()) job.note(colours);
        return out;
    }
    if (const std::string note = toRec709(image); !note.empty()) job.note(note);
    STX_TRY(auto pixels, colourOfFloats(image, name));
    out.texture = std::move(pixels);
    return out;
}

Result<StoredDepth> readDepth(const PictureSource& source, Job& job) {
    StoredDepth out;
    if (source.yuv) {
        out.largest = (1 << source.yuv->bits) - 1;
        STX_TRY(out.values, readYuvLuma(source.path, *source.yuv, source.frame, job.limits));
        return out;
    }
    if (source.film) {
        STX_TRY(const auto picture, source.film->picture(source.frame));
        if (!picture.hasLuma())
            return failAt(inQuotes(source.name), ErrorCode::invalidInput,
                          "its pixels are colours; depth is grey, or luma, of 8 to 16 bits: "
                          "ffmpeg -i IN -c:v ffv1 -pix_fmt gray16le OUT.mkv");
        if (picture.saysLimited())
            job.note(
                fmt::format("'{}' says that its range is limited (16 to 235); its depth is "
                            "taken as it is coded",
                            source.name));
        out.largest = (1 << picture.bits()) - 1;
        out.values = picture.luma();
        return out;
    }
    if (source.colmap || source.path.extension() == ".pfm") {
        STX_TRY(const auto bytes, readFile(source.path, job.limits));
        const auto parse = source.colmap ? parseColmapDepth : parsePfm;
        STX_TRY(out.values, parse(bytes, source.name, job.limits));
        return out;
    }
    STX_TRY(const auto bytes, readFile(source.path, job.limits));
    STX_TRY(const auto image, decode(source.name, bytes, job, decodeDepthImage));
    STX_TRY(const int channel, depthChannel(image, source.name));
    out.values = Image<float>(image.width, image.height);
    std::visit(
        [&](const auto& values) {
            for (std::size_t i = 0; i < out.values.count(); ++i)
                out.values.data()[i] =
                    static_cast<float>(values[i * static_cast<std::size_t>(image.channels) +
                                              static_cast<std::size_t>(channel)]);
        },
        image.values);
    const double decodedLargest = image.bits() == 32 ? 1 : (1 << image.bits()) - 1;
    if (image.storedLargest == 0) {
        out.largest = image.bits() == 32 ? 0 : static_cast<int>(decodedLargest);
        return out;
    }
    constexpr double kMost = 65535;
    out.largest = static_cast<int>(std::min(image.storedLargest, kMost));
    for (float& v : out.values.pixels()) {
        const double stored = std::round(v / decodedLargest * image.storedLargest);
        if (!(stored >= 0 && stored <= kMost))
            return failAt(inQuotes(source.name), ErrorCode::invalidInput,
                          "the depth has the integer {:.0f}; 0 to 65535 is possible, or floats",
                          stored);
        v = static_cast<float>(stored);
    }
    return out;
}

Result<glm::ivec2> imageSizeOf(const PictureSource& source, Job& job) {
    if (source.film) {
        STX_TRY(const auto picture, source.film->picture(source.frame));
        return glm::ivec2(picture.width(), picture.height());
    }
    STX_TRY(const auto bytes, readFile(source.path, job.limits));
    if (const auto info = probeImage(bytes)) return glm::ivec2(info->width, info->height);
    STX_TRY(const auto image, decode(source.name, bytes, job));
    return glm::ivec2(image.width, image.height);
}

bool sameShape(glm::ivec2 a, glm::ivec2 b) {
    const double difference =
        std::abs(static_cast<double>(a.x) * b.y - static_cast<double>(b.x) * a.y);
    return difference <= std::max({a.x, a.y, b.x, b.y});
}

DepthTurn depthTurnOf(glm::ivec2 size, glm::ivec2 upright, bool sideways, const std::string& name) {
    const glm::ivec2 stored(upright.y, upright.x);
    if (!sideways || sameShape(upright, stored))
        return {false, fmt::format("its depth, '{}', is taken as upright, which its size cannot "
                                   "tell",
                                   name)};
    if (sameShape(size, upright) || !sameShape(size, stored)) return {};
    return {true, fmt::format("its depth, '{}', lies as the sensor saw it and is turned as the "
                              "picture is",
                              name)};
}

Result<Image<float>> parsePfm(ByteSpan bytes, std::string_view name, const Limits& limits) {
    const std::string_view text = textOf(bytes).substr(0, 200);
    const auto complain = [&] {
        return failAt(
            inQuotes(name), ErrorCode::invalidInput,
            "the header is not that of a PFM: 'Pf', width, height and scale are expected");
    };
    if (!text.starts_with("Pf") && !text.starts_with("PF")) return complain();
    const int channels = text[1] == 'F' ? 3 : 1;
    std::size_t at = 2;
    double numbers[3];
    for (double& number : numbers) {
        while (at < text.size() &&
               (text[at] == ' ' || text[at] == '\n' || text[at] == '\r' || text[at] == '\t'))
            ++at;
        const auto [next, error] =
            std::from_chars(text.data() + at, text.data() + text.size(), number);
        if (error != std::errc() || !std::isfinite(number)) return complain();
        at = static_cast<std::size_t>(next - text.data());
    }
    if (at < text.size() && text[at] == '\r') ++at;
    if (at >= text.size() || (text[at] != '\n' && text[at] != ' ')) return complain();
    ++at;
    STX_CHECK(checkSide(numbers[0], numbers[1], name, limits));
    const int width = static_cast<int>(numbers[0]), height = static_cast<int>(numbers[1]);
    if (width != numbers[0] || height != numbers[1] || numbers[2] == 0) return complain();
    STX_TRY(auto upsideDown,
            floatsFrom(bytes.subspan(at), width, height, numbers[2] < 0, channels, name));
    for (int y = 0; y < height / 2; ++y)
        std::swap_ranges(upsideDown.row(y).begin(), upsideDown.row(y).end(),
                         upsideDown.row(height - 1 - y).begin());
    return upsideDown;
}

Result<Image<float>> parseColmapDepth(ByteSpan bytes, std::string_view name, const Limits& limits) {
    const std::string_view text = textOf(bytes).substr(0, 64);
    std::size_t at = 0;
    int numbers[3];
    for (int& number : numbers) {
        const auto [next, error] =
            std::from_chars(text.data() + at, text.data() + text.size(), number);
        const auto end = static_cast<std::size_t>(next - text.data());
        if (error != std::errc() || end >= text.size() || text[end] != '&')
            return failAt(inQuotes(name), ErrorCode::invalidInput,
                          "the file does not begin with 'width&height&channels&' as COLMAP's depth "
                          "maps do");
        at = end + 1;
    }
    STX_CHECK(checkSide(numbers[0], numbers[1], name, limits));
    if (numbers[2] != 1)
        return failAt(inQuotes(name), ErrorCode::invalidInput,
                      "{} channels; a depth map has 1 (is this a normal map?)", numbers[2]);
    return floatsFrom(bytes.subspan(at), numbers[0], numbers[1], true, 1, name);
}

}  // namespace stx::imagesets
