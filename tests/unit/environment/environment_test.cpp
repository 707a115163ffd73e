// What an environment shows in which direction: faces, edges between them, poles, sky and ground.
#include <random>

#include <gtest/gtest.h>
#include <glm/gtc/constants.hpp>

#include "lib/environment/environment_map.hpp"
#include "lib/model/texture.hpp"
#include "tests/painted_environment.hpp"

namespace stx {
namespace {

std::shared_ptr<const EnvironmentMap> mapOf(const Environment& environment) {
    auto map = EnvironmentMap::make(environment, Limits());
    if (!map) ADD_FAILURE() << map.error().text();
    return map ? *map : nullptr;
}

std::vector<glm::dvec3> manyDirections(int count) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::vector<glm::dvec3> all;
    for (int i = 0; i < count; ++i)
        all.push_back(glm::normalize(glm::dvec3(normal(random), normal(random), normal(random))));
    return all;
}

TEST(EnvironmentMap, ShowsTheRightMarkerInEachDirection) {
    // Each face has a colour of its own, each of its four corners another.
    Environment e;
    for (int f = 0; f < 6; ++f)
        e.pictures.push_back(paintedTexture(8, 8, [f](glm::dvec2 p) {
            return glm::dvec3((f + 1) / 8.0, p.x < 0.5 ? 0.2 : 0.8, p.y < 0.5 ? 0.3 : 0.9);
        }));
    const auto map = mapOf(e);
    for (int f = 0; f < 6; ++f) {
        for (const double u : {0.25, 0.75}) {
            for (const double v : {0.25, 0.75}) {
                const glm::vec3 d(faceDirection(static_cast<CubeFace>(f), {u, v}));
                const glm::vec4 c = map->sample(d, 0, false);
                EXPECT_NEAR(c.r, (f + 1) / 8.0, 0.003);
                EXPECT_NEAR(c.g, u < 0.5 ? 0.2 : 0.8, 0.003);
                EXPECT_NEAR(c.b, v < 0.5 ? 0.3 : 0.9, 0.003);
                EXPECT_EQ(c.a, 1.0f);
            }
        }
    }
}

/// The largest difference from the painted colours over directions.
double worstOf(const EnvironmentMap& map, const std::vector<glm::dvec3>& directions) {
    double worst = 0;
    for (const glm::dvec3& d : directions) {
        const glm::dvec3 off =
            glm::abs(glm::dvec3(map.sample(glm::vec3(d), 0, false)) - paintedColour(d));
        worst = std::max({worst, off.x, off.y, off.z});
    }
    return worst;
}

TEST(EnvironmentMap, HasNoSeamsAndNoPoles) {
    // Right on edges and corners of the cube, and a hair to either side.
    std::vector<glm::dvec3> edges;
    for (int i = 0; i <= 40; ++i) {
        const double t = -1 + i / 20.0;
        for (const double s : {-1.0, 1.0}) {
            for (const double r : {0.999, 1.0, 1.001}) {
                edges.insert(edges.end(), {{s, r, t}, {s, t, r}, {t, s, r}});
                edges.insert(edges.end(), {{s, -r, t}, {s, t, -r}, {t, s, -r}});
            }
        }
    }
    const auto inside = manyDirections(3000);
    const auto cube = mapOf(paintedCube(64));
    EXPECT_LT(worstOf(*cube, inside), 0.006);
    EXPECT_LT(worstOf(*cube, edges), 0.008);
    std::vector<glm::dvec3> poles;
    for (int i = 0; i < 64; ++i) {
        const double a = i * 0.1;
        for (const double r : {0.0, 0.001, 0.01, 0.05})
            for (const double s : {-1.0, 1.0})
                poles.emplace_back(r * std::cos(a), s, r * std::sin(a));
        poles.emplace_back(1e-4 * (i - 32), 0.1 * (i - 32), 1.0);  // across the picture's sides
    }
    const auto around = mapOf(paintedAround(256));
    EXPECT_LT(worstOf(*around, inside), 0.006);
    EXPECT_LT(worstOf(*around, poles), 0.006);
    EXPECT_LT(worstOf(*around, edges), 0.006);
}

TEST(EnvironmentMap, AveragesLightOverWideFootprints) {
    const auto checker = [](int width, int height) {
        Rgba8Image image(width, height);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                image.at(x, y) = glm::u8vec4(glm::u8vec3((x + y) % 2 ? 255 : 0), 255);
        return Texture(std::move(image));
    };
    Environment cube, around;
    for (int f = 0; f < 6; ++f) cube.pictures.push_back(checker(64, 64));
    around.layout = Environment::Layout::equirectangular;
    around.pictures.push_back(checker(256, 128));
    for (const Environment& e : {cube, around}) {
        const auto map = mapOf(e);
        for (const glm::dvec3& d : manyDirections(200)) {
            // Half the light is code 188, not 128.
            EXPECT_NEAR(map->sample(glm::vec3(d), 0.3f, false).r, 188 / 255.0, 0.02);
            EXPECT_NEAR(map->sample(glm::vec3(d), 0.3f, true).r, 0.5, 0.03);
        }
    }
}

TEST(EnvironmentMap, AFootprintOfATexelChangesLittle) {
    const auto map = mapOf(paintedCube(256));
    for (const glm::dvec3& d : manyDirections(500)) {
        const glm::vec4 sharp = map->sample(glm::vec3(d), 0, false);
        const glm::vec4 wide = map->sample(glm::vec3(d), 0.05f, false);
        EXPECT_LT(glm::distance(sharp, wide), 0.02) << d.x << ' ' << d.y << ' ' << d.z;
    }
}

TEST(EnvironmentMap, IsTurned) {
    Environment e = paintedCube(64);
    e.orientation = glm::angleAxis(1.1, glm::normalize(glm::dvec3(1, 2, -0.5)));
    const auto map = mapOf(e);
    for (const glm::dvec3& d : manyDirections(200)) {
        const glm::dvec3 seen(map->sample(glm::vec3(e.orientation * d), 0, false));
        EXPECT_LT(glm::distance(seen, paintedColour(d)), 0.01);
    }
}

TEST(EnvironmentMap, MixesSkyAndGroundBehindThePictures) {
    Environment e;
    e.skyColours = {{0, 0, 1}, {0.5, 0.5, 1}, {1, 1, 1}};
    e.skyAngles = {glm::radians(60.0), glm::radians(90.0)};
    e.groundColours = {{0.2, 0.1, 0}, {0.4, 0.3, 0}};
    e.groundAngles = {glm::radians(45.0)};
    auto map = mapOf(e);
    const auto at = [&](double fromTopDeg) {
        const double a = glm::radians(fromTopDeg);
        return map->sample(glm::vec3(std::sin(a), std::cos(a), 0), 0, false);
    };
    EXPECT_LT(glm::distance(at(0), glm::vec4(0, 0, 1, 1)), 1e-3);
    EXPECT_LT(glm::distance(at(30), glm::vec4(0.25, 0.25, 1, 1)), 1e-3);
    EXPECT_LT(glm::distance(at(75), glm::vec4(0.75, 0.75, 1, 1)), 1e-3);
    EXPECT_LT(glm::distance(at(120), glm::vec4(1, 1, 1, 1)), 1e-3);
    EXPECT_LT(glm::distance(at(180), glm::vec4(0.2, 0.1, 0, 1)), 1e-3);
    EXPECT_LT(glm::distance(at(157.5), glm::vec4(0.3, 0.2, 0, 1)), 1e-3);
    // A picture of half alpha on one side.
    e.pictures.resize(6);
    e.pictures[0] = Rgba8Image(4, 4, glm::u8vec4(255, 0, 0, 128));
    map = mapOf(e);
    const glm::vec4 front = map->sample({0, 0.001f, -1}, 0, false);
    EXPECT_LT(glm::distance(front, glm::vec4(1, 0.5, 0.5, 1)), 0.01);
    EXPECT_LT(glm::distance(map->sample({0, 0.001f, 1}, 0, false), glm::vec4(1, 1, 1, 1)), 0.01);
}

TEST(EnvironmentMap, WithoutSkyPicturesKeepTheirAlpha) {
    Environment e;
    e.pictures.resize(6);
    e.pictures[3] = Rgba8Image(4, 4, glm::u8vec4(200, 100, 0, 255));
    const auto map = mapOf(e);
    EXPECT_EQ(map->sample({1, 0, 0}, 0, false).a, 1.0f);
    EXPECT_EQ(map->sample({-1, 0, 0}, 0, false), glm::vec4(0.0f));
}

TEST(EnvironmentMap, LinearPicturesKeepBrightLight) {
    Environment e;
    e.layout = Environment::Layout::equirectangular;
    e.pictures.push_back(RgbaFloatImage(16, 8, glm::vec4(4, 0.5, 0.1, 1)));
    const auto map = mapOf(e);
    EXPECT_LT(glm::distance(map->sample({1, 1, 1}, 0, true), glm::vec4(4, 0.5, 0.1, 1)), 1e-3);
    EXPECT_NEAR(map->sample({1, 1, 1}, 0, false).r, srgbFromLinear(4.0f), 1e-3);
}

TEST(Environment, RefusesWhatMakesNoSense) {
    const auto errorOf = [](const std::function<void(Environment&)>& change) {
        Environment e = paintedCube(2);
        change(e);
        const auto ok = e.check();
        return ok ? std::string() : ok.error().text();
    };
    EXPECT_EQ(errorOf([](Environment&) {}), "");
    EXPECT_NE(errorOf([](Environment& e) { e.pictures.resize(5); }).find("six faces"),
              std::string::npos);
    EXPECT_NE(errorOf([](Environment& e) { e.pictures.clear(); }).find("no picture"),
              std::string::npos);
    EXPECT_NE(errorOf([](Environment& e) { e.orientation *= 2.0; }).find("not a rotation"),
              std::string::npos);
    EXPECT_NE(errorOf([](Environment& e) { e.skyAngles = {1.0}; }).find("angle"),
              std::string::npos);
    EXPECT_NE(errorOf([](Environment& e) {
                  e.skyColours = {{}, {}, {}};
                  e.skyAngles = {2.0, 1.0};
              }).find("rise"),
              std::string::npos);
    EXPECT_NE(errorOf([](Environment& e) {
                  e.pictures[0] = RgbaFloatImage(2, 2, glm::vec4(1));
              }).find("alike"),
              std::string::npos);
}

double psnr(const Texture& a, const Texture& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.rgba8()->count(); ++i) {
        const glm::dvec3 d(glm::vec3(a.at(i)) - glm::vec3(b.at(i)));
        sum += glm::dot(d, d) / 3;
    }
    return -10 * std::log10(std::max(1e-12, sum / static_cast<double>(a.rgba8()->count())));
}

TEST(Layouts, BecomeEachOther) {
    const Environment around = paintedAround(256), cube = paintedCube(cubeSizeOf(around));
    EXPECT_EQ(cubeSizeOf(around), 82);
    const auto faces = asCube(around, 82, Limits());
    ASSERT_TRUE(faces);
    for (std::size_t f = 0; f < 6; ++f)
        EXPECT_GT(psnr(faces->pictures[f], cube.pictures[f]), 50) << kCubeFaceNames[f];
    const auto back = asEquirectangular(*faces, 256, 128, Limits());
    ASSERT_TRUE(back);
    EXPECT_GT(psnr(back->pictures[0], around.pictures[0]), 50);
    // Far smaller: averaged, not aliased.
    const auto small = asCube(around, 16, Limits());
    ASSERT_TRUE(small);
    EXPECT_GT(psnr(small->pictures[0], paintedCube(16).pictures[0]), 40);
    // What it is already, it stays.
    EXPECT_EQ(*asCube(cube, 82, Limits()), cube);
}

TEST(Layouts, FlattenedEnvironmentsLookTheSame) {
    Environment e = paintedCube(64);
    e.orientation = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 1, 0)));
    e.skyColours = {{0.1, 0.2, 0.9}};
    for (glm::u8vec4& p : e.pictures[4].rgba8()->pixels()) p.a = 128;
    const auto flat = flattened(e, Limits());
    ASSERT_TRUE(flat);
    EXPECT_EQ(flat->orientation, glm::dquat(1, 0, 0, 0));
    EXPECT_TRUE(flat->skyColours.empty());
    const auto before = mapOf(e), after = mapOf(*flat);
    int far = 0;
    for (const glm::dvec3& d : manyDirections(500))
        far += glm::distance(before->sample(glm::vec3(d), 0, false),
                             after->sample(glm::vec3(d), 0, false)) > 0.02;
    EXPECT_LT(far, 20);  // beside the edge of the half-covered face
}

TEST(EnvironmentMap, IsHeldToTheMemoryLimit) {
    Limits limits;
    limits.maxMemoryBytes = 1000;
    const auto map = EnvironmentMap::make(paintedCube(16), limits);
    ASSERT_FALSE(map);
    EXPECT_NE(map.error().text().find("environment"), std::string::npos);
}

}  // namespace
}  // namespace stx
