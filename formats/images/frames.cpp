#include "formats/images/frames.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>

#include "formats/exr/bundle_exr.hpp"
#include "formats/exr/exr_file.hpp"
#include "formats/exr/exr_zip.hpp"
#include "formats/files/source_date.hpp"
#include "formats/images/codec_module.hpp"
#include "formats/images/images.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/linear_planes.hpp"
#include "lib/model/texture.hpp"

namespace stx {

namespace {

/// Premultiplied linear light of an image that is premultiplied in the frame's colour space: a
/// plane of red, then green, blue and alpha, for these are stored apart. True when all of `other`,
/// if there is one, is the same as the image.
bool toLinearPlanes(const Image<glm::vec4>& image, bool linear,
                    const std::optional<glm::vec3>& background, const Image<glm::vec4>* other,
                    std::uint16_t* planes) {
    const auto width = static_cast<std::size_t>(image.width());
    std::atomic<bool> same = true;
    parallelForBlocks(0, image.height(), 16, [&](std::int64_t begin, std::int64_t end) {
        std::vector<glm::vec4> shown(background ? width : 0);
        std::vector<float> light(linear ? 0 : 4 * width);
        std::array<float*, 4> channels{};
        for (std::size_t c = 0; c < 4; ++c) channels[c] = light.data() + c * width;
        for (auto y = static_cast<int>(begin); y < end; ++y) {
            std::span<const glm::vec4> from = image.row(y);
            if (other && same &&
                std::memcmp(from.data(), other->row(y).data(), from.size_bytes()) != 0)
                same = false;
            if (background) {
                std::ranges::transform(from, shown.begin(),
                                       [&](glm::vec4 p) { return over(p, background); });
                from = shown;
            }
            if (!linear) linearPlanes(from.data(), width, channels);
            for (std::size_t c = 0; c < 4; ++c)
                exr::halvesFrom(
                    linear ? &from.data()->x + c : channels[c], linear ? 4 : 1,
                    {planes + c * image.count() + static_cast<std::size_t>(y) * width, width});
        }
    });
    return same;
}

std::vector<std::uint8_t> withoutAlpha(const Rgba8Image& rgba) {
    std::vector<std::uint8_t> rgb;
    rgb.reserve(rgba.count() * 3);
    for (const auto& p : rgba.pixels()) rgb.insert(rgb.end(), {p.r, p.g, p.b});
    return rgb;
}

/// By the module of image codecs, into the file's temporary name.
Result<void> writeByModule(const Rgba8Image& rgba, FrameFormat format, const OutputFile& file,
                           const FrameOptions& options) {
    STX_TRY(const auto* codecs, loadCodecs());
    std::vector<std::uint8_t> rgb;
    codecs::EncodeRequest request;
    STX_TRY(const std::string path, file.temporaryPath());
    request.path = path.c_str();
    request.format = format == FrameFormat::tiff ? "tiff" : "webp";
    request.width = rgba.width();
    request.height = rgba.height();
    request.channels = 4;
    request.values = &rgba.data()->x;
    // TIFF is never written without a time.
    const std::string date = exrDate(sourceDate().value_or(0));
    request.date = date.c_str();
    if (options.background) {
        rgb = withoutAlpha(rgba);
        request.channels = 3;
        request.values = rgb.data();
    }
    codecs::Failure failure;
    if (!codecs->encode(request, failure))
        return fail(static_cast<ErrorCode>(failure.code), "{}", failure.message);
    return {};
}

Result<void> writeExr(const ExrFrame& frame, OutputFile& file, const FrameOptions& options) {
    ExrPart part;
    part.width = part.displayWidth = frame.width;
    part.height = part.displayHeight = frame.height;
    part.zipLevel = 1;
    if (options.around) {
        part.envmap = ExrPart::Envmap::latlong;
    } else if (options.camera) {
        const double aspect = options.camera->fy / options.camera->fx;
        if (aspect > 1e-5 && aspect < 1e5 && std::abs(aspect - 1.0) > 1e-6)
            part.pixelAspectRatio = aspect;
        // Planes only scale the third coordinate of NDC, which nobody uses.
        setExrCamera(part, *options.camera, 0.0, 1.0);
        setExrOrigin(part, options.origin);
    }
    const std::size_t pixels = static_cast<std::size_t>(frame.width) * frame.height;
    std::vector<ExrConstPixels> values;
    for (const auto& [name, plane] : frame.channels) {
        part.channels.push_back({name, ExrChannel::Type::half});
        values.push_back({.channel = name,
                          .halves = frame.planes.get() + static_cast<std::size_t>(plane) * pixels});
    }
    if (!frame.depth.empty()) {
        part.channels.push_back({"Z", ExrChannel::Type::float32});
        values.push_back({.channel = "Z", .values = frame.depth.data()});
    }
    STX_TRY(auto writer, ExrWriter::create(file, {part}));
    STX_CHECK(writer.writePart(0, values));
    return writer.finish();
}

}  // namespace

Result<FrameFormat> frameFormat(const std::filesystem::path& path) {
    if (path == "-") return FrameFormat::png;
    std::string ending = path.extension().string();
    for (char& c : ending) {
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    }
    if (ending == ".png") return FrameFormat::png;
    if (ending == ".jpg" || ending == ".jpeg") return FrameFormat::jpeg;
    if (ending == ".exr") return FrameFormat::exr;
    if (ending == ".tif" || ending == ".tiff") return FrameFormat::tiff;
    if (ending == ".webp") return FrameFormat::webp;
    return fail(ErrorCode::usage,
                "cannot write a picture as '{}'; its name must end in .png, .jpg, .exr, .tif or "
                ".webp",
                path.string());
}

Result<void> checkFrameSize(const std::filesystem::path& path, int width, int height) {
    STX_TRY(const FrameFormat format, frameFormat(path));
    constexpr int kJpegSide = 65500, kWebpSide = 16383;
    const bool jpeg = format == FrameFormat::jpeg;
    const int most = jpeg ? kJpegSide : kWebpSide;
    if ((!jpeg && format != FrameFormat::webp) || std::max(width, height) <= most) return {};
    return fail(ErrorCode::usage,
                "'{}': a {} picture of {}x{} is asked for; {} a side are possible, of PNG and "
                "OpenEXR more",
                path.string(), jpeg ? "JPEG" : "WebP", width, height, most);
}

Rgba8Image pictureOf(const Frame& frame, FrameFormat format,
                     const std::optional<glm::vec3>& background) {
    return rgba8From(frame,
                     format == FrameFormat::jpeg && !background ? glm::vec3(0.0f) : background);
}

Result<Bytes> encodePicture(const Rgba8Image& rgba, FrameFormat format,
                            const FrameOptions& options) {
    if (format != FrameFormat::png && format != FrameFormat::jpeg)
        return fail(ErrorCode::failed,
                    "an OpenEXR, TIFF or WebP picture is written to a file, not to memory");
    if (format == FrameFormat::png && !options.background)
        return encodePng(rgba.width(), rgba.height(), 4, 8, rgba.data(), true, options.pngLevel);
    const auto rgb = withoutAlpha(rgba);
    if (format == FrameFormat::jpeg)
        return encodeJpeg(rgba.width(), rgba.height(), 3, rgb.data(), options.jpegQuality);
    return encodePng(rgba.width(), rgba.height(), 3, 8, rgb.data(), true, options.pngLevel);
}

ExrFrame exrFrameOf(const Frame& frame, const std::optional<glm::vec3>& background) {
    ExrFrame out;
    out.width = frame.colour.width();
    out.height = frame.colour.height();
    const std::size_t pixels = frame.colour.count();
    const bool albedo = !frame.albedo.empty(), normals = !frame.normal.empty();
    const int most = 4 + (albedo ? 4 : 0) + (normals ? 3 : 0);
    out.planes =
        std::make_unique_for_overwrite<std::uint16_t[]>(static_cast<std::size_t>(most) * pixels);
    int planes = 0;
    const auto next = [&](int count) {
        std::uint16_t* to = out.planes.get() + static_cast<std::size_t>(planes) * pixels;
        planes += count;
        return to;
    };
    constexpr std::array kNames = {"R", "G", "B", "A"};
    const auto behind = inSpaceOf(frame, background);
    // Without lights and a background albedo is the colour.
    const bool same = toLinearPlanes(frame.colour, frame.linear, behind,
                                     albedo && !behind ? &frame.albedo : nullptr, next(4));
    for (int c = 0; c < 4; ++c) out.channels.emplace_back(kNames[c], c);
    if (albedo) {
        const bool own = behind || !same;
        for (int c = 0; c < 4; ++c)
            out.channels.emplace_back(fmt::format("albedo.{}", kNames[c]), c + (own ? planes : 0));
        if (own) (void)toLinearPlanes(frame.albedo, frame.linear, {}, nullptr, next(4));
    }
    if (normals) {
        for (int c = 0; c < 3; ++c)
            out.channels.emplace_back(fmt::format("N.{}", "XYZ"[c]), c + planes);
        std::uint16_t* const first = next(3);
        const auto width = static_cast<std::size_t>(out.width);
        parallelFor(0, out.height, 16, [&](int y) {
            std::uint16_t* const to = first + static_cast<std::size_t>(y) * width;
            for (std::size_t c = 0; c < 3; ++c)
                exr::halvesFrom(&frame.normal.row(y).data()->x + c, 3, {to + c * pixels, width});
        });
    }
    out.depth = frame.depth;
    return out;
}

Result<void> writeExrFrame(const ExrFrame& frame, const std::filesystem::path& path,
                           const FrameOptions& options) {
    STX_TRY(auto file, OutputFile::create(path, {.noClobber = options.noClobber}));
    STX_CHECK(within(fmt::format("'{}'", path.string()), writeExr(frame, file, options)));
    return file.commit();
}

Result<void> writePicture(const Rgba8Image& picture, const std::filesystem::path& path,
                          const FrameOptions& options) {
    STX_TRY(const FrameFormat format, frameFormat(path));
    STX_CHECK(checkFrameSize(path, picture.width(), picture.height()));
    STX_TRY(auto file, OutputFile::create(path, {.noClobber = options.noClobber}));
    if (format == FrameFormat::tiff || format == FrameFormat::webp) {
        STX_CHECK(within(fmt::format("'{}'", path.string()),
                         writeByModule(picture, format, file, options)));
    } else {
        STX_TRY(const auto bytes, encodePicture(picture, format, options));
        STX_CHECK(file.write(bytes));
    }
    return file.commit();
}

Result<void> writeFrame(const Frame& frame, const std::filesystem::path& path,
                        const FrameOptions& options) {
    if (frame.colour.empty()) return fail(ErrorCode::failed, "the frame has no pixels");
    STX_TRY(const FrameFormat format, frameFormat(path));
    if (format != FrameFormat::exr)
        return writePicture(pictureOf(frame, format, options.background), path, options);
    return writeExrFrame(exrFrameOf(frame, options.background), path, options);
}

}  // namespace stx
