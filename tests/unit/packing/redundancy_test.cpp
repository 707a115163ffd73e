// Whether another view shows a pixel, too: two views of one wall.

#include "lib/packing/redundancy.hpp"

#include <gtest/gtest.h>

namespace stx {
namespace {

constexpr int kSide = 64;
constexpr double kDistance = 4;

/// The wall z = 0 seen straight from z = kDistance, `x` beside the axis; red grows along the wall.
ReferenceView wallFrom(double x, int side = kSide, double fov = 0.8) {
    ReferenceView view;
    view.camera = Camera::fromFieldOfView({x, 0, kDistance}, {1, 0, 0, 0}, glm::dvec2(fov), false,
                                          side, side);
    view.nearPlane = 1;
    view.farPlane = 10;
    view.depthBits = 32;
    view.depth = Image<float>(side, side, static_cast<float>(kDistance));
    Rgba8Image colour(side, side);
    for (int row = 0; row < side; ++row)
        for (int column = 0; column < side; ++column) {
            const double red = 127 + 40 * view.worldPoint(column, row).x;
            colour.at(column, row) =
                glm::u8vec4(static_cast<std::uint8_t>(std::clamp(red, 0.0, 255.0)), 90, 90, 255);
        }
    view.texture = std::move(colour);
    return view;
}

std::vector<PruneView> prepared(const Bundle& bundle, const std::vector<int>& rank) {
    std::vector<PruneView> views;
    for (const auto& view : bundle.views) views.push_back(preparePruning(view));
    findPartners(views, rank);
    return views;
}

Replacement findIn(const std::vector<PruneView>& views, std::size_t to, glm::ivec2 at) {
    return findReplacement(views[0], PrunePixel(views[0], at.x, at.y), views[to], {});
}

}  // namespace

TEST(Redundancy, APixelKnowsItsPlaceNormalAndRate) {
    Bundle bundle;
    bundle.views = {wallFrom(0.2)};
    const auto views = prepared(bundle, {0});
    const PrunePixel pixel(views[0], 10, 50);
    EXPECT_LT(glm::distance(pixel.world, bundle.views[0].worldPoint(10, 50)), 1e-5);
    EXPECT_LT(glm::distance(pixel.normal, glm::dvec3(0, 0, 1)), 1e-5);
    // A pixel is 2 tan(0.4) 4 / 64 wide on the wall.
    const double side = 2 * std::tan(0.4) * kDistance / kSide;
    EXPECT_NEAR(pixel.rate * side * side, 1, 1e-4);
}

TEST(Redundancy, PartnersAreViewsOfTheSamePlaceInTheOrderOfRank) {
    Bundle bundle;
    // The third looks the other way, the fourth is far beside, the fifth is remembered background.
    bundle.views = {wallFrom(0),  wallFrom(0.5), wallFrom(0),
                    wallFrom(50), wallFrom(0.1), wallFrom(-0.5)};
    bundle.views[2].camera.orientation = glm::angleAxis(M_PI, glm::dvec3(0, 1, 0));
    bundle.views[4].background = true;
    const auto views = prepared(bundle, {5, 4, 3, 2, 1, 0});
    EXPECT_EQ(views[0].partners, (std::vector{5, 1}));
    EXPECT_EQ(views[1].partners, (std::vector{5, 0}));
    EXPECT_TRUE(views[2].partners.empty());
    EXPECT_TRUE(views[3].partners.empty());
    EXPECT_TRUE(views[4].partners.empty());
}

TEST(Redundancy, ThePlaceInAnotherViewIsWhereThePointProjects) {
    Bundle bundle;
    bundle.views = {wallFrom(0), wallFrom(0.3)};
    const auto views = prepared(bundle, {0, 1});
    // 0.3 along the wall is so many pixels.
    const double shift = 0.3 / (2 * std::tan(0.4) * kDistance / kSide);
    const Replacement found = findIn(views, 1, {40, 20});
    ASSERT_TRUE(found.found);
    EXPECT_EQ(found.x, static_cast<int>(std::floor(40 - shift)));
    EXPECT_EQ(found.y, 20);
    EXPECT_LT(found.error, 1e-4);
    EXPECT_FALSE(findIn(views, 1, {2, 20}).found) << "outside the other frame";
}

TEST(Redundancy, OneOfFourPixelsThatIsGoneIsEnough) {
    Bundle bundle;
    bundle.views = {wallFrom(0), wallFrom(0.3)};
    auto views = prepared(bundle, {0, 1});
    const Replacement found = findIn(views, 1, {40, 20});
    ASSERT_TRUE(found.found);
    views[1].kept.at(found.x + 1, found.y) = 0;
    EXPECT_FALSE(findIn(views, 1, {40, 20}).found);
}

TEST(Redundancy, CoarserFartherAndOtherColouredPixelsDoNotReplace) {
    Bundle bundle;
    bundle.views = {wallFrom(0), wallFrom(0.3, kSide / 2), wallFrom(0.3), wallFrom(0.3),
                    wallFrom(0.3, 2 * kSide)};
    // A surface one percent behind the wall is another one.
    bundle.views[2].depth = Image<float>(kSide, kSide, static_cast<float>(1.01 * kDistance));
    for (auto& pixel : bundle.views[3].texture.rgba8()->pixels()) pixel.b += 40;
    const auto views = prepared(bundle, {0, 1, 2, 3, 4});
    EXPECT_FALSE(findIn(views, 1, {40, 20}).found) << "half as many samples";
    EXPECT_FALSE(findIn(views, 2, {40, 20}).found) << "another depth";
    EXPECT_FALSE(findIn(views, 3, {40, 20}).found) << "another colour";
    EXPECT_TRUE(findIn(views, 4, {40, 20}).found) << "twice as many samples";
}

}  // namespace stx
