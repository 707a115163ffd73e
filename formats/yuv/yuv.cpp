#include "formats/yuv/yuv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include "formats/files/messages.hpp"

namespace stx {
namespace {

std::uint64_t planeValues(const YuvFormat& f) {
    std::uint64_t values = static_cast<std::uint64_t>(f.width) * f.height;
    if (f.chroma) {
        const std::uint64_t cw = (f.width + (1 << f.chromaShiftX) - 1) >> f.chromaShiftX;
        const std::uint64_t ch = (f.height + (1 << f.chromaShiftY) - 1) >> f.chromaShiftY;
        values += 2 * cw * ch;
    }
    return values;
}

/// Samples of a frame `raw`. `name` is for messages: "frame 3".
Result<std::vector<std::uint16_t>> samplesOf(std::span<const std::byte> raw, const YuvFormat& f,
                                             const std::string& name) {
    const std::size_t bytesEach = f.bits > 8 ? 2 : 1;
    std::vector<std::uint16_t> samples(raw.size() / bytesEach);
    const auto byte = [&](std::size_t i) { return std::to_integer<unsigned>(raw[i]); };
    for (std::size_t i = 0; i < samples.size(); ++i)
        samples[i] = static_cast<std::uint16_t>(bytesEach == 2 ? byte(2 * i) | byte(2 * i + 1) << 8
                                                               : byte(i));
    const int largest = (1 << f.bits) - 1;
    for (const auto sample : samples) {
        if (sample > largest)
            return fail(ErrorCode::invalidInput,
                        "{} holds the value {}; {} bits reach only to {} (another format?)", name,
                        sample, f.bits, largest);
    }
    return samples;
}

/// Of red and of blue in Y.
std::pair<double, double> weightsOf(YuvMatrix matrix) {
    switch (matrix) {
        case YuvMatrix::bt601:
            return {0.299, 0.114};
        case YuvMatrix::smpte240:
            return {0.212, 0.087};
        case YuvMatrix::bt2020:
            return {0.2627, 0.0593};
        case YuvMatrix::bt709:
            break;
    }
    return {0.2126, 0.0722};
}

/// `count` samples from the beginning of a frame.
Result<std::vector<std::byte>> readFrameBytes(const std::filesystem::path& path, const YuvFormat& f,
                                              int frame, std::uint64_t count,
                                              const Limits& limits) {
    STX_TRY(const int frames, yuvFrameCount(path, f));
    if (frame < 0 || frame >= frames)
        return failAt(inQuotes(path.string()), ErrorCode::invalidInput,
                      "frame {} is asked for, but the file holds {} (0 to {})", frame, frames,
                      frames - 1);
    STX_CHECK(within(inQuotes(path.string()), limits.checkAllocation(count, 4, "a frame")));
    std::ifstream file(path, std::ios::binary);
    file.seekg(static_cast<std::streamoff>(frame * f.frameBytes()));
    std::vector<std::byte> raw(count * (f.bits > 8 ? 2 : 1));
    file.read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(raw.size()));
    if (!file) return failAt(inQuotes(path.string()), ErrorCode::io, "cannot be read");
    return raw;
}

}  // namespace

std::uint64_t YuvFormat::frameBytes() const {
    return planeValues(*this) * (bits > 8 ? 2 : 1);
}

std::optional<YuvFormat> yuvFormatNamed(std::string_view name) {
    YuvFormat f;
    const auto drop = [&](std::string_view prefix) {
        if (!name.starts_with(prefix)) return false;
        name.remove_prefix(prefix.size());
        return true;
    };
    if (drop("yuv420p")) {
        f.chromaShiftX = f.chromaShiftY = 1;
    } else if (drop("yuv422p")) {
        f.chromaShiftY = 0;
    } else if (drop("yuv444p")) {
        f.chromaShiftX = f.chromaShiftY = 0;
    } else if (drop("yuv400p") || drop("gray")) {
        f.chroma = false;
    } else {
        return std::nullopt;
    }
    if (name.empty()) return f;
    const auto [next, error] = std::from_chars(name.data(), name.data() + name.size(), f.bits);
    if (error != std::errc() || f.bits < 8 || f.bits > 16) return std::nullopt;
    name.remove_prefix(static_cast<std::size_t>(next - name.data()));
    if (name != "le" && !(name.empty() && f.bits == 8)) return std::nullopt;
    return f;
}

Result<int> yuvFrameCount(const std::filesystem::path& path, const YuvFormat& f) {
    std::error_code ec;
    const std::uint64_t size = std::filesystem::file_size(path, ec);
    if (ec)
        return failAt(inQuotes(path.string()), ErrorCode::io, "cannot be read: {}", ec.message());
    const std::uint64_t frame = f.frameBytes();
    if (size == 0 || size % frame != 0 || size / frame > 1u << 30)
        return failAt(
            inQuotes(path.string()), ErrorCode::invalidInput,
            "the file has {} bytes, which is not a whole number of frames of {}x{} with {} "
            "bits ({} bytes each)",
            size, f.width, f.height, f.bits, frame);
    return static_cast<int>(size / frame);
}

Result<Rgba8Image> readYuvColour(const std::filesystem::path& path, const YuvFormat& f, int frame,
                                 const YuvColour& colour, const Limits& limits) {
    STX_TRY(const auto raw, readFrameBytes(path, f, frame, planeValues(f), limits));
    return within(inQuotes(path.string()),
                  rgbFromYuv(raw, f, colour, fmt::format("frame {}", frame), limits));
}

Result<Rgba8Image> rgbFromYuv(std::span<const std::byte> frame, const YuvFormat& f,
                              const YuvColour& colour, const std::string& name,
                              const Limits& limits) {
    // Its samples, and its pixels.
    STX_CHECK(limits.checkAllocation(planeValues(f), 2 + sizeof(glm::u8vec4), "a frame"));
    STX_TRY(const auto samples, samplesOf(frame, f, name));
    const int cw = (f.width + (1 << f.chromaShiftX) - 1) >> f.chromaShiftX;
    const int ch = (f.height + (1 << f.chromaShiftY) - 1) >> f.chromaShiftY;
    const std::uint16_t* luma = samples.data();
    const std::uint16_t* cb = luma + static_cast<std::size_t>(f.width) * f.height;
    const std::uint16_t* cr = f.chroma ? cb + static_cast<std::size_t>(cw) * ch : nullptr;

    const double unit = 1 << (f.bits - 8);
    const double largest = (1 << f.bits) - 1;
    const double yZero = colour.fullRange ? 0 : 16 * unit;
    const double yScale = colour.fullRange ? 1 / largest : 1 / (219 * unit);
    const double cZero = 128 * unit;
    const double cScale = colour.fullRange ? 1 / largest : 1 / (224 * unit);
    const auto [kr, kb] = weightsOf(colour.matrix);
    const double kg = 1 - kr - kb;

    Rgba8Image out(f.width, f.height);
    std::vector<float> chromaRow[2];
    for (auto& row : chromaRow) row.resize(static_cast<std::size_t>(cw));
    for (int y = 0; y < f.height; ++y) {
        if (f.chroma) {
            // Vertically, a chroma sample lies in the middle of its luma rows.
            const double at = f.chromaShiftY ? (y + 0.5) / 2 - 0.5 : y;
            const int top = static_cast<int>(std::floor(at));
            const float weight = static_cast<float>(at - top);
            const int j0 = std::clamp(top, 0, ch - 1), j1 = std::clamp(top + 1, 0, ch - 1);
            for (int k = 0; k < 2; ++k) {
                const std::uint16_t* plane = k == 0 ? cb : cr;
                for (int i = 0; i < cw; ++i) {
                    const float a = plane[static_cast<std::size_t>(j0) * cw + i];
                    const float b = plane[static_cast<std::size_t>(j1) * cw + i];
                    chromaRow[k][i] = a + (b - a) * weight;
                }
            }
        }
        for (int x = 0; x < f.width; ++x) {
            const double l = (luma[static_cast<std::size_t>(y) * f.width + x] - yZero) * yScale;
            double c[2] = {0, 0};
            if (f.chroma) {
                // Horizontally, too: the tools around MIV and RVS average 2x2 pixels.
                // Pixel x lies at (x + 0.5) / 2 - 0.5 among the samples, or else at x / 2.
                const int left = !f.chromaShiftX ? x : f.chromaLeft ? x >> 1 : (x - 1) >> 1;
                const float weight = !f.chromaShiftX ? 0.0f
                                     : f.chromaLeft  ? ((x & 1) ? 0.5f : 0.0f)
                                     : (x & 1)       ? 0.25f
                                                     : 0.75f;
                const auto i0 = static_cast<std::size_t>(std::clamp(left, 0, cw - 1));
                const auto i1 = static_cast<std::size_t>(std::clamp(left + 1, 0, cw - 1));
                for (int k = 0; k < 2; ++k) {
                    const auto& row = chromaRow[k];
                    const double value = row[i0] + (row[i1] - row[i0]) * weight;
                    c[k] = (value - cZero) * cScale;
                }
            }
            const double r = l + 2 * (1 - kr) * c[1];
            const double b = l + 2 * (1 - kb) * c[0];
            const double g = (l - kr * r - kb * b) / kg;
            const auto byte = [](double v) {
                return static_cast<std::uint8_t>(std::clamp(v, 0.0, 1.0) * 255 + 0.5);
            };
            out.at(x, y) = {byte(r), byte(g), byte(b), 255};
        }
    }
    return out;
}

Result<Image<float>> readYuvLuma(const std::filesystem::path& path, const YuvFormat& f, int frame,
                                 const Limits& limits) {
    const std::uint64_t count = static_cast<std::uint64_t>(f.width) * f.height;
    STX_TRY(const auto raw, readFrameBytes(path, f, frame, count, limits));
    STX_TRY(const auto samples,
            within(inQuotes(path.string()), samplesOf(raw, f, fmt::format("frame {}", frame))));
    Image<float> out(f.width, f.height);
    std::copy(samples.begin(), samples.end(), out.data());
    return out;
}

}  // namespace stx
