// Light adds up as linear light, whatever coding colours have.

#include <gtest/gtest.h>

#include "lib/light/lighting.hpp"
#include "lib/model/texture.hpp"

namespace stx {
namespace {

Lighting oneLight(float amount) {
    Lighting lighting;
    lighting.lights = {{Light::Kind::directional, {0, 0, -1}, glm::vec3(amount), false}};
    lighting.ambient = glm::vec3(0.0f);
    return lighting;
}

glm::vec3 lit(const Lighting& lighting, float albedo, bool linear) {
    return shadePhong(lighting, glm::vec3(albedo), {0, 0, 0}, {0, 0, 1}, {0, 0, 1}, linear);
}

TEST(Lighting, HalfTheLightIsHalfTheLightOfACodedColourToo) {
    for (const float coded : {0.02f, 0.2f, 0.5f, 0.8f, 1.0f}) {
        const float expected = srgbFromLinear(0.5f * linearFromSrgb(coded));
        EXPECT_NEAR(lit(oneLight(0.5f), coded, false).x, expected, 1e-4f) << coded;
    }
    EXPECT_FLOAT_EQ(lit(oneLight(0.5f), 0.6f, true).x, 0.3f);
}

TEST(Lighting, OnlyTheDirectionOfADirectionalLightCounts) {
    for (const float length : {1e-30f, 1e-3f, 1e3f, 1e20f, 1e38f}) {
        Lighting lighting = oneLight(0.5f);
        lighting.lights[0].vector *= length;
        EXPECT_FLOAT_EQ(lit(lightsInWorld(lighting, glm::dmat4(1.0)), 0.6f, true).x, 0.3f)
            << length;
    }
}

TEST(Lighting, APointLightShinesFromAnyDistance) {
    for (const float distance : {1e3f, 1e14f, 1e16f, 1e20f, 3e38f}) {
        for (const bool inCameraSpace : {false, true}) {
            Lighting lighting = oneLight(0.5f);
            lighting.lights[0] = {
                Light::Kind::point, {0, 0, distance}, glm::vec3(0.5f), inCameraSpace};
            EXPECT_FLOAT_EQ(lit(lightsInWorld(lighting, glm::dmat4(1.0)), 0.6f, true).x, 0.3f)
                << distance;
        }
    }
}

TEST(Lighting, FullLightLeavesACodedColourAsItIs) {
    for (const float coded : {0.0f, 0.003f, 0.1f, 0.5f, 1.0f})
        EXPECT_NEAR(lit(oneLight(1.0f), coded, false).x, coded, 1e-4f) << coded;
}

TEST(Lighting, LinearColoursMayGrowBeyondOneAndCodedOnesStopThere) {
    EXPECT_FLOAT_EQ(lit(oneLight(3.0f), 0.5f, true).x, 1.5f);
    EXPECT_FLOAT_EQ(lit(oneLight(3.0f), 0.9f, false).x, 1.0f);
}

TEST(Lighting, CodedColoursGrowBeyondOneWhereTheyMay) {
    Lighting lighting = oneLight(3.0f);
    lighting.beyondOne = true;
    for (const float coded : {0.1f, 0.5f, 0.9f, 1.0f}) {
        const float light = linearFromSrgb(lit(lighting, coded, false).x);
        EXPECT_NEAR(light, 3.0f * linearFromSrgb(coded), 1e-3f) << coded;
    }
}

}  // namespace
}  // namespace stx
