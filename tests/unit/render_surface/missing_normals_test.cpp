#include "lib/render/surface/missing_normals.hpp"

#include <gtest/gtest.h>

#include "lib/geometry/depth_code.hpp"

namespace stx::surface {
namespace {

constexpr glm::vec3 kSideways(0.6f, 0.0f, 0.8f), kUpwards(0.0f, 0.6f, 0.8f);

/// Ten rows of ten pixels, one unit apart, at distance 5; the left half has a normal.
Frame halfWithNormals() {
    Frame frame;
    frame.colour = Image<glm::vec4>(10, 10, glm::vec4(1.0f));
    frame.depth = Image<float>(10, 10, 5.0f);
    frame.normal = Image<glm::vec3>(10, 10, glm::vec3(0.0f));
    for (int y = 0; y < 10; ++y)
        for (int x = 0; x < 5; ++x) frame.normal.at(x, y) = kSideways;
    return frame;
}

Camera tenUnitsWide() {
    return Camera::fromFieldOfView({0, 0, 5}, {1, 0, 0, 0}, {10, 10}, true, 10, 10);
}

void expectNormal(const Frame& frame, int x, int y, glm::vec3 normal) {
    EXPECT_LT(glm::length(frame.normal.at(x, y) - normal), 1e-5f) << x << ',' << y;
}

TEST(MissingNormals, AreThoseOfTheSurfaceBesideThem) {
    Frame frame = halfWithNormals();
    borrowNormals(tenUnitsWide(), frame);
    for (int x = 0; x < 7; ++x) expectNormal(frame, x, 4, kSideways);
    for (int x = 7; x < 10; ++x) EXPECT_EQ(frame.normal.at(x, 4), glm::vec3(0.0f)) << x;
}

TEST(MissingNormals, NearOnesComeFirst) {
    Frame frame = halfWithNormals();
    frame.normal.at(6, 4) = kUpwards;
    borrowNormals(tenUnitsWide(), frame);
    expectNormal(frame, 7, 4, kUpwards);
    expectNormal(frame, 8, 4, kUpwards);
    expectNormal(frame, 6, 4, kUpwards);
    expectNormal(frame, 6, 8, kSideways);
}

TEST(MissingNormals, DoNotComeFromAnotherSurface) {
    Frame frame = halfWithNormals();
    for (int y = 0; y < 10; ++y)
        for (int x = 5; x < 10; ++x) frame.depth.at(x, y) = 20.0f;
    borrowNormals(tenUnitsWide(), frame);
    for (int x = 5; x < 10; ++x) EXPECT_EQ(frame.normal.at(x, 4), glm::vec3(0.0f)) << x;
}

TEST(MissingNormals, AreOfCoveredPixelsWithADepth) {
    Frame frame = halfWithNormals();
    frame.depth.at(5, 3) = kNoDepth;
    frame.colour.at(5, 6) = glm::vec4(0.0f);
    borrowNormals(tenUnitsWide(), frame);
    EXPECT_EQ(frame.normal.at(5, 3), glm::vec3(0.0f));
    EXPECT_EQ(frame.normal.at(5, 6), glm::vec3(0.0f));
}

}  // namespace
}  // namespace stx::surface
