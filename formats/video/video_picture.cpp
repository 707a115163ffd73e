#include "formats/video/video_picture.hpp"

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

ByteSpan samplesOf(const Bytes& bytes) {
    return ByteSpan(bytes).subspan(sizeof(video::PictureHeader));
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
        return turned(std::move(out), turn_);
    }
    STX_TRY(auto out,
            rgbFromYuv(samples, formatOf(header_), {header_.bt601 != 0, header_.fullRange != 0},
                       "the picture", limits));
    return turned(std::move(out), turn_);
}

Image<std::uint16_t> VideoPicture::lumaImage() const {
    const ByteSpan samples = samplesOf(bytes_);
    Image<std::uint16_t> out(header_.width, header_.height);
    for (std::size_t i = 0; i < out.count(); ++i) {
        if (header_.bits == 8) {
            out.data()[i] = std::to_integer<std::uint16_t>(samples[i]);
        } else {
            std::memcpy(&out.data()[i], samples.data() + 2 * i, 2);
        }
    }
    return turned(std::move(out), turn_);
}

Image<float> VideoPicture::luma() const {
    const auto codes = lumaImage();
    Image<float> out(codes.width(), codes.height());
    std::copy(codes.data(), codes.data() + codes.count(), out.data());
    return out;
}

}  // namespace stx
