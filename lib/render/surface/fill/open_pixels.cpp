#include "lib/render/surface/fill/open_pixels.hpp"

#include <algorithm>
#include <bit>
#include <span>

#include "lib/base/parallel.hpp"

namespace stx::surface {
namespace {

/// The closed ones among up to 64 pixels of a row, a bit each.
std::uint64_t closedBits(const glm::vec4* albedo, const float* q, std::size_t count) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < count; ++i)
        bits |= static_cast<std::uint64_t>(albedo[i].a >= kClosed && q[i] > 0.0f) << i;
    return bits;
}

/// Distances along a row to the nearest closed pixel of the row.
void distancesAlong(std::span<const glm::vec4> albedo, std::span<const float> q,
                    std::span<std::uint8_t> row) {
    const auto width = static_cast<int>(row.size());
    std::fill(row.begin(), row.end(), std::uint8_t{0});
    const auto put = [&](int begin, int end) {
        // What is beside the picture is not closed.
        constexpr int kNone = kFarthestCounted;
        const int left = begin > 0 ? begin - 1 : begin - kNone;
        const int right = end < width ? end : end + kNone;
        for (int x = begin; x < end; ++x)
            row[static_cast<std::size_t>(x)] =
                static_cast<std::uint8_t>(std::min({x - left, right - x, kNone}));
    };
    int begin = -1;  // of the open run that x is in, -1 = none
    for (int x = 0; x < width;) {
        const auto first = static_cast<std::size_t>(x);
        const int count = std::min(64, width - x);
        std::uint64_t bits = closedBits(&albedo[first], &q[first], static_cast<std::size_t>(count));
        for (int at = 0; at < count;) {
            // Goes on to the next pixel of the other kind.
            const std::uint64_t left = (begin < 0 ? ~bits : bits) >> at << at;
            at = std::min(std::countr_zero(left), count);
            if (at == count) break;
            if (begin >= 0) put(begin, x + at);
            begin = begin < 0 ? x + at : -1;
        }
        x += count;
    }
    if (begin >= 0) put(begin, width);
}

/// Lowers the distances of a row to what those of the row before or after it tell.
void distancesAcross(std::uint8_t* __restrict row, const std::uint8_t* __restrict other,
                     int width) {
    // Bytes throughout: vectors take sixteen and more at once.
    const auto least = [](std::uint8_t a, std::uint8_t b) { return a < b ? a : b; };
    const auto next = [&](std::uint8_t d) {
        return static_cast<std::uint8_t>(least(d, kFarthestCounted - 1) + 1);
    };
    for (int x = 1; x < width - 1; ++x)
        row[x] = least(row[x], next(least(least(other[x - 1], other[x]), other[x + 1])));
    for (const int x : {0, width - 1}) {
        const int before = std::max(x - 1, 0), after = std::min(x + 1, width - 1);
        row[x] = least(row[x], next(least(least(other[before], other[x]), other[after])));
    }
}

}  // namespace

void putIn(OpenFrame& frame, const FilledPixel& fill) {
    glm::vec4& pixel = frame.albedo.at(fill.x, fill.y);
    const float open = 1.0f - pixel.a;
    pixel += glm::vec4(fill.colour * open, open);
    float& q = frame.q.at(fill.x, fill.y);
    if (q > 0.0f && open <= kMostlyOpen) return;
    q = fill.q;
    if (frame.normal && fill.normal != glm::vec3(0.0f))
        frame.normal->at(fill.x, fill.y) = fill.normal;
}

Image<std::uint8_t> distancesToSurface(const OpenFrame& frame) {
    const int width = frame.q.width(), height = frame.q.height();
    Image<std::uint8_t> distances(width, height);
    parallelForBlocks(0, height, 32, [&](std::int64_t from, std::int64_t to) {
        for (int y = static_cast<int>(from); y < to; ++y)
            distancesAlong(frame.albedo.row(y), frame.q.row(y), distances.row(y));
    });
    const auto pass = [&](int y, int before) {
        distancesAcross(distances.row(y).data(), distances.row(before).data(), width);
    };
    for (int y = 1; y < height; ++y) pass(y, y - 1);
    for (int y = height - 1; y-- > 0;) pass(y, y + 1);
    return distances;
}

}  // namespace stx::surface
