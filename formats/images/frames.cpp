#include "formats/images/frames.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "formats/exr/bundle_exr.hpp"
#include "formats/exr/exr_colour.hpp"
#include "formats/exr/exr_file.hpp"
#include "formats/files/source_date.hpp"
#include "formats/images/codec_module.hpp"
#include "formats/images/images.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/texture.hpp"

namespace stx {

namespace {

glm::vec3 linearFrom(glm::vec3 coded) {
    return {linearFromSrgb(coded.r), linearFromSrgb(coded.g), linearFromSrgb(coded.b)};
}

/// Premultiplied linear light of an image that is premultiplied in the frame's colour space.
Image<glm::vec4> linearImage(const Image<glm::vec4>& image, bool linear,
                             const std::optional<glm::vec3>& background) {
    Image<glm::vec4> out(image.width(), image.height());
    parallelFor(0, image.height(), [&](std::int64_t y) {
        const auto from = image.row(static_cast<int>(y));
        const auto to = out.row(static_cast<int>(y));
        for (std::size_t x = 0; x < to.size(); ++x) {
            glm::vec4 p = over(from[x], background);
            // Coded colours are divided first: the curve and the alpha do not commute.
            if (!linear && p.a > 0.0f) p = {linearFrom(glm::vec3(p) / p.a) * p.a, p.a};
            to[x] = p;
        }
    });
    return out;
}

std::vector<std::uint8_t> withoutAlpha(const Rgba8Image& rgba) {
    std::vector<std::uint8_t> rgb;
    rgb.reserve(rgba.count() * 3);
    for (const auto& p : rgba.pixels()) rgb.insert(rgb.end(), {p.r, p.g, p.b});
    return rgb;
}

/// By the module of image codecs, into the file's temporary name.
Result<void> writeByModule(const Frame& frame, FrameFormat format, const OutputFile& file,
                           const FrameOptions& options) {
    STX_TRY(const auto* codecs, loadCodecs());
    const auto rgba = rgba8From(frame, options.background);
    std::vector<std::uint8_t> rgb;
    codecs::EncodeRequest request;
    const std::string path = file.temporaryPath().string();
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
    constexpr int kWebpSide = 16383;
    if (format == FrameFormat::webp && std::max(rgba.width(), rgba.height()) > kWebpSide)
        return fail(ErrorCode::usage,
                    "a WebP picture of {}x{} is asked for; {} a side are possible", rgba.width(),
                    rgba.height(), kWebpSide);
    codecs::Failure failure;
    if (!codecs->encode(request, failure))
        return fail(static_cast<ErrorCode>(failure.code), "{}", failure.message);
    return {};
}

Result<void> checkFrame(const Frame& frame) {
    if (frame.colour.empty()) return fail(ErrorCode::failed, "the frame has no pixels");
    return {};
}

Result<void> writeExrFrame(const Frame& frame, OutputFile& file, const FrameOptions& options) {
    ExrPart part;
    part.width = part.displayWidth = frame.colour.width();
    part.height = part.displayHeight = frame.colour.height();
    part.zipLevel = 1;
    if (options.camera) {
        const double aspect = options.camera->fy / options.camera->fx;
        if (aspect > 1e-5 && aspect < 1e5 && std::abs(aspect - 1.0) > 1e-6)
            part.pixelAspectRatio = aspect;
        // Planes only scale the third coordinate of NDC, which nobody uses.
        setExrCamera(part, *options.camera, 0.0, 1.0);
    }
    std::vector<ExrConstPixels> pixels;
    const auto add = [&](const std::string& name, ExrChannel::Type type, const float* first,
                         std::size_t stride) {
        part.channels.push_back({name, type});
        pixels.push_back({name, first, stride});
    };
    const auto colour =
        linearImage(frame.colour, frame.linear, inSpaceOf(frame, options.background));
    const char* rgba[] = {"R", "G", "B", "A"};
    for (int c = 0; c < 4; ++c) add(rgba[c], ExrChannel::Type::half, &colour.data()->x + c, 4);
    Image<glm::vec4> albedo;
    if (!frame.albedo.empty()) {
        albedo = linearImage(frame.albedo, frame.linear, {});
        for (int c = 0; c < 4; ++c)
            add(std::string("albedo.") + rgba[c], ExrChannel::Type::half, &albedo.data()->x + c, 4);
    }
    if (!frame.depth.empty()) add("Z", ExrChannel::Type::float32, frame.depth.data(), 1);
    if (!frame.normal.empty()) {
        const float* first = &frame.normal.data()->x;
        add("N.X", ExrChannel::Type::half, first, 3);
        add("N.Y", ExrChannel::Type::half, first + 1, 3);
        add("N.Z", ExrChannel::Type::half, first + 2, 3);
    }
    STX_TRY(auto writer, ExrWriter::create(file, {part}));
    STX_CHECK(writer.writePart(0, pixels));
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

Result<Bytes> encodeFrame(const Frame& frame, FrameFormat format, const FrameOptions& options) {
    STX_CHECK(checkFrame(frame));
    if (format != FrameFormat::png && format != FrameFormat::jpeg)
        return fail(ErrorCode::failed,
                    "an OpenEXR, TIFF or WebP picture is written to a file, not to memory");
    auto background = options.background;
    if (format == FrameFormat::jpeg && !background) background = glm::vec3(0.0f);
    const auto rgba = rgba8From(frame, background);
    if (!background)
        return encodePng(rgba.width(), rgba.height(), 4, 8, rgba.data(), true, options.pngLevel);
    const auto rgb = withoutAlpha(rgba);
    if (format == FrameFormat::jpeg)
        return encodeJpeg(rgba.width(), rgba.height(), 3, rgb.data(), options.jpegQuality);
    return encodePng(rgba.width(), rgba.height(), 3, 8, rgb.data(), true, options.pngLevel);
}

Result<void> writeFrame(const Frame& frame, const std::filesystem::path& path,
                        const FrameOptions& options) {
    STX_CHECK(checkFrame(frame));
    STX_TRY(const FrameFormat format, frameFormat(path));
    STX_TRY(auto file, OutputFile::create(path, {.noClobber = options.noClobber}));
    if (format == FrameFormat::exr) {
        if (auto ok = writeExrFrame(frame, file, options); !ok)
            return tl::unexpected(ok.error().at(fmt::format("'{}'", path.string())));
    } else if (format == FrameFormat::tiff || format == FrameFormat::webp) {
        if (auto ok = writeByModule(frame, format, file, options); !ok)
            return tl::unexpected(ok.error().at(fmt::format("'{}'", path.string())));
    } else {
        STX_TRY(const auto bytes, encodeFrame(frame, format, options));
        STX_CHECK(file.write(bytes));
    }
    return file.commit();
}

}  // namespace stx
