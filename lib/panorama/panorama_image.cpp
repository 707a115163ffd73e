#include <algorithm>
#include <cmath>

#include "lib/geometry/catmull_rom.hpp"
#include "lib/geometry/directions.hpp"
#include "lib/panorama/panorama.hpp"

namespace stx {

glm::dvec3 PanoramaImage::direction(glm::dvec2 position, int width) {
    return latlongDirection(position * glm::dvec2(1.0 / width, 2.0 / width));
}

glm::dvec2 PanoramaImage::position(glm::dvec3 direction, int width) {
    return latlongPosition(direction) * glm::dvec2(width, 0.5 * width);
}

glm::vec4 PanoramaImage::sample(glm::dvec3 direction) const {
    const glm::dvec2 p = position(direction, width()) - 0.5;
    const int x0 = static_cast<int>(std::floor(p.x)), y0 = static_cast<int>(std::floor(p.y));
    const auto wx = catmullRomWeights(static_cast<float>(p.x - x0));
    const auto wy = catmullRomWeights(static_cast<float>(p.y - y0));
    glm::vec4 sum(0);
    for (int j = 0; j < 4; ++j) {
        int y = y0 - 1 + j;
        // Beyond a pole is the row before it, half a turn away.
        const bool beyond = y < 0 || y >= height();
        y = y < 0 ? -1 - y : y >= height() ? 2 * height() - 1 - y : y;
        y = std::clamp(y, 0, height() - 1);
        for (int i = 0; i < 4; ++i) {
            const int x = ((x0 - 1 + i + (beyond ? width() / 2 : 0)) % width() + width()) % width();
            const glm::u8vec4 c = pixels.at(x, y);
            const float w = wx[i] * wy[j] * (static_cast<float>(c.a) / 255.0f);
            sum += w * glm::vec4(glm::vec3(c.r, c.g, c.b) / 255.0f, 1);
        }
    }
    const float alpha = std::clamp(sum.a, 0.0f, 1.0f);
    // Cubic weights may be negative, and so may their sum beside what is covered.
    constexpr float kNothing = 1e-4f;
    if (sum.a <= kNothing) return glm::vec4(0);
    return glm::vec4(glm::clamp(glm::vec3(sum) / sum.a, 0.0f, 1.0f) * alpha, alpha);
}

}  // namespace stx
