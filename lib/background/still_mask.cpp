#include <algorithm>
#include <array>
#include <cstdlib>

#include "lib/background/still.hpp"
#include "lib/base/parallel.hpp"

namespace stx {
namespace {

/// What a quarter of the pixels, those of the background at least, differ by, times this, is noise:
/// 6 spreads of Gaussian noise, of which a quarter of the largest of three channels is below 0.9.
constexpr double kNoiseQuarters = 6.0 / 0.9;
/// Levels from which a difference is never noise.
constexpr int kNoNoise = 50;
/// A piece of foreground, or a hole in it, of fewer pixels than the picture's over this is noise.
constexpr std::size_t kSpeckShare = 5000;

/// The largest difference of R, G and B, or all of it where one shows nothing.
Image<std::uint8_t> channelDifference(const Rgba8Image& a, const Rgba8Image& b) {
    Image<std::uint8_t> out(a.width(), a.height());
    parallelFor(0, a.height(), [&](int y) {
        const auto p = a.row(y), q = b.row(y);
        const auto to = out.row(y);
        for (std::size_t x = 0; x < to.size(); ++x) {
            int most = 0;
            for (int c = 0; c < 3; ++c) most = std::max(most, std::abs(p[x][c] - q[x][c]));
            if (!isSeen(p[x]) || !isSeen(q[x])) most = isSeen(p[x]) == isSeen(q[x]) ? 0 : 255;
            to[x] = static_cast<std::uint8_t>(most);
        }
    });
    return out;
}

/// The level that noise stays below.
int noiseLevel(const Image<std::uint8_t>& difference) {
    std::array<std::size_t, 256> counts{};
    for (const auto d : difference.pixels()) ++counts[d];
    std::size_t seen = 0, quarter = 0;
    while ((seen += counts[quarter]) * 4 < difference.count()) ++quarter;
    return std::clamp(static_cast<int>(kNoiseQuarters * static_cast<double>(quarter)), kStillAgrees,
                      kNoNoise);
}

/// Calls piece(pixels) for each 4-connected piece of pixels with in(pixel), in reading order.
template <class In, class Piece>
void forPieces(int width, int height, const In& in, const Piece& piece) {
    Image<std::uint8_t> seen(width, height);
    std::vector<std::int64_t> pixels;
    const auto take = [&](int x, int y) {
        const auto i = static_cast<std::int64_t>(y) * width + x;
        if (x < 0 || y < 0 || x >= width || y >= height) return;
        if (seen.pixels()[i] || !in(static_cast<std::size_t>(i))) return;
        seen.pixels()[i] = 1;
        pixels.push_back(i);
    };
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            pixels.clear();
            take(x, y);
            for (std::size_t k = 0; k < pixels.size(); ++k) {
                const int px = static_cast<int>(pixels[k] % width);
                const int py = static_cast<int>(pixels[k] / width);
                take(px + 1, py);
                take(px - 1, py);
                take(px, py + 1);
                take(px, py - 1);
            }
            if (!pixels.empty()) piece(pixels);
        }
    }
}

}  // namespace

Result<Image<std::uint8_t>> foregroundMask(const Rgba8Image& background, const Rgba8Image& frame) {
    if (background.size() != frame.size())
        return fail(ErrorCode::invalidInput,
                    "the background is {}x{}, but the frame is {}x{}; both must match",
                    background.width(), background.height(), frame.width(), frame.height());
    const auto difference = channelDifference(background, frame);
    const auto values = difference.pixels();
    const int level = noiseLevel(difference);
    const int width = frame.width(), height = frame.height();
    const std::size_t speck = frame.count() / kSpeckShare;
    Image<std::uint8_t> mask(width, height);
    const auto pixels = mask.pixels();
    const auto set = [&](const std::vector<std::int64_t>& piece, std::uint8_t value) {
        for (const auto i : piece) pixels[i] = value;
    };
    forPieces(
        width, height, [&](std::size_t i) { return 2 * values[i] > level; },
        [&](const std::vector<std::int64_t>& piece) {
            std::size_t sure = 0;
            for (const auto i : piece) sure += values[i] > level;
            if (sure > speck) set(piece, 255);
        });
    forPieces(
        width, height, [&](std::size_t i) { return pixels[i] == 0; },
        [&](const std::vector<std::int64_t>& piece) {
            if (piece.size() <= speck) set(piece, 255);
        });
    return mask;
}

}  // namespace stx
