#pragma once

#include <cmath>

#include "lib/model/environment.hpp"

/// A colour for each direction: smooth, unlike in all directions, 0.2..0.8.
inline glm::dvec3 paintedColour(glm::dvec3 direction) {
    const glm::dvec3 d = glm::normalize(direction);
    return {0.5 + 0.3 * std::sin(2 * d.x + d.z), 0.5 + 0.3 * std::sin(2 * d.y - d.x + 1),
            0.5 + 0.3 * std::cos(3 * d.z + d.y)};
}

/// An 8-bit texture of colourOf(position in 0..1).
template <class ColourOf>
stx::Texture paintedTexture(int width, int height, const ColourOf& colourOf) {
    stx::Rgba8Image image(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            image.at(x, y) = glm::u8vec4(glm::round(
                glm::dvec4(colourOf(glm::dvec2((x + 0.5) / width, (y + 0.5) / height)), 1.0) *
                255.0));
    return image;
}

/// The painted colours as six faces, or all around.
inline stx::Environment paintedCube(int size) {
    stx::Environment e;
    for (int f = 0; f < 6; ++f)
        e.pictures.push_back(paintedTexture(size, size, [f](glm::dvec2 p) {
            return paintedColour(stx::faceDirection(static_cast<stx::CubeFace>(f), p));
        }));
    return e;
}
inline stx::Environment paintedAround(int width) {
    stx::Environment e;
    e.layout = stx::Environment::Layout::equirectangular;
    e.pictures.push_back(paintedTexture(
        width, width / 2, [](glm::dvec2 p) { return paintedColour(stx::latlongDirection(p)); }));
    return e;
}
