#include "lib/sheet/camera_plot.hpp"

#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

#include "lib/geometry/view_layout.hpp"

namespace stx {
namespace {

/// The viewpoints that are drawn, in the order of the file: those from above, then from the side.
std::vector<glm::dvec2> dotsOf(const std::string& svg) {
    std::vector<glm::dvec2> dots;
    for (std::size_t at = 0; (at = svg.find("<circle cx=\"", at)) != std::string::npos; ++at)
        dots.emplace_back(std::atof(svg.c_str() + at + 12),
                          std::atof(svg.c_str() + svg.find("cy=\"", at) + 4));
    return dots;
}

std::vector<PlottedCamera> camerasAt(const std::vector<glm::dvec3>& places) {
    std::vector<PlottedCamera> cameras;
    for (const auto& p : places)
        cameras.push_back({"c", Camera::fromFieldOfView(p, *lookAt(p, glm::dvec3(0)), {0.6, 0.6},
                                                        false, 64, 64)});
    return cameras;
}

Bounds unitBox() {
    Bounds box;
    box.add(glm::dvec3(-0.5));
    box.add(glm::dvec3(0.5));
    return box;
}

TEST(CameraPlot, ShowsPlacesFromAboveAndFromTheSideAtOneScale) {
    const auto cameras = camerasAt({{3, 0, 0}, {-3, 0, 0}, {0, 0, 3}, {0.001, 2, 0}});
    const auto dots = dotsOf(cameraPlot(cameras, unitBox(), "t"));
    ASSERT_EQ(dots.size(), 8u);
    const double scale = (dots[0].x - dots[1].x) / 6;
    EXPECT_GT(scale, 20);
    // From above: +X is right, the front (+Z) is down.
    EXPECT_NEAR(dots[0].y, dots[1].y, 0.11);
    EXPECT_NEAR(dots[2].y - dots[0].y, 3 * scale, 0.11);
    EXPECT_NEAR(dots[3].x, dots[2].x, 0.11 + 0.001 * scale);
    // From the side: +Y is up.
    EXPECT_NEAR(dots[4].x - dots[5].x, 6 * scale, 0.21);
    EXPECT_NEAR(dots[4].y - dots[7].y, 2 * scale, 0.21);
    EXPECT_NEAR(dots[6].y, dots[4].y, 0.11);
}

TEST(CameraPlot, StandsOnTheAxisThatTheCamerasStandOn) {
    std::vector<PlottedCamera> cameras;
    for (const glm::dvec3 p : {glm::dvec3(3, 0, 1), glm::dvec3(0, 3, 1), glm::dvec3(-3, 0, 1)})
        cameras.push_back({"c", Camera::fromFieldOfView(p, *lookAt(p, {0, 0, 1}, {0, 0, 1}),
                                                        {0.6, 0.6}, false, 64, 64)});
    const auto svg = cameraPlot(cameras, {}, "t");
    EXPECT_NE(svg.find(">+Z<"), std::string::npos);
    const auto dots = dotsOf(svg);
    ASSERT_EQ(dots.size(), 6u);
    // All at one height.
    EXPECT_NEAR(dots[3].y, dots[4].y, 0.11);
    EXPECT_NEAR(dots[3].y, dots[5].y, 0.11);
}

TEST(CameraPlot, HasNoNumberOverAnotherAndTextThatIsSafe) {
    auto cameras = camerasAt(std::vector<glm::dvec3>(500, glm::dvec3(3, 1, 0)));
    cameras[0].name = "<b>&\x01\xff";
    const auto svg = cameraPlot(cameras, unitBox(), "a<b");
    EXPECT_EQ(svg.find("<b>"), std::string::npos);
    EXPECT_NE(svg.find("a&lt;b"), std::string::npos);
    EXPECT_EQ(svg.find('\x01'), std::string::npos);
    EXPECT_NE(svg.find(">0</text>"), std::string::npos);
    EXPECT_EQ(svg.find(">1</text>\n<text"), std::string::npos);
    EXPECT_EQ(dotsOf(svg).size(), 1000u);
}

TEST(CameraPlot, TakesOneCameraWithoutAnObject) {
    const auto svg = cameraPlot(camerasAt({{0, 0, 3}}), {}, "one");
    EXPECT_EQ(dotsOf(svg).size(), 2u);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(svg.find("inf"), std::string::npos);
}

}  // namespace
}  // namespace stx
