#include <algorithm>
#include <cmath>

#include "lib/base/parallel.hpp"
#include "lib/panorama/panorama.hpp"

namespace stx {
namespace {

/// Catmull-Rom's weights of four neighbours, `t` of the way from the second to the third.
std::array<float, 4> cubicWeights(float t) {
    return {0.5f * t * (t * (2 - t) - 1), 0.5f * (t * t * (3 * t - 5) + 2),
            0.5f * t * (t * (4 - 3 * t) + 1), 0.5f * t * t * (t - 1)};
}

}  // namespace

glm::dvec3 PanoramaImage::direction(glm::dvec2 position, int width) {
    const double longitude = M_PI * (1 - 2 * position.x / width);
    const double latitude = M_PI * (0.5 - 2 * position.y / width);
    return {-std::cos(latitude) * std::sin(longitude), std::sin(latitude),
            -std::cos(latitude) * std::cos(longitude)};
}

glm::dvec2 PanoramaImage::position(glm::dvec3 d, int width) {
    const double longitude = std::atan2(-d.x, -d.z);
    const double latitude = std::atan2(d.y, std::hypot(d.x, d.z));
    return {(1 - longitude / M_PI) * 0.5 * width, (0.5 - latitude / M_PI) * 0.5 * width};
}

glm::vec4 PanoramaImage::sample(glm::dvec3 direction) const {
    const glm::dvec2 p = position(direction, width()) - 0.5;
    const int x0 = static_cast<int>(std::floor(p.x)), y0 = static_cast<int>(std::floor(p.y));
    const auto wx = cubicWeights(static_cast<float>(p.x - x0));
    const auto wy = cubicWeights(static_cast<float>(p.y - y0));
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
            const float w = wx[static_cast<std::size_t>(i)] * wy[static_cast<std::size_t>(j)] *
                            (static_cast<float>(c.a) / 255.0f);
            sum += w * glm::vec4(glm::vec3(c.r, c.g, c.b) / 255.0f, 1);
        }
    }
    const float alpha = std::clamp(sum.a, 0.0f, 1.0f);
    if (sum.a <= 1e-4f) return glm::vec4(0);
    return glm::vec4(glm::clamp(glm::vec3(sum) / sum.a, 0.0f, 1.0f) * alpha, alpha);
}

glm::dvec3 panoramaFaceDirection(PanoramaFace face, glm::dvec2 p) {
    const double a = 2 * p.x - 1, b = 1 - 2 * p.y;
    switch (face) {
        case PanoramaFace::back:
            return {-a, b, 1};
        case PanoramaFace::bottom:
            return {a, -1, -b};
        case PanoramaFace::front:
            return {a, b, -1};
        case PanoramaFace::left:
            return {-1, b, -a};
        case PanoramaFace::right:
            return {1, b, a};
        case PanoramaFace::top:
            return {a, 1, b};
    }
    return {0, 0, -1};
}

PanoramaFaces panoramaFaces(const PanoramaImage& panorama, int size) {
    PanoramaFaces out;
    auto& faces = out.pictures;
    // Where a face has fewer pixels than the panorama, each is the mean of several places.
    const int steps =
        std::clamp(static_cast<int>(std::lround(panorama.width() / (3.2 * size))), 1, 8);
    for (std::size_t f = 0; f < faces.size(); ++f) {
        faces[f] = Rgba8Image(size, size);
        parallelForBlocks(0, size, 8, [&](std::int64_t begin, std::int64_t end) {
            for (auto y = static_cast<int>(begin); y < end; ++y)
                for (int x = 0; x < size; ++x) {
                    glm::vec4 sum(0);
                    for (int j = 0; j < steps; ++j)
                        for (int i = 0; i < steps; ++i)
                            sum += panorama.sample(panoramaFaceDirection(
                                static_cast<PanoramaFace>(f),
                                glm::dvec2(x + (i + 0.5) / steps, y + (j + 0.5) / steps) /
                                    static_cast<double>(size)));
                    sum /= static_cast<float>(steps * steps);
                    const glm::vec3 c = sum.a > 0 ? glm::vec3(sum) / sum.a : glm::vec3(0);
                    faces[f].at(x, y) =
                        glm::u8vec4(glm::clamp(glm::vec4(c, sum.a) * 255.0f + 0.5f, 0.0f, 255.0f));
                }
        });
    }
    return out;
}

}  // namespace stx
