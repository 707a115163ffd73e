#include "formats/yuv/y4m_writer.hpp"

#include <cmath>

#include "lib/base/parallel.hpp"

namespace stx {

namespace {

/// Y'CbCr of BT.601 or BT.709, 8 bits.
struct Coder {
    double kr, kg, kb;
    double yScale, yOffset, cScale;

    [[nodiscard]] static Coder of(const Y4mOptions& options, int height) {
        const bool hd = options.matrix == Y4mOptions::Matrix::bt709 ||
                        (options.matrix == Y4mOptions::Matrix::bySize && height >= 720);
        const double kr = hd ? 0.2126 : 0.299, kb = hd ? 0.0722 : 0.114;
        if (options.fullRange) return {kr, 1.0 - kr - kb, kb, 1.0, 0.0, 1.0};
        return {kr, 1.0 - kr - kb, kb, 219.0 / 255.0, 16.0, 224.0 / 255.0};
    }
    [[nodiscard]] double luma(glm::dvec3 p) const { return kr * p.r + kg * p.g + kb * p.b; }
    [[nodiscard]] static std::byte round(double v) {
        const double r = std::floor(v + 0.5);
        return static_cast<std::byte>(static_cast<unsigned char>(r < 0 ? 0 : r > 255 ? 255 : r));
    }
    [[nodiscard]] std::byte y(glm::dvec3 p) const { return round(yOffset + yScale * luma(p)); }
    [[nodiscard]] std::byte cb(glm::dvec3 p) const {
        return round(128.0 + cScale * (p.b - luma(p)) / (2.0 * (1.0 - kb)));
    }
    [[nodiscard]] std::byte cr(glm::dvec3 p) const {
        return round(128.0 + cScale * (p.r - luma(p)) / (2.0 * (1.0 - kr)));
    }
};

}  // namespace

std::string y4mHeader(int width, int height, const Y4mOptions& options) {
    return fmt::format("YUV4MPEG2 W{} H{} F{}:{} Ip A1:1 {} XCOLORRANGE={}", width, height,
                       options.rateNumerator, options.rateDenominator,
                       options.chroma == Y4mOptions::Chroma::yuv420 ? "C420jpeg" : "C444",
                       options.fullRange ? "FULL" : "LIMITED");
}

Bytes y4mPlanes(const Image<glm::u8vec4>& opaque, const Y4mOptions& options) {
    const int width = opaque.width(), height = opaque.height();
    const Coder coder = Coder::of(options, height);
    const int step = options.chroma == Y4mOptions::Chroma::yuv420 ? 2 : 1;
    const int chromaWidth = (width + step - 1) / step, chromaHeight = (height + step - 1) / step;
    const std::size_t lumas = opaque.count();
    const std::size_t chromas = static_cast<std::size_t>(chromaWidth) * chromaHeight;
    Bytes planes(lumas + 2 * chromas);
    std::byte* const cb = planes.data() + lumas;
    std::byte* const cr = cb + chromas;
    const auto rgb = [&](int x, int y) {
        const auto& p = opaque.at(std::min(x, width - 1), std::min(y, height - 1));
        return glm::dvec3(p.r, p.g, p.b);
    };
    parallelFor(0, chromaHeight, [&](int cy) {
        for (int y = cy * step; y < std::min(height, (cy + 1) * step); ++y) {
            for (int x = 0; x < width; ++x)
                planes[static_cast<std::size_t>(y) * width + x] = coder.y(rgb(x, y));
        }
        for (int cx = 0; cx < chromaWidth; ++cx) {
            glm::dvec3 mean = rgb(cx * step, cy * step);
            if (step == 2) {
                const int x = cx * 2, y = cy * 2;
                mean = (mean + rgb(x + 1, y) + rgb(x, y + 1) + rgb(x + 1, y + 1)) / 4.0;
            }
            const auto at = static_cast<std::size_t>(cy) * chromaWidth + cx;
            cb[at] = coder.cb(mean);
            cr[at] = coder.cr(mean);
        }
    });
    return planes;
}

Result<Y4mWriter> Y4mWriter::create(OutputFile& file, int width, int height,
                                    const Y4mOptions& options) {
    if (width < 1 || height < 1 || options.rateNumerator < 1 || options.rateDenominator < 1)
        return fail(ErrorCode::usage,
                    "cannot write video of {}x{} pixels at {}:{} frames a second; all must be "
                    "positive",
                    width, height, options.rateNumerator, options.rateDenominator);
    STX_CHECK(file.write(y4mHeader(width, height, options) + "\n"));
    return Y4mWriter(file, width, height, options);
}

Result<void> Y4mWriter::write(const Image<glm::u8vec4>& opaque) {
    if (opaque.width() != width_ || opaque.height() != height_)
        return fail(ErrorCode::failed,
                    "cannot write a frame of {}x{} pixels into video of {}x{}; all frames must "
                    "have one size",
                    opaque.width(), opaque.height(), width_, height_);
    STX_CHECK(file_->write("FRAME\n"));
    return file_->write(y4mPlanes(opaque, options_));
}

}  // namespace stx
