#pragma once

#include "lib/model/bundle.hpp"

/// A small view of a wall with something before it.
namespace stx::test {

inline constexpr int kWidth = 48, kHeight = 36;
inline constexpr float kWall = 4.0f;

inline glm::u8vec3 wallColour(int x, int y) {
    return {90 + 2 * x, 80 + 3 * y, 120 + (x * 7 + y * 5) % 40};
}

/// A wall, with a block of another colour before it that covers columns x0 to x1.
inline ReferenceView wallWithBlock(int x0, int x1, float depth, float light = 1.0f) {
    ReferenceView view;
    view.name = "camera";
    view.camera =
        Camera::fromFieldOfView({0, 0, 0}, {1, 0, 0, 0}, {1.0, 0.8}, false, kWidth, kHeight);
    view.nearPlane = 0.5;
    view.farPlane = 8;
    view.depthBits = 32;
    view.depth = Image<float>(kWidth, kHeight, kWall);
    Rgba8Image colour(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const bool block = x >= x0 && x < x1 && y >= 8;
            const glm::vec3 c = block ? glm::vec3(30, 60, 200) : glm::vec3(wallColour(x, y));
            colour.at(x, y) = glm::u8vec4(glm::u8vec3(c * light + 0.5f), 255);
            if (block) view.depth.at(x, y) = depth;
        }
    }
    view.texture = std::move(colour);
    return view;
}

/// The block stands before the wall now; the wall without it is the bundle's background.
inline Bundle wallWithBackground(float light = 1.0f) {
    Bundle bundle;
    bundle.views = {wallWithBlock(18, 30, 2.0f, light), wallWithBlock(0, 0, 2.0f)};
    bundle.views[1].name = "camera background";
    bundle.views[1].background = true;
    return bundle;
}

/// Beside it: a part of the wall that the block hides comes into sight.
inline Camera besideWall() {
    Camera camera = wallWithBlock(0, 0, 2.0f).camera;
    camera.position.x += 0.8;
    return camera;
}

}  // namespace stx::test
