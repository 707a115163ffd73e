#include "formats/video/video_picture.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <string_view>
#include <vector>

namespace stx {
namespace {

YuvFormat formatOf(const video::PictureHeader& h) {
    YuvFormat format;
    format.width = h.width;
    format.height = h.height;
    format.bits = h.bits;
    format.chroma = h.chroma != 0;
    format.chromaShiftX = h.chromaShiftX;
    format.chromaShiftY = h.chromaShiftY;
    format.chromaLeft = h.chromaLeft != 0;
    return format;
}

/// Of the plane behind the others.
std::uint64_t alphaBytes(const video::PictureHeader& h) {
    return h.alpha && !h.rgba ? std::uint64_t{1} * h.width * h.height * (h.bits > 8 ? 2 : 1) : 0;
}

ByteSpan samplesOf(const Bytes& bytes) {
    return ByteSpan(bytes).subspan(sizeof(video::PictureHeader));
}

std::uint32_t sampleAt(ByteSpan plane, std::size_t i, int bits) {
    if (bits == 8) return std::to_integer<std::uint32_t>(plane[i]);
    std::uint16_t sample = 0;
    std::memcpy(&sample, plane.data() + 2 * i, 2);
    return sample;
}

template <class T>
Image<T> turned(Image<T> picture, video::Turn turn) {
    if (turn.none()) return picture;
    const int w = picture.width(), h = picture.height();
    Image<T> out(turn.sideways() ? h : w, turn.sideways() ? w : h);
    const int left = turn.a + turn.c < 0 ? out.width() - 1 : 0;
    const int top = turn.b + turn.d < 0 ? out.height() - 1 : 0;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
            out.at(left + turn.a * x + turn.c * y, top + turn.b * x + turn.d * y) =
                picture.at(x, y);
    return out;
}

/// Of ITU-T H.273, what colours are not converted from; "" for the others, whose difference to
/// sRGB is small (BT.601) or which say nothing.
std::string_view primariesName(int code) {  // table 2
    switch (code) {
        case 4:
            return "BT.470 M";
        case 8:
            return "film";
        case 9:
            return "BT.2020";
        case 10:
            return "XYZ";
        case 11:
            return "DCI-P3";
        case 12:
            return "Display P3";
        case 22:
            return "EBU 3213";
        default:
            return {};
    }
}
std::string_view transferName(int code) {  // table 3
    switch (code) {
        case 8:
            return "linear";
        case 9:
        case 10:
            return "logarithmic";
        case 16:
            return "PQ";
        case 17:
            return "ST 428";
        case 18:
            return "HLG";
        default:
            return {};
    }
}
std::string_view matrixName(int code) {  // table 4
    switch (code) {
        case 8:
            return "YCgCo";
        case 10:
            return "BT.2020 with constant luminance";
        case 11:
            return "ST 2085";
        case 12:
        case 13:
            return "of its primaries";
        case 14:
            return "ICtCp";
        default:
            return {};
    }
}

}  // namespace

std::string VideoPicture::notConverted() const {
    std::vector<std::string> what;
    const auto add = [&](std::string_view name, std::string_view of, std::string_view takenFor) {
        if (!name.empty()) what.push_back(fmt::format("{} {} for {}", of, name, takenFor));
    };
    add(primariesName(header_.primariesSaid), "primaries", "BT.709");
    add(transferName(header_.transferSaid), "transfer function", "sRGB");
    if (header_.chroma || header_.rgba)
        add(matrixName(header_.matrixSaid), "matrix",
            header_.matrix == YuvMatrix::bt2020 ? "BT.2020" : "BT.709");
    if (what.empty()) return {};
    return fmt::format("colours of the video are taken as they are, {}", fmt::join(what, ", "));
}

Result<VideoPicture> VideoPicture::from(Bytes answer, const Limits& limits) {
    VideoPicture out;
    video::Unpacker in(answer);
    out.header_ = in.get<video::PictureHeader>();
    const video::PictureHeader& h = out.header_;
    const auto wrong = [] {
        return fail(ErrorCode::failed, "the video decoder gave a picture that makes no sense");
    };
    if (!in.ok() || h.matrix > YuvMatrix::bt2020 || h.bits < 8 || h.bits > 16 ||
        h.chromaShiftX < 0 || h.chromaShiftX > 1 || h.chromaShiftY < 0 ||
        h.chromaShiftY > h.chromaShiftX)
        return wrong();
    if (h.width < 1 || h.height < 1 || h.width > limits.maxImageSide ||
        h.height > limits.maxImageSide)
        return fail(ErrorCode::invalidInput,
                    "its pictures are {}x{} pixels; each side must be 1 to {}", h.width, h.height,
                    limits.maxImageSide);
    const std::uint64_t pixels =
        static_cast<std::uint64_t>(h.width) * static_cast<std::uint64_t>(h.height);
    if (in.rest().size() != (h.rgba ? pixels * 4 : formatOf(h).frameBytes() + alphaBytes(h)))
        return wrong();
    out.bytes_ = std::move(answer);
    return out;
}

Result<Rgba8Image> VideoPicture::colour(const Limits& limits) const {
    const ByteSpan samples = samplesOf(bytes_);
    if (header_.rgba) {
        Rgba8Image out(header_.width, header_.height);
        std::memcpy(out.data(), samples.data(), samples.size());
        return turned(std::move(out), turn_);
    }
    const YuvFormat format = formatOf(header_);
    STX_TRY(auto out, rgbFromYuv(samples.first(format.frameBytes()), format,
                                 {header_.matrix, header_.fullRange != 0}, "the picture", limits));
    if (header_.alpha) {
        const ByteSpan plane = samples.subspan(format.frameBytes());
        const std::uint32_t largest = (1u << header_.bits) - 1;
        for (std::size_t i = 0; i < out.count(); ++i) {
            const std::uint32_t code = std::min(sampleAt(plane, i, header_.bits), largest);
            out.data()[i].a = static_cast<std::uint8_t>((code * 255 + largest / 2) / largest);
        }
    }
    return turned(std::move(out), turn_);
}

Image<std::uint16_t> VideoPicture::lumaImage() const {
    const ByteSpan samples = samplesOf(bytes_);
    Image<std::uint16_t> out(header_.width, header_.height);
    for (std::size_t i = 0; i < out.count(); ++i)
        out.data()[i] = static_cast<std::uint16_t>(sampleAt(samples, i, header_.bits));
    return turned(std::move(out), turn_);
}

Image<float> VideoPicture::luma() const {
    const auto codes = lumaImage();
    Image<float> out(codes.width(), codes.height());
    std::copy(codes.data(), codes.data() + codes.count(), out.data());
    return out;
}

}  // namespace stx
