#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "lib/base/image.hpp"

namespace stx::surface {

/// What a frame of half the size has between its pixels.
struct Sample {
    bool mixed = true;       ///< not all are filled, nor all open
    glm::vec3 colour{0.0f};  ///< of those that are not open
    float q = 0;             ///< 0 where all are open
};

/// The filled half of a frame; none: empty.
struct Half {
    Image<glm::vec4> albedo;
    Image<float> q;
    Image<std::uint8_t> surface;  ///< 1 where some of the four pixels is, which is not filled

    /// The two pixels along a side beside the middle of pixel `at` of the frame, which is half as
    /// wide.
    static std::array<int, 2> beside(int at, int size) {
        return {std::max((at - 1) >> 1, 0), std::min((at + 1) >> 1, size - 1)};
    }
    /// Clears the marks of a row of the frame, two for each pixel here, where at() finds all open.
    /// `filled` is room to work in.
    void keepFilled(int y, std::span<std::uint8_t> marks, std::vector<std::uint8_t>& filled) const {
        if (q.empty()) return;
        const auto [y0, y1] = beside(y, q.height());
        const auto above = q.row(y0), below = q.row(y1);
        const std::size_t width = above.size();
        filled.assign(width + 2, 0);
        for (std::size_t x = 0; x < width; ++x)
            filled[x + 1] = above[x] + below[x] > 0.0f ? 0xff : 0;
        std::uint8_t* const __restrict mark = marks.data();
        const std::uint8_t* const __restrict at = filled.data();
        for (std::size_t x = 0; x < width; ++x) {
            mark[2 * x] &= at[x] | at[x + 1];
            mark[2 * x + 1] &= at[x + 1] | at[x + 2];
        }
    }
    /// The sample at pixel (x, y) of the frame.
    [[nodiscard]] Sample at(int x, int y) const {
        Sample sample;
        if (q.empty()) return sample;
        const auto [x0, x1] = beside(x, q.width());
        const auto [y0, y1] = beside(y, q.height());
        const std::array<float, 4> qs = {q.at(x0, y0), q.at(x1, y0), q.at(x0, y1), q.at(x1, y1)};
        sample.mixed = std::ranges::find(qs, 0.0f) != qs.end() ||
                       (surface.at(x0, y0) | surface.at(x1, y0) | surface.at(x0, y1) |
                        surface.at(x1, y1)) != 0;
        const float tu = x % 2 ? 0.25f : 0.75f, tv = y % 2 ? 0.25f : 0.75f;
        const std::array<float, 4> weights = {(1 - tu) * (1 - tv), tu * (1 - tv), (1 - tu) * tv,
                                              tu * tv};
        // Open samples have neither colour, alpha nor q.
        const glm::vec4 sum = weights[0] * albedo.at(x0, y0) + weights[1] * albedo.at(x1, y0) +
                              weights[2] * albedo.at(x0, y1) + weights[3] * albedo.at(x1, y1);
        if (sum.a == 0.0f) return sample;
        sample.colour = glm::vec3(sum);
        sample.q =
            weights[0] * qs[0] + weights[1] * qs[1] + weights[2] * qs[2] + weights[3] * qs[3];
        if (sample.mixed) {
            sample.colour /= sum.a;
            sample.q /= sum.a;
        }
        return sample;
    }
};

}  // namespace stx::surface
