// Directions of positions in pictures all around: faces of a cube, and latlong.
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "lib/geometry/directions.hpp"

namespace stx {
namespace {

std::vector<glm::dvec3> manyDirections(int count) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::vector<glm::dvec3> all;
    for (int i = 0; i < count; ++i)
        all.push_back(glm::normalize(glm::dvec3(normal(random), normal(random), normal(random))));
    return all;
}

TEST(CubeFaces, AreTurnedAsVrml97Says) {
    // The top is seen looking along +Y with +Z up, the bottom looking along -Y with -Z up; so +X is
    // to the right on both, as on the front.
    struct Expected {
        CubeFace face;
        glm::dvec3 middle, right, up;
    };
    for (const auto& [face, middle, right, up] :
         {Expected{CubeFace::front, {0, 0, -1}, {1, 0, 0}, {0, 1, 0}},
          Expected{CubeFace::back, {0, 0, 1}, {-1, 0, 0}, {0, 1, 0}},
          Expected{CubeFace::left, {-1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
          Expected{CubeFace::right, {1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
          Expected{CubeFace::top, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}},
          Expected{CubeFace::bottom, {0, -1, 0}, {1, 0, 0}, {0, 0, -1}}}) {
        SCOPED_TRACE(kCubeFaceNames[static_cast<std::size_t>(face)]);
        EXPECT_EQ(faceDirection(face, {0.5, 0.5}), middle);
        EXPECT_EQ(faceDirection(face, {1.0, 0.5}), middle + right);
        EXPECT_EQ(faceDirection(face, {0.5, 0.0}), middle + up);
        // Seen from inside: right, up and towards the viewer are right-handed.
        EXPECT_EQ(glm::cross(right, up), -middle);
    }
}

TEST(CubeFaces, PositionsAreTheInverse) {
    for (int f = 0; f < 6; ++f) {
        for (const glm::dvec2 p : {glm::dvec2(0.5, 0.5), {0.01, 0.3}, {0.99, 0.02}, {0.7, 0.98}}) {
            const auto at = facePosition(3.0 * faceDirection(static_cast<CubeFace>(f), p));
            EXPECT_EQ(static_cast<int>(at.face), f);
            EXPECT_NEAR(at.position.x, p.x, 1e-12);
            EXPECT_NEAR(at.position.y, p.y, 1e-12);
        }
    }
}

TEST(Latlong, MinusZIsInTheMiddleAndXToItsRight) {
    EXPECT_LT(glm::distance(latlongDirection({0.5, 0.5}), {0, 0, -1}), 1e-12);
    EXPECT_LT(glm::distance(latlongDirection({0.75, 0.5}), {1, 0, 0}), 1e-12);
    EXPECT_LT(glm::distance(latlongDirection({0.25, 0.5}), {-1, 0, 0}), 1e-12);
    EXPECT_LT(glm::distance(latlongDirection({0.3, 0.0}), {0, 1, 0}), 1e-12);
    for (const glm::dvec3& d : manyDirections(100))
        EXPECT_LT(glm::distance(latlongDirection(latlongPosition(d)), d), 1e-12);
}

}  // namespace
}  // namespace stx
