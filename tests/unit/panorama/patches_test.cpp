// Patches of two pictures, moved onto each other.

#include "lib/panorama/patches.hpp"

#include <gtest/gtest.h>

#include "tests/unit/panorama/turning_camera.hpp"

namespace stx::panorama {

TEST(PicturePatches, AreMovedToATwentiethOfAPixel) {
    const PanoramaImage sphere{texturedSphere(1024)};
    TurningCamera camera;
    camera.sphere = &sphere;
    camera.size = {320, 240};
    camera.lens = {1.0, 0};
    camera.add(0, 0, 0);
    camera.add(0.3, 0.05, 0.1);
    camera.gains = {1.0f, 0.7f};  // the light does not matter
    std::vector<WorkCopy> copies;
    std::vector<Pyramid> pyramids;
    std::vector<Features> features;
    for (int k = 0; k < 2; ++k) {
        copies.push_back(makeWorkCopy(*camera.picture(k), 1000));
        pyramids.push_back(pyramidOf(copies.back().grey));
        features.push_back(findFeatures(copies.back(), 800));
    }
    TurnModel truth;
    truth.worldFromCamera = camera.worldFromCamera;
    truth.known = {true, true};
    truth.lens = camera.lens;
    // What is known so far is three pixels off.
    TurnModel model = truth;
    const double pixel = 1 / copies[0].halfDiagonal();
    model.worldFromCamera[1] =
        model.worldFromCamera[1] * glm::angleAxis(3 * pixel, glm::dvec3(0.6, 0.8, 0));
    const auto matches = alignPatches(copies, pyramids, features, model, 0, 1, {});
    ASSERT_GT(matches.size(), 60u);
    Pair pair;
    pair.a = 0;
    pair.b = 1;
    std::vector<double> off;
    for (const Match& match : matches) off.push_back(differenceOf(truth, pair, match, pixel));
    std::sort(off.begin(), off.end());
    EXPECT_LT(off[off.size() / 2], 0.05);
    EXPECT_LT(off[off.size() * 9 / 10], 0.2);
    // What the model may be wrong by is a limit.
    PatchSettings strict;
    strict.reach = 1;
    EXPECT_LT(alignPatches(copies, pyramids, features, model, 0, 1, strict).size(),
              matches.size() / 10);
}

// What is wrong here an address sanitizer sees: patches that a wide lens bends reached out of the
// picture by some pixels.
TEST(PicturePatches, StayInPicturesOfAWideLens) {
    const PanoramaImage sphere{texturedSphere(512)};
    TurningCamera camera;
    camera.sphere = &sphere;
    camera.size = {128, 128};
    constexpr double kDegrees = M_PI / 180;
    camera.lens = {std::sqrt(0.5) / std::tan(75 * kDegrees), 0};  // 150 degrees
    for (int k = 0; k < 3; ++k) camera.add(14 * kDegrees * k, 8 * kDegrees * k, 0);
    std::vector<WorkCopy> copies;
    std::vector<Pyramid> pyramids;
    std::vector<Features> features(3);
    for (int k = 0; k < 3; ++k) {
        copies.push_back(makeWorkCopy(*camera.picture(k), 1000));
        pyramids.push_back(pyramidOf(copies.back().grey));
        // Everywhere, so that some are where it matters.
        for (int y = 2; y < 128; y += 4)
            for (int x = 2; x < 128; x += 4)
                features[static_cast<std::size_t>(k)].points.push_back({.pixel = {x, y}});
    }
    TurnModel model;
    model.worldFromCamera = camera.worldFromCamera;
    model.known = {true, true, true};
    model.lens = camera.lens;
    PatchSettings settings;
    settings.most = 10000;  // all that there are
    for (int a = 0; a < 3; ++a)
        for (int b = a + 1; b < 3; ++b)
            for (const Match& m : alignPatches(copies, pyramids, features, model, a, b, settings))
                for (const glm::dvec2 p : {m.a, m.b})
                    EXPECT_LT(std::max(std::abs(p.x), std::abs(p.y)), std::sqrt(0.5));
}

}  // namespace stx::panorama
