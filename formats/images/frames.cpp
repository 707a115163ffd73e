#include "formats/images/frames.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

#include "formats/exr/bundle_exr.hpp"
#include "formats/exr/exr_colour.hpp"
#include "formats/exr/exr_file.hpp"
#include "formats/files/source_date.hpp"
#include "formats/images/codec_module.hpp"
#include "formats/images/images.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/linear_planes.hpp"
#include "lib/model/texture.hpp"

namespace stx {

namespace {

/// Premultiplied linear light of some rows of an image that is premultiplied in the frame's colour
/// space: all of the red, then green, blue and alpha, for these are stored apart.
void toLinearRows(const Image<glm::vec4>& image, int top, int rows, bool linear,
                  const std::optional<glm::vec3>& background, Image<float>& planes) {
    if (planes.width() != image.width() || planes.height() != 4 * rows)
        planes = Image<float>(image.width(), 4 * rows);
    parallelForBlocks(0, rows, 16, [&](std::int64_t begin, std::int64_t end) {
        std::vector<glm::vec4> shown(background ? static_cast<std::size_t>(image.width()) : 0);
        for (auto y = static_cast<int>(begin); y < end; ++y) {
            std::span<const glm::vec4> from = image.row(top + y);
            if (background) {
                std::ranges::transform(from, shown.begin(),
                                       [&](glm::vec4 p) { return over(p, background); });
                from = shown;
            }
            std::array<float*, 4> to{};
            for (int c = 0; c < 4; ++c) to[c] = planes.row(c * rows + y).data();
            if (!linear) {
                linearPlanes(from.data(), from.size(), to);
                continue;
            }
            for (std::size_t x = 0; x < from.size(); ++x)
                for (int c = 0; c < 4; ++c) to[c][x] = from[x][c];
        }
    });
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

Result<void> writeExrFrame(const Frame& frame, OutputFile& file, const FrameOptions& options) {
    ExrPart part;
    part.width = part.displayWidth = frame.colour.width();
    part.height = part.displayHeight = frame.colour.height();
    part.zipLevel = 1;
    if (options.around) {
        part.envmap = ExrPart::Envmap::latlong;
    } else if (options.camera) {
        const double aspect = options.camera->fy / options.camera->fx;
        if (aspect > 1e-5 && aspect < 1e5 && std::abs(aspect - 1.0) > 1e-6)
            part.pixelAspectRatio = aspect;
        // Planes only scale the third coordinate of NDC, which nobody uses.
        setExrCamera(part, *options.camera, 0.0, 1.0);
    }
    const char* rgba[] = {"R", "G", "B", "A"};
    for (const char* c : rgba) part.channels.push_back({c, ExrChannel::Type::half});
    const bool albedo = !frame.albedo.empty(), normals = !frame.normal.empty();
    for (const char* c : rgba)
        if (albedo) part.channels.push_back({std::string("albedo.") + c, ExrChannel::Type::half});
    if (!frame.depth.empty()) part.channels.push_back({"Z", ExrChannel::Type::float32});
    for (const char* c : {"N.X", "N.Y", "N.Z"})
        if (normals) part.channels.push_back({c, ExrChannel::Type::half});

    const auto behind = inSpaceOf(frame, options.background);
    // Without lights and a background albedo is the colour.
    const bool same = albedo && !behind &&
                      std::memcmp(frame.albedo.data(), frame.colour.data(),
                                  frame.colour.count() * sizeof(glm::vec4)) == 0;
    Image<float> colourRows, albedoRows;
    STX_TRY(auto writer, ExrWriter::create(file, {part}));
    STX_CHECK(writer.writePart(0, [&](int y, int rows) {
        std::vector<ExrConstPixels> pixels;
        toLinearRows(frame.colour, y, rows, frame.linear, behind, colourRows);
        for (int c = 0; c < 4; ++c) pixels.push_back({rgba[c], colourRows.row(c * rows).data(), 1});
        if (albedo && !same) toLinearRows(frame.albedo, y, rows, frame.linear, {}, albedoRows);
        const auto& albedos = same ? colourRows : albedoRows;
        for (int c = 0; albedo && c < 4; ++c)
            pixels.push_back({std::string("albedo.") + rgba[c], albedos.row(c * rows).data(), 1});
        if (!frame.depth.empty()) pixels.push_back({"Z", frame.depth.row(y).data(), 1});
        if (normals) {
            const float* first = &frame.normal.row(y).data()->x;
            pixels.push_back({"N.X", first, 3});
            pixels.push_back({"N.Y", first + 1, 3});
            pixels.push_back({"N.Z", first + 2, 3});
        }
        return pixels;
    }));
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

Result<void> writePicture(const Rgba8Image& picture, const std::filesystem::path& path,
                          const FrameOptions& options) {
    STX_TRY(const FrameFormat format, frameFormat(path));
    STX_TRY(auto file, OutputFile::create(path, {.noClobber = options.noClobber}));
    if (format == FrameFormat::tiff || format == FrameFormat::webp) {
        if (auto ok = writeByModule(picture, format, file, options); !ok)
            return tl::unexpected(ok.error().at(fmt::format("'{}'", path.string())));
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
    STX_TRY(auto file, OutputFile::create(path, {.noClobber = options.noClobber}));
    if (auto ok = writeExrFrame(frame, file, options); !ok)
        return tl::unexpected(ok.error().at(fmt::format("'{}'", path.string())));
    return file.commit();
}

}  // namespace stx
