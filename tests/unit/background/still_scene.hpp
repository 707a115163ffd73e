#pragma once

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <functional>
#include <map>
#include <vector>

#include "lib/background/still.hpp"

namespace stx {

/// Frames in memory, drawn by a function when they are asked for.
class DrawnFrames : public StillFrames {
  public:
    using Draw = std::function<Rgba8Image(int)>;

    DrawnFrames(glm::ivec2 size, int count, Draw draw)
        : size_(size), count_(count), draw_(std::move(draw)) {}
    [[nodiscard]] glm::ivec2 size() const override { return size_; }
    [[nodiscard]] int count() const override { return count_; }
    [[nodiscard]] Result<std::shared_ptr<const Rgba8Image>> frame(int k) override {
        ++reads;
        if (std::find(broken.begin(), broken.end(), k) != broken.end())
            return fail(ErrorCode::invalidInput, "frame {} is broken", k);
        return std::make_shared<const Rgba8Image>(draw_(shownFor(k)));
    }
    [[nodiscard]] int shownFor(int k) const override {
        const auto other = shown.find(k);
        return other == shown.end() ? k : other->second;
    }

    std::atomic<int> reads = 0;
    std::vector<int> broken;
    std::map<int, int> shown;  ///< of damaged frames: which takes its place

  private:
    glm::ivec2 size_;
    int count_;
    Draw draw_;
};

/// -2..2, the same for the same numbers.
inline int stillNoise(int x, int y, int k, int c) {
    const auto u = [](int v) { return static_cast<std::uint32_t>(v); };
    auto h = u(x) * 73856093u ^ u(y) * 19349663u ^ u(k) * 83492791u ^ u(c) * 2654435u;
    h = (h ^ h >> 13) * 0x5bd1e995u;
    return static_cast<int>((h ^ h >> 15) % 5) - 2;
}

/// A wall with a pattern, and nobody before it.
inline glm::u8vec4 wallAt(int x, int y) {
    return {60 + (x / 5 * 37 + y / 7 * 23) % 120, 80 + x % 90, 100 + y % 100, 255};
}
inline Rgba8Image wall(glm::ivec2 size) {
    Rgba8Image out(size.x, size.y);
    for (int y = 0; y < size.y; ++y)
        for (int x = 0; x < size.x; ++x) out.at(x, y) = wallAt(x, y);
    return out;
}

/// The wall with noise, and a patterned box at x, y (of w x h) in front of it.
inline Rgba8Image wallWithBox(glm::ivec2 size, int k, glm::ivec4 box) {
    Rgba8Image out(size.x, size.y);
    for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
            glm::u8vec4 p = wallAt(x, y);
            const int u = x - box.x, v = y - box.y;
            if (u >= 0 && v >= 0 && u < box.z && v < box.w)
                p = {u / 4 % 2 == 0 ? 230 : 20, v / 4 % 2 == 0 ? 20 : 220, 30, 255};
            for (int c = 0; c < 3; ++c)
                p[c] = static_cast<std::uint8_t>(p[c] + stillNoise(x, y, k, c));
            out.at(x, y) = p;
        }
    }
    return out;
}

/// Mean absolute difference of luma, and the share of pixels off by more than 20: AGE and pEPs.
struct BackgroundErrors {
    double age = 0, peps = 0;
};
inline BackgroundErrors backgroundErrors(const Rgba8Image& a, const Rgba8Image& truth) {
    BackgroundErrors e;
    for (std::size_t i = 0; i < a.count(); ++i) {
        const int d = std::abs(stillLuma(a.pixels()[i]) - stillLuma(truth.pixels()[i]));
        e.age += d;
        e.peps += d > 20;
    }
    e.age /= static_cast<double>(a.count());
    e.peps /= static_cast<double>(a.count());
    return e;
}

}  // namespace stx
