#pragma once

#include "formats/files/files.hpp"
#include "formats/video/wire.hpp"
#include "formats/yuv/yuv.hpp"
#include "lib/base/image.hpp"
#include "lib/base/job.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// A decoded picture of video as its decoder gave it.
class VideoPicture {
  public:
    /// Of an answer of the process. Errors: sizes that are not what they say, or over the limits.
    [[nodiscard]] static Result<VideoPicture> from(Bytes answer, const Limits& limits);

    /// What is taken from it is turned so.
    void turn(video::Turn how) { turn_ = how; }
    [[nodiscard]] int width() const { return turn_.sideways() ? header_.height : header_.width; }
    [[nodiscard]] int height() const { return turn_.sideways() ? header_.width : header_.height; }
    /// Of a sample of the video, at least 8 and at most 16: more than 8 are rounded by colour().
    [[nodiscard]] int bits() const { return header_.bits; }
    /// Luma is there as it was coded; else the picture has colours only.
    [[nodiscard]] bool hasLuma() const { return header_.rgba == 0; }
    /// Its pixels have alpha, which colour() gives straight; else that is 255.
    [[nodiscard]] bool hasAlpha() const { return header_.alpha != 0; }
    /// What the stream says of its colours and colour() does not do, for a note; else empty.
    [[nodiscard]] std::string notConverted() const;
    /// The way out of that, for a film in a file of its own.
    static constexpr const char* kConvertFirst =
        "; to convert them first: ffmpeg -i IN -vf zscale=p=709:t=709:m=709 -c:v ffv1 OUT.mkv";
    /// Its stream says that 16 (of 8 bits) is black; what holds depth should not.
    [[nodiscard]] bool saysLimited() const { return header_.limitedSaid != 0; }

    /// 8-bit colour by the matrix (of YuvMatrix) and the range that the stream tells; BT.601 below
    /// 720 lines and BT.709 from there, of limited range (full where only luma is), where it does
    /// not. Primaries and transfer functions are taken for those of sRGB.
    [[nodiscard]] Result<Rgba8Image> colour(const Limits& limits) const;
    /// The values of luma as they are, whatever range the stream tells. Needs hasLuma().
    [[nodiscard]] Image<float> luma() const;
    [[nodiscard]] std::vector<std::uint16_t> lumaCodes() const {
        const auto codes = lumaImage();
        return {codes.data(), codes.data() + codes.count()};
    }

  private:
    [[nodiscard]] Image<std::uint16_t> lumaImage() const;

    video::PictureHeader header_;
    video::Turn turn_;
    Bytes bytes_;  ///< with the header in front
};

}  // namespace stx
