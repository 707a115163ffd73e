#include "lib/sheet/tiles.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "lib/base/parallel.hpp"
#include "lib/geometry/depth_code.hpp"
#include "lib/model/srgb8.hpp"

namespace stx {
namespace {

/// The pixels [from, to) of an image of `size` under pixel `at` of one of `shown`.
struct Under {
    glm::ivec2 from, to;
};

Under under(glm::ivec2 at, glm::ivec2 shown, glm::ivec2 size) {
    const auto edge = [&](int i, int axis) {
        return static_cast<int>(static_cast<std::int64_t>(i) * size[axis] / shown[axis]);
    };
    Under u;
    for (int axis = 0; axis < 2; ++axis) {
        u.from[axis] = edge(at[axis], axis);
        u.to[axis] = std::max(edge(at[axis] + 1, axis), u.from[axis] + 1);
    }
    return u;
}

/// Each new pixel by `make(Under)`.
template <class T, class Make>
Image<T> shrunkBy(glm::ivec2 size, glm::ivec2 cell, const Make& make) {
    const glm::ivec2 shown = sizeInCell(size, cell);
    Image<T> out(shown.x, shown.y);
    parallelFor(0, shown.y, [&](int y) {
        for (int x = 0; x < shown.x; ++x) out.at(x, y) = make(under({x, y}, shown, size));
    });
    return out;
}

/// The mean of what `linear(x, y)` gives, as 8-bit sRGB.
template <class Linear>
Rgb8Image meanOf(glm::ivec2 size, glm::ivec2 cell, const Linear& linear) {
    return shrunkBy<glm::u8vec3>(size, cell, [&](const Under& u) {
        glm::vec3 sum(0.0f);
        for (int y = u.from.y; y < u.to.y; ++y) {
            for (int x = u.from.x; x < u.to.x; ++x) sum += linear(x, y);
        }
        sum /= static_cast<float>((u.to.x - u.from.x) * (u.to.y - u.from.y));
        return glm::u8vec3(srgb8FromLinear(sum.x), srgb8FromLinear(sum.y), srgb8FromLinear(sum.z));
    });
}

glm::vec3 linearOf(glm::u8vec3 c) {
    return {linearFromSrgb8(c.x), linearFromSrgb8(c.y), linearFromSrgb8(c.z)};
}

}  // namespace

glm::ivec2 sizeInCell(glm::ivec2 size, glm::ivec2 cell) {
    const int times = std::min(cell.x / size.x, cell.y / size.y);
    if (times >= 1) return size * times;
    const double scale =
        std::min(static_cast<double>(cell.x) / size.x, static_cast<double>(cell.y) / size.y);
    return glm::max(glm::ivec2(glm::dvec2(size) * scale + 0.5), glm::ivec2(1));
}

Rgb8Image shrunk(const Texture& texture, glm::ivec2 cell) {
    const glm::vec3 behind = linearOf(kEmptyColour);
    const auto over = [&](glm::vec3 colour, float alpha) {
        return colour * alpha + behind * (1.0f - alpha);
    };
    const glm::ivec2 size(texture.width(), texture.height());
    if (const Rgba8Image* coded = texture.rgba8())
        return meanOf(size, cell, [&](int x, int y) {
            const glm::u8vec4 c = coded->at(x, y);
            return over(linearOf(c), static_cast<float>(c.a) / 255.0f);
        });
    const RgbaFloatImage& linear = *texture.rgbaFloat();
    return meanOf(size, cell, [&](int x, int y) {
        const glm::vec4 c = linear.at(x, y);
        // Brighter than white must not outshine its neighbours.
        return over(glm::clamp(glm::vec3(c), 0.0f, 1.0f), glm::clamp(c.a, 0.0f, 1.0f));
    });
}

Rgb8Image shrunk(const Rgb8Image& picture, glm::ivec2 cell) {
    return meanOf(picture.size(), cell, [&](int x, int y) { return linearOf(picture.at(x, y)); });
}

Image<float> shrunkValues(const Image<float>& values, glm::ivec2 cell) {
    return shrunkBy<float>(values.size(), cell, [&](const Under& u) {
        float least = kNoDepth;
        int finite = 0;
        for (int y = u.from.y; y < u.to.y; ++y) {
            for (int x = u.from.x; x < u.to.x; ++x) {
                const float value = values.at(x, y);
                if (!std::isfinite(value)) continue;
                ++finite;
                least = std::min(least, value);
            }
        }
        const int all = (u.to.x - u.from.x) * (u.to.y - u.from.y);
        return 2 * finite >= all ? least : kNoDepth;
    });
}

Image<float> shrunkLargest(const Image<float>& values, glm::ivec2 cell) {
    return shrunkBy<float>(values.size(), cell, [&](const Under& u) {
        float largest = -kNoDepth;
        for (int y = u.from.y; y < u.to.y; ++y)
            for (int x = u.from.x; x < u.to.x; ++x)
                if (std::isfinite(values.at(x, y))) largest = std::max(largest, values.at(x, y));
        return std::isfinite(largest) ? largest : kNoDepth;
    });
}

std::string rangeText(const std::string& what, const ValueRange& range) {
    if (range.empty()) return "no " + what;
    return fmt::format("{} {:.4g} to {:.4g}", what, range.least, range.most);
}

Tile colourTile(const Texture& texture, glm::ivec2 cell) {
    return {shrunk(texture, cell), texture.isLinear() ? "colour, linear" : "colour"};
}

Tile depthTile(const Image<float>& depth, glm::ivec2 cell) {
    const ValueRange range = rangeOf(depth);
    return {falseColour(shrunkValues(depth, cell), range, kEmptyColour), rangeText("depth", range),
            !range.empty()};
}

Tile normalTile(const Image<glm::vec3>& normal, glm::ivec2 cell) {
    return {meanOf(normal.size(), cell,
                   [&](int x, int y) {
                       const glm::vec3 n = normal.at(x, y);
                       if (n == glm::vec3(0.0f)) return linearOf(kEmptyColour);
                       return linearOf(glm::u8vec3(glm::clamp(n * 127.5f + 128.0f, 0.0f, 255.0f)));
                   }),
            "normals"};
}

Tile metallicRoughnessTile(const Image<glm::vec2>& values, glm::ivec2 cell) {
    return {meanOf(values.size(), cell,
                   [&](int x, int y) {
                       const glm::vec2 v = values.at(x, y);
                       if (v == glm::vec2(0.0f)) return linearOf(kEmptyColour);
                       return linearOf(glm::u8vec3(
                           glm::clamp(glm::vec3(0, v.y, v.x) * 255.0f + 0.5f, 0.0f, 255.0f)));
                   }),
            "G rough, B metal"};
}

Tile emissiveTile(const Image<glm::vec3>& emissive, glm::ivec2 cell) {
    float most = 1.0f;
    for (const auto& v : emissive.pixels()) {
        for (int c = 0; c < 3; ++c) {
            if (std::isfinite(v[c])) most = std::max(most, v[c]);
        }
    }
    return {meanOf(emissive.size(), cell,
                   [&](int x, int y) { return glm::clamp(emissive.at(x, y) / most, 0.0f, 1.0f); }),
            most > 1.0f ? fmt::format("emissive, up to {:.4g}", most) : "emissive"};
}

Tile splatTile(const Image<glm::vec3>& splatU, const Image<glm::vec3>& splatV, glm::ivec2 cell) {
    Image<float> longer(splatU.width(), splatU.height(), kNoDepth);
    for (std::size_t i = 0; i < longer.count(); ++i) {
        const float length = std::max(glm::length(splatU.data()[i]), glm::length(splatV.data()[i]));
        if (length > 0.0f) longer.data()[i] = length;
    }
    const ValueRange range = rangeOf(longer);
    return {falseColour(shrunkValues(longer, cell), range, kEmptyColour),
            rangeText("splats", range), !range.empty()};
}

}  // namespace stx
