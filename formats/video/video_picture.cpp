#include "formats/video/video_picture.hpp"

namespace stx {
namespace {

imagesets::YuvFormat formatOf(const video::PictureHeader& h) {
    imagesets::YuvFormat format;
    format.width = h.width;
    format.height = h.height;
    format.bits = h.bits;
    format.chroma = h.chroma != 0;
    format.chromaShiftX = h.chromaShiftX;
    format.chromaShiftY = h.chromaShiftY;
    format.chromaLeft = h.chromaLeft != 0;
    return format;
}

ByteSpan samplesOf(const Bytes& bytes) {
    return ByteSpan(bytes).subspan(sizeof(video::PictureHeader));
}

}  // namespace

Result<VideoPicture> VideoPicture::from(Bytes answer, const Limits& limits) {
    VideoPicture out;
    video::Unpacker in(answer);
    out.header_ = in.get<video::PictureHeader>();
    const video::PictureHeader& h = out.header_;
    const auto wrong = [] {
        return fail(ErrorCode::failed, "the video decoder gave a picture that makes no sense");
    };
    if (!in.ok() || h.bits < 8 || h.bits > 16 || h.chromaShiftX < 0 || h.chromaShiftX > 1 ||
        h.chromaShiftY < 0 || h.chromaShiftY > h.chromaShiftX)
        return wrong();
    if (h.width < 1 || h.height < 1 || h.width > limits.maxImageSide ||
        h.height > limits.maxImageSide)
        return fail(ErrorCode::invalidInput,
                    "its pictures are {}x{} pixels; each side must be 1 to {}", h.width, h.height,
                    limits.maxImageSide);
    const std::uint64_t pixels =
        static_cast<std::uint64_t>(h.width) * static_cast<std::uint64_t>(h.height);
    if (in.rest().size() != (h.rgba ? pixels * 4 : formatOf(h).frameBytes())) return wrong();
    out.bytes_ = std::move(answer);
    return out;
}

Result<Rgba8Image> VideoPicture::colour(const Limits& limits) const {
    const ByteSpan samples = samplesOf(bytes_);
    if (header_.rgba) {
        Rgba8Image out(header_.width, header_.height);
        std::memcpy(out.data(), samples.data(), samples.size());
        return out;
    }
    return imagesets::rgbFromYuv(samples, formatOf(header_),
                                 {header_.bt601 != 0, header_.fullRange != 0}, "the picture",
                                 limits);
}

std::vector<std::uint16_t> VideoPicture::lumaCodes() const {
    const ByteSpan samples = samplesOf(bytes_);
    std::vector<std::uint16_t> out(static_cast<std::size_t>(header_.width) *
                                   static_cast<std::size_t>(header_.height));
    for (std::size_t i = 0; i < out.size(); ++i) {
        if (header_.bits == 8) {
            out[i] = std::to_integer<std::uint16_t>(samples[i]);
        } else {
            std::memcpy(&out[i], samples.data() + 2 * i, 2);
        }
    }
    return out;
}

Image<float> VideoPicture::luma() const {
    const auto codes = lumaCodes();
    Image<float> out(header_.width, header_.height);
    std::copy(codes.begin(), codes.end(), out.data());
    return out;
}

}  // namespace stx
