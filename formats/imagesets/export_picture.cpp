#include "formats/imagesets/export_picture.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "formats/images/frames.hpp"
#include "formats/images/images.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/srgb8.hpp"

namespace stx {
namespace {

/// Of JPEG. Depth has the best: rings beside its edges would be surfaces that are not there.
constexpr int kDepthQuality = 100;

/// A picture of 8 bits with one or three channels.
struct Picture {
    int width, height, channels;
    std::vector<std::uint8_t> values;
};

/// The colour with black behind it, in rows of `width` pixels whose first ones it fills.
void putColour(const Texture& texture, Picture& out) {
    parallelFor(0, texture.height(), [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        std::uint8_t* to = out.values.data() + static_cast<std::size_t>(y) * out.width * 3;
        for (int x = 0; x < texture.width(); ++x) {
            const glm::vec4 c = texture.at(x, y);
            for (int k = 0; k < 3; ++k)
                *to++ = texture.isLinear()
                            ? srgb8FromLinear(c[k] * c.a)
                            : static_cast<std::uint8_t>(std::lround(c[k] * c.a * 255.0f));
        }
    });
}

/// Nearest and farthest distance of a view.
Result<std::pair<float, float>> rangeOf(const ReferenceView& view) {
    float least = kNoDepth, most = 0;
    for (const float d : view.depth.pixels()) {
        if (!hasPoint(d)) continue;
        least = std::min(least, d);
        most = std::max(most, d);
    }
    if (!hasPoint(least))
        return fail(ErrorCode::invalidInput,
                    "view '{}' has no depth; a picture with depth needs some", view.name);
    return std::pair(least, most);
}

/// White is the nearest distance. Distances at the viewpoint itself, which orthographic views may
/// have, are white, too.
std::uint8_t greyOf(float distance, std::pair<float, float> range) {
    if (!hasPoint(distance)) return 0;
    const double near = 1.0 / range.first, far = 1.0 / range.second;
    if (!(near > far) || !std::isfinite(near)) return 255;
    return static_cast<std::uint8_t>(std::lround(255.0 * (1.0 / distance - far) / (near - far)));
}

Result<void> write(const Picture& p, const std::filesystem::path& path, int quality,
                   OutputFile::Options options) {
    STX_TRY(const auto format, frameFormat(path));
    Result<Bytes> bytes = Bytes();
    if (format == FrameFormat::jpeg)
        bytes = encodeJpeg(p.width, p.height, p.channels, p.values.data(), quality);
    else if (format == FrameFormat::png)
        bytes = encodePng(p.width, p.height, p.channels, 8, p.values.data(), p.channels == 3);
    else
        return fail(ErrorCode::usage, "'{}': a picture with depth is a .png or a .jpg file",
                    path.string());
    if (!bytes) return propagate(bytes);
    return writeFile(path, *bytes, options);
}

}  // namespace

std::filesystem::path depthFileOf(const std::filesystem::path& picture) {
    return picture.parent_path() /
           (picture.stem().string() + "_depth" + picture.extension().string());
}

Result<void> exportPicture(const ReferenceView& view, const std::filesystem::path& path,
                           DepthPicture kind, int jpegQuality, OutputFile::Options options,
                           Job& job) {
    STX_TRY(const auto range, rangeOf(view));
    const int width = view.depth.width(), height = view.depth.height();
    const bool together = kind == DepthPicture::sideBySide;
    const auto picture = [&](int wide, int channels) {
        const auto count = static_cast<std::size_t>(wide) * static_cast<std::size_t>(height) *
                           static_cast<std::size_t>(channels);
        return Picture{wide, height, channels, std::vector<std::uint8_t>(count)};
    };
    job.note(
        fmt::format("the depth is grey, white near, and has no scale any more: black is {:.6g}, "
                    "white {:.6g} scene units",
                    range.second, range.first));
    Rgba8Loss{.linear = view.texture.isLinear(), .clipped = isBeyondWhite(view.texture)}.note(job);
    Picture colour = picture(together ? 2 * width : width, 3);
    putColour(view.texture, colour);
    Picture depth = together ? Picture{} : picture(width, 1);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const std::uint8_t grey = greyOf(view.depth.at(x, y), range);
            const std::size_t row = static_cast<std::size_t>(y);
            if (together)
                std::fill_n(&colour.values[3 * (row * 2 * width + width + x)], 3, grey);
            else
                depth.values[row * width + x] = grey;
        }
    }
    if (!together) STX_CHECK(write(depth, depthFileOf(path), kDepthQuality, options));
    return write(colour, path, jpegQuality, options);
}

}  // namespace stx
