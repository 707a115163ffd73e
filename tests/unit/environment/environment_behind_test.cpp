// Frames over environments: open pixels, edges, colour spaces, cameras.
#include <gtest/gtest.h>

#include "lib/model/texture.hpp"
#include "lib/render/compose/environment_behind.hpp"
#include "tests/painted_environment.hpp"

namespace stx {
namespace {

/// A camera at the origin that looks along a direction.
Camera lookingAlong(glm::dvec3 direction, int size = 32) {
    const auto turn = lookAt({0, 0, 0}, direction);
    EXPECT_TRUE(turn);
    return Camera::fromFieldOfView({5, -3, 2}, *turn, {1.2, 1.2}, false, size, size);
}

Frame openFrame(const Camera& camera, bool linear = false) {
    Frame frame;
    frame.colour = Image<glm::vec4>(camera.width, camera.height, glm::vec4(0.0f));
    frame.depth = Image<float>(camera.width, camera.height, kNoDepth);
    frame.linear = linear;
    return frame;
}

TEST(EnvironmentBehind, OpenPixelsShowWhatIsInTheirDirection) {
    for (const Environment& e : {paintedCube(256), paintedAround(1024)}) {
        const auto map = EnvironmentMap::make(e, Limits());
        ASSERT_TRUE(map);
        for (const glm::dvec3 along :
             {glm::dvec3(0, 0, -1), {1, 0.2, 0.1}, {0.1, 1, 0.1}, {0, -1, 0.3}, {0, 0.1, 1}}) {
            const Camera camera = lookingAlong(along);
            Frame frame = openFrame(camera);
            putEnvironmentBehind(frame, camera, **map);
            for (int y = 0; y < camera.height; ++y) {
                for (int x = 0; x < camera.width; ++x) {
                    const glm::vec4 c = frame.colour.at(x, y);
                    const auto d = camera.viewDirection(x + 0.5, y + 0.5);
                    EXPECT_LT(glm::distance(glm::dvec3(c), paintedColour(d)), 0.01);
                    EXPECT_EQ(c.a, 1.0f);
                    EXPECT_FALSE(hasPoint(frame.depth.at(x, y)));
                }
            }
        }
    }
}

TEST(EnvironmentBehind, CoveredPixelsStayAndEdgesAreMixed) {
    Environment e;
    for (int f = 0; f < 6; ++f)
        e.pictures.emplace_back(Rgba8Image(4, 4, glm::u8vec4(0, 255, 0, 255)));
    const auto map = EnvironmentMap::make(e, Limits());
    ASSERT_TRUE(map);
    for (const bool linear : {false, true}) {
        const Camera camera = lookingAlong({0, 0, -1}, 2);
        Frame frame = openFrame(camera, linear);
        frame.colour.at(0, 0) = {0.5, 0, 0, 1};
        frame.colour.at(1, 0) = {0.25, 0, 0, 0.5};  // premultiplied
        frame.depth.at(0, 0) = 3;
        putEnvironmentBehind(frame, camera, **map);
        EXPECT_EQ(frame.colour.at(0, 0), glm::vec4(0.5, 0, 0, 1));
        EXPECT_LT(glm::distance(frame.colour.at(1, 0), glm::vec4(0.25, 0.5, 0, 1)), 1e-5);
        EXPECT_LT(glm::distance(frame.colour.at(1, 1), glm::vec4(0, 1, 0, 1)), 1e-5);
        EXPECT_EQ(frame.depth.at(0, 0), 3.0f);
    }
}

TEST(EnvironmentBehind, IsInTheColourSpaceOfTheFrame) {
    Environment e;
    for (int f = 0; f < 6; ++f)
        e.pictures.emplace_back(Rgba8Image(4, 4, glm::u8vec4(glm::u8vec3(188), 255)));
    const auto map = EnvironmentMap::make(e, Limits());
    ASSERT_TRUE(map);
    const Camera camera = lookingAlong({1, 1, 1}, 2);
    Frame coded = openFrame(camera), linear = openFrame(camera, true);
    putEnvironmentBehind(coded, camera, **map);
    putEnvironmentBehind(linear, camera, **map);
    EXPECT_NEAR(coded.colour.at(1, 1).r, 188 / 255.0, 1e-4);
    EXPECT_NEAR(linear.colour.at(1, 1).r, linearFromSrgb(188 / 255.0f), 1e-4);
}

TEST(EnvironmentBehind, AnOrthographicCameraSeesOneDirection) {
    const auto map = EnvironmentMap::make(paintedCube(64), Limits());
    ASSERT_TRUE(map);
    Camera camera = lookingAlong({0.3, -0.2, 1}, 8);
    const glm::dvec3 along = camera.forward();
    camera = Camera::fromFieldOfView({0, 0, 0}, camera.orientation, {2, 2}, true, 8, 8);
    Frame frame = openFrame(camera);
    putEnvironmentBehind(frame, camera, **map);
    for (const glm::vec4& c : frame.colour.pixels())
        EXPECT_LT(glm::distance(glm::dvec3(c), paintedColour(along)), 0.01);
}

}  // namespace
}  // namespace stx
