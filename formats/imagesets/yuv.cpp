#include "formats/imagesets/yuv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include "formats/imagesets/messages.hpp"

namespace stx::imagesets {
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

/// `count` samples from the `skip`-th of a frame.
Result<std::vector<std::uint16_t>> readSamples(const std::filesystem::path& path,
                                               const YuvFormat& f, int frame, std::uint64_t skip,
                                               std::uint64_t count, const Limits& limits) {
    STX_TRY(const int frames, yuvFrameCount(path, f));
    if (frame < 0 || frame >= frames)
        return failAt(inQuotes(path.string()), ErrorCode::invalidInput,
                      "frame {} is asked for, but the file holds {} (0 to {})", frame, frames,
                      frames - 1);
    if (auto ok = limits.checkAllocation(count, 4, "a frame"); !ok)
        return tl::unexpected(ok.error().at(inQuotes(path.string())));
    std::ifstream file(path, std::ios::binary);
    const std::uint64_t bytesEach = f.bits > 8 ? 2 : 1;
    file.seekg(static_cast<std::streamoff>(frame * f.frameBytes() + skip * bytesEach));
    std::vector<std::uint16_t> samples(count);
    auto* raw = reinterpret_cast<std::uint8_t*>(samples.data());
    // 8-bit samples are read into the upper half and spread from there.
    std::uint8_t* to = bytesEach == 2 ? raw : raw + count;
    file.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count * bytesEach));
    if (!file) return failAt(inQuotes(path.string()), ErrorCode::io, "cannot be read");
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint16_t value =
            bytesEach == 2 ? static_cast<std::uint16_t>(raw[2 * i] | raw[2 * i + 1] << 8) : to[i];
        samples[i] = value;
    }
    const int largest = (1 << f.bits) - 1;
    for (std::uint64_t i = 0; i < count; ++i) {
        if (samples[i] > largest)
            return failAt(inQuotes(path.string()), ErrorCode::invalidInput,
                          "frame {} holds the value {}; {} bits reach only to {} (another format?)",
                          frame, samples[i], f.bits, largest);
    }
    return samples;
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
        return failAt(inQuotes(path.string()), ErrorCode::invalidInput,
                      "the file has {} bytes, which is no whole number of frames of {}x{} with {} "
                      "bits ({} bytes each)",
                      size, f.width, f.height, f.bits, frame);
    return static_cast<int>(size / frame);
}

Result<Rgba8Image> readYuvColour(const std::filesystem::path& path, const YuvFormat& f, int frame,
                                 const YuvColour& colour, const Limits& limits) {
    STX_TRY(const auto samples, readSamples(path, f, frame, 0, planeValues(f), limits));
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
    const double kr = colour.bt601 ? 0.299 : 0.2126;
    const double kb = colour.bt601 ? 0.114 : 0.0722;
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
                    chromaRow[k][static_cast<std::size_t>(i)] = a + (b - a) * weight;
                }
            }
        }
        for (int x = 0; x < f.width; ++x) {
            const double l = (luma[static_cast<std::size_t>(y) * f.width + x] - yZero) * yScale;
            double c[2] = {0, 0};
            if (f.chroma) {
                // Horizontally, too: the tools around MIV and RVS average 2x2 pixels.
                // Pixel x lies at (x + 0.5) / 2 - 0.5 among the samples.
                const int left = f.chromaShiftX ? (x - 1) >> 1 : x;
                const float weight = !f.chromaShiftX ? 0.0f : (x & 1) ? 0.25f : 0.75f;
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
    STX_TRY(const auto samples, readSamples(path, f, frame, 0, count, limits));
    Image<float> out(f.width, f.height);
    std::copy(samples.begin(), samples.end(), out.data());
    return out;
}

}  // namespace stx::imagesets
