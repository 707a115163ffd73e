#pragma once

#include <algorithm>
#include <cstdlib>
#include <string>

#include "formats/yuv/y4m_writer.hpp"
#include "lib/model/texture.hpp"

namespace stx {

/// A picture of its own for each `k`.
inline Rgba8Image ramp(int width, int height, int k = 0) {
    Rgba8Image out(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            out.at(x, y) = {40 + x * 4 + k, 60 + y * 5, 150 - x - y, 255};
    return out;
}

/// A stream of two frames.
inline std::string y4mText(const Rgba8Image& a, const Rgba8Image& b, const Y4mOptions& options) {
    std::string text = y4mHeader(a.width(), a.height(), options) + "\n";
    for (const auto* image : {&a, &b}) {
        const auto planes = y4mPlanes(*image, options);
        text += "FRAME\n";
        text.append(reinterpret_cast<const char*>(planes.data()), planes.size());
    }
    return text;
}

inline int largestDifference(const Rgba8Image& a, const Rgba8Image& b) {
    int most = 0;
    for (std::size_t i = 0; i < a.count(); ++i)
        for (int c = 0; c < 4; ++c)
            most = std::max(most, std::abs(a.pixels()[i][c] - b.pixels()[i][c]));
    return most;
}

}  // namespace stx
