// Diffuse and glossy light of an environment, against the integrals themselves.
#include <random>

#include <gtest/gtest.h>
#include <glm/gtc/constants.hpp>

#include "lib/base/parallel.hpp"
#include "lib/light/lighting.hpp"
#include "lib/model/texture.hpp"
#include "tests/painted_environment.hpp"

namespace stx {
namespace {

std::shared_ptr<const EnvironmentLight> lightOf(const Environment& environment, float shininess) {
    const auto map = EnvironmentMap::make(environment, Limits());
    if (!map) return nullptr;
    const auto light = EnvironmentLight::make(*map, shininess, Limits());
    return light ? *light : nullptr;
}

glm::dvec3 linearLight(glm::dvec3 direction) {
    const glm::dvec3 c = paintedColour(direction);
    return {linearFromSrgb(static_cast<float>(c.r)), linearFromSrgb(static_cast<float>(c.g)),
            linearFromSrgb(static_cast<float>(c.b))};
}

/// The mean of the light around `about`, weighed by max(0, cosine)^power.
glm::dvec3 meanLight(glm::dvec3 about, double power) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    glm::dvec3 sum(0);
    double weights = 0;
    for (int i = 0; i < 200000; ++i) {
        const glm::dvec3 d =
            glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
        const double cosine = glm::dot(d, about);
        if (cosine <= 0) continue;
        const double w = std::pow(cosine, power);
        sum += linearLight(d) * w;
        weights += w;
    }
    return sum / weights;
}

TEST(EnvironmentLight, LightOfOneColourLeavesThatColour) {
    Environment e;
    for (int f = 0; f < 6; ++f)
        e.pictures.emplace_back(RgbaFloatImage(4, 4, glm::vec4(0.5, 2, 0.25, 1)));
    for (const float shininess : {5.0f, 100.0f, 1000.0f}) {
        const auto light = lightOf(e, shininess);
        ASSERT_TRUE(light);
        for (const glm::vec3 d : {glm::vec3(0, 1, 0), {0.6f, 0, -0.8f}, {-1, 0, 0}}) {
            EXPECT_LT(glm::distance(light->diffuse(d), glm::vec3(0.5, 2, 0.25)), 0.01);
            EXPECT_LT(glm::distance(light->glossy(d), glm::vec3(0.5, 2, 0.25)), 0.01);
        }
    }
}

TEST(EnvironmentLight, IsTheIntegralOfWhatIsAround) {
    for (const Environment& e : {paintedCube(64), paintedAround(256), paintedAround(1024)}) {
        const auto soft = lightOf(e, 10), narrow = lightOf(e, 200);
        ASSERT_TRUE(soft && narrow);
        for (const glm::dvec3 d : {glm::dvec3(0, 1, 0), glm::dvec3(0.6, 0, -0.8),
                                   glm::normalize(glm::dvec3(-1, -2, 1))}) {
            const glm::vec3 n(d);
            EXPECT_LT(glm::distance(glm::dvec3(soft->diffuse(n)), meanLight(d, 1)), 0.01);
            EXPECT_LT(glm::distance(glm::dvec3(soft->glossy(n)), meanLight(d, 10)), 0.01);
            EXPECT_LT(glm::distance(glm::dvec3(narrow->glossy(n)), meanLight(d, 200)), 0.02);
        }
    }
}

/// A picture all around that is black but for one texel; how much light that gives (linear light
/// times steradians), and from where.
struct Sun {
    Environment environment;
    double light = 0;
    glm::dvec3 direction{0.0};
};
Sun sunAt(int width, int column, int row) {
    constexpr float kSun = 20000;
    const int height = width / 2;
    RgbaFloatImage picture(width, height, glm::vec4(0, 0, 0, 1));
    picture.at(column, row) = glm::vec4(kSun, kSun, kSun, 1);
    Sun sun;
    sun.environment.layout = Environment::Layout::equirectangular;
    sun.environment.pictures.emplace_back(std::move(picture));
    const double top = std::cos(glm::pi<double>() * row / height);
    const double bottom = std::cos(glm::pi<double>() * (row + 1) / height);
    sun.light = kSun * glm::two_pi<double>() / width * (top - bottom);
    sun.direction = latlongDirection({(column + 0.5) / width, (row + 0.5) / height});
    return sun;
}

TEST(EnvironmentLight, ASunOfOneTexelGivesWhatItHas) {
    // At the horizon, above it, and down to the row beside a pole; some across the join.
    for (const glm::ivec2 at : {glm::ivec2(597, 256),
                                {227, 142},
                                {1023, 227},
                                {568, 28},
                                {0, 490},
                                {568, 1},
                                {300, 509}}) {
        Sun sun = sunAt(1024, at.x, at.y);
        // As it is, and turned.
        for (const double turn : {0.0, 0.7}) {
            sun.environment.orientation =
                glm::angleAxis(turn, glm::normalize(glm::dvec3(1, 2, -1)));
            const glm::dvec3 from = sun.environment.orientation * sun.direction;
            const glm::dvec3 aside = glm::normalize(glm::cross(
                from, std::abs(from.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0)));
            for (const float shininess : {64.0f, 300.0f}) {
                const auto light = lightOf(sun.environment, shininess);
                ASSERT_TRUE(light);
                // Harmonics of orders 0 to 2 of light from one direction: with Lambert's cosine (1,
                // 2/3 and 1/4) they add up to 1 + 2 cos + 5/4 (3 cos^2 - 1) / 2 over 4 pi.
                const double whole = sun.light / (4 * glm::pi<double>());
                EXPECT_NEAR(light->diffuse(glm::vec3(from)).g / (4.25 * whole), 1, 0.02)
                    << at.x << " " << at.y << " " << turn;
                const glm::dvec3 slanting = 0.5 * from + std::sqrt(0.75) * aside;
                EXPECT_NEAR(light->diffuse(glm::vec3(slanting)).g / (1.84375 * whole), 1, 0.03)
                    << at.x << " " << at.y << " " << turn;
                const double lobe = glm::two_pi<double>() / (shininess + 1);
                EXPECT_NEAR(light->glossy(glm::vec3(from)).g / (sun.light / lobe), 1, 0.1)
                    << at.x << " " << at.y << " " << turn << " " << shininess;
            }
        }
    }
}

TEST(EnvironmentLight, PiecesAreTheWholeSphereOnAnyNumberOfThreads) {
    const Sun sun = sunAt(256, 40, 3);
    const auto map = EnvironmentMap::make(sun.environment, Limits());
    ASSERT_TRUE(map);
    const auto piecesOn = [&](int threads) {
        const ThreadLimit limit(threads);
        return (*map)->pieces(32);
    };
    const auto one = piecesOn(1), three = piecesOn(3);
    ASSERT_EQ(one.size(), 6u * 32 * 32);
    ASSERT_EQ(three.size(), one.size());
    double solidAngle = 0, light = 0;
    for (std::size_t i = 0; i < one.size(); ++i) {
        EXPECT_EQ(one[i].solidAngle, three[i].solidAngle);
        EXPECT_EQ(one[i].light, three[i].light);
        solidAngle += one[i].solidAngle;
        light += one[i].light.g;
    }
    EXPECT_NEAR(solidAngle, 4 * glm::pi<double>(), 1e-4);
    EXPECT_NEAR(light / sun.light, 1, 0.01);
}

TEST(EnvironmentLight, TurnsWithTheEnvironment) {
    Environment e;
    e.skyColours = {{1, 1, 1}, {0, 0, 0}};
    e.skyAngles = {glm::half_pi<double>()};
    e.orientation = glm::angleAxis(glm::half_pi<double>(), glm::dvec3(0, 0, 1));  // up becomes -X
    const auto light = lightOf(e, 10);
    ASSERT_TRUE(light);
    EXPECT_GT(light->diffuse({-1, 0, 0}).r, 3 * light->diffuse({1, 0, 0}).r);
    EXPECT_GT(light->glossy({-1, 0, 0}).r, 10 * light->glossy({1, 0, 0}).r);
}

TEST(EnvironmentLight, ShadesSurfaces) {
    Environment e;
    for (int f = 0; f < 6; ++f)
        e.pictures.emplace_back(RgbaFloatImage(4, 4, glm::vec4(glm::vec3(0.5), 1)));
    Lighting lighting;
    lighting.ambient = glm::vec3(0.0f);
    EXPECT_FALSE(lighting.on());
    lighting.environment = lightOf(e, 20);
    EXPECT_TRUE(lighting.on());
    const glm::vec3 albedo(0.8, 0.4, 0.2), n(0, 0, 1), toEye = glm::normalize(glm::vec3(1, 0, 2));
    EXPECT_LT(glm::distance(shadePhong(lighting, albedo, {}, n, toEye, true), albedo * 0.5f),
              0.005);
    lighting.specular = glm::vec3(0.25f);
    EXPECT_LT(glm::distance(shadePhong(lighting, albedo, {}, n, toEye, true),
                            albedo * 0.5f + glm::vec3(0.125f)),
              0.005);
}

}  // namespace
}  // namespace stx
