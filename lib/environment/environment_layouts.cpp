#include <algorithm>
#include <cmath>

#include <glm/gtc/constants.hpp>

#include "lib/base/parallel.hpp"
#include "lib/environment/environment_map.hpp"

namespace stx {
namespace {

/// A picture of colourOf(position), straight alpha, of positions in 0..1.
template <class Colour>
Texture pictureOf(bool linear, glm::ivec2 size, const Colour& colourOf) {
    Rgba8Image coded(linear ? 0 : size.x, linear ? 0 : size.y);
    RgbaFloatImage floats(linear ? size.x : 0, linear ? size.y : 0);
    parallelFor(0, size.y, 4, [&](int y) {
        for (int x = 0; x < size.x; ++x) {
            const glm::vec4 c = colourOf(glm::dvec2((x + 0.5) / size.x, (y + 0.5) / size.y));
            if (linear)
                floats.at(x, y) = c;
            else
                coded.at(x, y) = glm::u8vec4(glm::clamp(c, 0.0f, 1.0f) * 255.0f + glm::vec4(0.5f));
        }
    });
    if (linear) return floats;
    return coded;
}

int largestFace(const Environment& environment) {
    int size = 1;
    for (const Texture& t : environment.pictures) size = std::max({size, t.width(), t.height()});
    return size;
}

Environment withoutPictures(const Environment& environment, Environment::Layout layout) {
    Environment out;
    out.layout = layout;
    out.orientation = environment.orientation;
    out.skyColours = environment.skyColours;
    out.skyAngles = environment.skyAngles;
    out.groundColours = environment.groundColours;
    out.groundAngles = environment.groundAngles;
    return out;
}

/// Coarser by more than this, and samples are averaged.
constexpr double kCoarser = 1.2;

}  // namespace

bool isOpaque(const Texture& picture) {
    if (picture.empty()) return false;
    if (const auto* coded = picture.rgba8())
        return std::ranges::all_of(coded->pixels(), [](glm::u8vec4 p) { return p.a == 255; });
    return std::ranges::all_of(picture.rgbaFloat()->pixels(),
                               [](glm::vec4 p) { return p.a >= 1.0f; });
}

int cubeSizeOf(const Environment& environment) {
    if (environment.layout == Environment::Layout::cube) return largestFace(environment);
    const int width = environment.pictures.empty() ? 1 : environment.pictures[0].width();
    return std::max(1, 2 * static_cast<int>(std::ceil(width / glm::two_pi<double>())));
}

glm::ivec2 equirectangularSizeOf(const Environment& environment) {
    if (environment.layout == Environment::Layout::equirectangular && !environment.pictures.empty())
        return {environment.pictures[0].width(), environment.pictures[0].height()};
    const int size = largestFace(environment);
    return {4 * size, 2 * size};
}

Result<Environment> asCube(const Environment& environment, int size, const Limits& limits) {
    if (size < 1)
        return fail(ErrorCode::usage, "faces of {}x{} pixels; 1x1 is the least", size, size);
    if (environment.layout == Environment::Layout::cube &&
        std::ranges::all_of(environment.pictures, [&](const Texture& t) {
            return t.empty() || (t.width() == size && t.height() == size);
        }))
        return environment;
    const bool linear = environment.linear();
    STX_CHECK(limits.checkAllocation(6ull * static_cast<std::uint64_t>(size) * size,
                                     linear ? 16 : 4, "six faces"));
    STX_TRY(const auto map, EnvironmentMap::make(environment, limits));
    Environment out = withoutPictures(environment, Environment::Layout::cube);
    if (environment.pictureCount() == 0) return out;
    const float footprint =
        cubeSizeOf(environment) > kCoarser * size ? 2.0f / static_cast<float>(size) : 0.0f;
    for (int f = 0; f < 6; ++f)
        out.pictures.push_back(pictureOf(linear, {size, size}, [&](glm::dvec2 p) {
            const glm::vec3 d(faceDirection(static_cast<CubeFace>(f), p));
            return footprint > 0 ? map->pictureAt(d, footprint) : map->pictureAt(d);
        }));
    return out;
}

Result<Environment> asEquirectangular(const Environment& environment, int width, int height,
                                      const Limits& limits) {
    const glm::ivec2 size(width, height);
    if (width < 1 || height < 1)
        return fail(ErrorCode::usage, "a picture of {}x{} pixels; 1x1 is the least", width, height);
    if (environment.layout == Environment::Layout::equirectangular &&
        (environment.pictures.empty() || equirectangularSizeOf(environment) == size))
        return environment;
    const bool linear = environment.linear();
    STX_CHECK(limits.checkAllocation(static_cast<std::uint64_t>(width) * height, linear ? 16 : 4,
                                     "the picture all around"));
    STX_TRY(const auto map, EnvironmentMap::make(environment, limits));
    Environment out = withoutPictures(environment, Environment::Layout::equirectangular);
    if (environment.pictureCount() == 0) return out;
    const float footprint = equirectangularSizeOf(environment).y > kCoarser * height
                                ? glm::pi<float>() / static_cast<float>(height)
                                : 0.0f;
    out.pictures.push_back(pictureOf(linear, size, [&](glm::dvec2 p) {
        const glm::vec3 d(latlongDirection(p));
        return footprint > 0 ? map->pictureAt(d, footprint) : map->pictureAt(d);
    }));
    return out;
}

Result<Environment> flattened(const Environment& environment, const Limits& limits) {
    STX_TRY(const auto map, EnvironmentMap::make(environment, limits));
    const bool cube = environment.layout == Environment::Layout::cube;
    const bool behind = !environment.skyColours.empty() || !environment.groundColours.empty();
    const bool through =
        environment.pictures.empty() || !std::ranges::all_of(environment.pictures, &isOpaque);
    if (environment.orientation == glm::dquat(1, 0, 0, 0) && !(behind && through)) {
        Environment out = environment;
        out.skyColours = out.groundColours = {};
        out.skyAngles = out.groundAngles = {};
        return out;
    }
    const bool linear = environment.linear();
    Environment under = withoutPictures(environment, environment.layout);
    std::shared_ptr<const EnvironmentMap> sky;
    if (behind) STX_SET(sky, EnvironmentMap::make(under, limits));
    const auto colourOf = [&](glm::dvec3 direction) {
        const glm::vec3 d = map->environmentFromWorld() * glm::vec3(direction);
        glm::vec4 c = map->pictureAt(d);
        if (!sky || c.a >= 1.0f) return c;
        c = glm::vec4(glm::vec3(c) * c.a, c.a) + sky->sampleTurned(d, 0, linear) * (1.0f - c.a);
        return c.a > 0.0f ? glm::vec4(glm::vec3(c) / c.a, c.a) : c;
    };
    Environment out;
    out.layout = environment.layout;
    if (cube) {
        constexpr int kSkyOnly = 64;  // pixels a side, where there is no picture
        const int size = environment.pictureCount() > 0 ? largestFace(environment) : kSkyOnly;
        for (int f = 0; f < 6; ++f)
            out.pictures.push_back(pictureOf(linear, {size, size}, [&](glm::dvec2 p) {
                return colourOf(faceDirection(static_cast<CubeFace>(f), p));
            }));
    } else {
        out.pictures.push_back(
            pictureOf(linear, equirectangularSizeOf(environment),
                      [&](glm::dvec2 p) { return colourOf(latlongDirection(p)); }));
    }
    return out;
}

}  // namespace stx
