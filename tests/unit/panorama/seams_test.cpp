#include <gtest/gtest.h>

#include "lib/panorama/footprints.hpp"
#include "tests/unit/panorama/turning_camera.hpp"

namespace stx {
namespace {

/// A sky: colours that change slowly.
PanoramaImage sky() {
    Rgba8Image out(1024, 512);
    for (int y = 0; y < out.height(); ++y)
        for (int x = 0; x < out.width(); ++x) {
            const glm::dvec3 d = PanoramaImage::direction({x + 0.5, y + 0.5}, out.width());
            out.at(x, y) = glm::u8vec4(glm::dvec3(120, 140, 170) + 20.0 * d + 0.5, 255);
        }
    return PanoramaImage{std::move(out)};
}

/// A lens that is darker in the corners of its pictures, as most are.
class DarkCorners final : public PictureSource {
  public:
    explicit DarkCorners(TurningCamera& camera) : camera_(camera) {}
    [[nodiscard]] int count() const override { return camera_.count(); }
    [[nodiscard]] std::string name(int k) const override { return camera_.name(k); }
    [[nodiscard]] double focalHint(int) const override { return 0; }
    [[nodiscard]] Result<Rgba8Image> picture(int k) override {
        STX_TRY(auto picture, camera_.picture(k));
        const glm::vec2 middle = 0.5f * glm::vec2(picture.size());
        for (int y = 0; y < picture.height(); ++y)
            for (int x = 0; x < picture.width(); ++x) {
                const glm::vec2 p = (glm::vec2(x, y) + 0.5f - middle) / glm::length(middle);
                const float light = 1 - 0.4f * glm::dot(p, p) * glm::dot(p, p);
                glm::u8vec4& c = picture.at(x, y);
                for (int i = 0; i < 3; ++i)
                    c[i] = static_cast<std::uint8_t>(
                        255 * srgbByTable(linearByTable(c[i] / 255.0f) * light) + 0.5f);
            }
        return picture;
    }

  private:
    TurningCamera& camera_;
};

/// The largest step of a channel between two pixels that are `apart`, away from the outer edges.
int largestStep(const Rgba8Image& picture, int apart) {
    int largest = 0;
    for (int y = picture.height() * 2 / 5; y < picture.height() * 3 / 5; ++y)
        for (int x = picture.width() * 21 / 100; x < picture.width() * 55 / 100; ++x) {
            const glm::u8vec4 a = picture.at(x, y), b = picture.at(x + apart, y);
            for (int i = 0; i < 3 && a.a == 255 && b.a == 255; ++i)
                largest = std::max(largest, std::abs(int{a[i]} - int{b[i]}));
        }
    return largest;
}

/// What is known of a camera's pictures, but for their light.
PanoramaAlignment alignmentOf(const TurningCamera& camera) {
    PanoramaAlignment known;
    known.focal = camera.lens.focal;
    known.k1 = camera.lens.k1;
    for (const glm::dquat& turn : camera.worldFromCamera) {
        PanoramaCamera one;
        one.used = true;
        one.worldFromCamera = turn;
        one.size = camera.size;
        one.focal = known.focal * 0.5 * glm::length(glm::dvec2(camera.size));
        known.cameras.push_back(one);
    }
    return known;
}

TEST(ComposePanorama, ShowsNoSeamsInASky) {
    const PanoramaImage sphere = sky();
    TurningCamera camera;
    camera.sphere = &sphere;
    for (int k = 0; k < 4; ++k) camera.add(0.5 * k, 0.02 * k, 0);
    PanoramaAlignment known = alignmentOf(camera);
    DarkCorners source(camera);
    Job job;
    const auto made = composePanorama(source, known, {.width = 2048}, job);
    ASSERT_TRUE(made) << made.error().text();
    // At the outer edges one picture's own darkness changes by a code in two pixels.
    EXPECT_LE(largestStep(made->pixels, 1), 2);
    EXPECT_LE(largestStep(made->pixels, 8), 6);
}

/// PSNR of a panorama against the sphere, after one gain of linear light; where it covers it.
double psnrAfterGain(const PanoramaImage& made, const PanoramaImage& sphere) {
    std::vector<std::pair<glm::vec3, glm::vec3>> both;
    glm::dvec2 sums(0);
    for (int y = 0; y < made.height(); ++y)
        for (int x = 0; x < made.width(); ++x) {
            const glm::u8vec4 p = made.pixels.at(x, y);
            if (p.a < 255) continue;
            const glm::vec3 truth(
                sphere.sample(PanoramaImage::direction({x + 0.5, y + 0.5}, made.width())));
            both.emplace_back(glm::vec3(p) / 255.0f, truth);
            for (int c = 0; c < 3; ++c) {
                const double a = linearByTable(both.back().first[c]), b = linearByTable(truth[c]);
                sums += glm::dvec2(a * b, a * a);
            }
        }
    const auto gain = static_cast<float>(sums.x / sums.y);
    double squares = 0;
    for (const auto& [a, b] : both)
        for (int c = 0; c < 3; ++c)
            squares +=
                std::pow(255 * (srgbByTable(std::min(1.0f, gain * linearByTable(a[c]))) - b[c]), 2);
    return 10 * std::log10(255 * 255 * 3 * static_cast<double>(both.size()) / squares);
}

/// Pictures of which parts were cut out: the upper eighth of each, and of one all below its middle.
class CutOut final : public PictureSource {
  public:
    CutOut(TurningCamera& camera, int half) : camera_(camera), half_(half) {}
    [[nodiscard]] int count() const override { return camera_.count(); }
    [[nodiscard]] std::string name(int k) const override { return camera_.name(k); }
    [[nodiscard]] double focalHint(int) const override { return 0; }
    [[nodiscard]] Result<Rgba8Image> picture(int k) override {
        STX_TRY(auto picture, camera_.picture(k));
        for (int y = 0; y < picture.height(); ++y)
            if (y < picture.height() / 8 || (k == half_ && y >= picture.height() / 2))
                for (glm::u8vec4& p : picture.row(y)) p = glm::u8vec4(255, 0, 255, 0);
        return shownOrNot(std::move(picture));
    }

  private:
    TurningCamera& camera_;
    int half_;
};

TEST(ComposePanorama, TransparentPixelsShowNothing) {
    const PanoramaImage sphere{texturedSphere(1024)};
    TurningCamera camera;
    camera.sphere = &sphere;
    for (int k = 0; k < 3; ++k) camera.add(0.25 * k, 0, 0);
    PanoramaAlignment known = alignmentOf(camera);
    CutOut source(camera, 1);
    Job job;
    for (const int width : {512, 2048}) {
        const auto made = composePanorama(source, known, {.width = width}, job);
        ASSERT_TRUE(made) << made.error().text();
        EXPECT_GT(psnrAfterGain(*made, sphere), 30);
        // Straight below the middle's middle the others see; above no picture shows anything.
        const auto alphaAt = [&](double yaw, double pitch) {
            const glm::dvec3 ahead = glm::angleAxis(yaw, glm::dvec3(0, 1, 0)) *
                                     glm::angleAxis(pitch, glm::dvec3(1, 0, 0)) *
                                     glm::dvec3(0, 0, -1);
            const glm::dvec2 at = PanoramaImage::position(ahead, width);
            return int{made->pixels.at(static_cast<int>(at.x), static_cast<int>(at.y)).a};
        };
        EXPECT_EQ(alphaAt(0.25, -0.2), 255);
        EXPECT_EQ(alphaAt(0.25, 0.2), 255);
        EXPECT_EQ(alphaAt(0.25, 0.33), 0);
    }
}

TEST(ComposePanorama, WhatIsTooBrightIsShownByThePictureThatHasIt) {
    const PanoramaImage sphere{texturedSphere(1024)};
    TurningCamera camera;
    camera.sphere = &sphere;
    camera.gains = {1, 2.5f, 1};
    for (int k = 0; k < 3; ++k) camera.add(0.25 * k, 0, 0);
    PanoramaAlignment known = alignmentOf(camera);
    Job job;
    const auto made = composePanorama(camera, known, {.width = 1024}, job);
    ASSERT_TRUE(made) << made.error().text();
    EXPECT_GT(psnrAfterGain(*made, sphere), 31.5);
}

TurningCamera discsInARow(const PanoramaImage& sphere) {
    TurningCamera camera;
    camera.sphere = &sphere;
    camera.gains = {1, 0.8f, 0.9f, 0.75f, 1};
    for (int k = 0; k < 5; ++k) camera.add(0.35 * k, 0.03 * (k % 2), 0);
    return camera;
}

TEST(FindVignetting, FindsAndClearsIt) {
    const PanoramaImage sphere{texturedSphere(2048)};
    TurningCamera camera = discsInARow(sphere);
    camera.vignetting = {-0.25, -0.35};
    auto known = alignmentOf(camera);
    Job job;
    const auto made = composePanorama(camera, known, {.width = 1024}, job);
    ASSERT_TRUE(made) << made.error().text();
    for (const double r : {0.5, 0.7, 0.9}) {
        const double r2 = r * r;
        EXPECT_NEAR(known.vignetting.clearing(r2) / camera.vignetting.clearing(r2), 1, 0.02) << r;
    }
    EXPECT_GT(psnrAfterGain(*made, sphere), 35);
    for (std::size_t k = 1; k < 5; ++k)
        EXPECT_NEAR(known.cameras[k].gain.g / known.cameras[0].gain.g,
                    camera.gains[0] / camera.gains[k], 0.02);
}

TEST(FindVignetting, LeavesPicturesWithoutIt) {
    const PanoramaImage sphere{texturedSphere(2048)};
    TurningCamera camera = discsInARow(sphere);
    auto known = alignmentOf(camera);
    Job job;
    ASSERT_TRUE(composePanorama(camera, known, {.width = 1024}, job));
    EXPECT_TRUE(known.vignetting.none());
}

/// A picture that sees columns [x, x + 160) of the grid, darker towards its sides.
panorama::Footprint darkSided(int picture, int x) {
    panorama::Footprint f;
    f.picture = picture;
    f.box = {x, 70, 160, 120};
    f.colour = Image<glm::vec3>(160, 120, glm::vec3(0));
    f.inside = Image<float>(160, 120, 0.0f);
    f.whole = Image<std::uint8_t>(160, 120, 1);
    for (int row = 0; row < 120; ++row)
        for (int column = 0; column < 160; ++column) {
            const float side = std::abs(static_cast<float>(column) - 79.5f) / 80;
            // Details that both see: stripes.
            const float stripes = (x + column) % 6 < 3 ? 0.2f : 0.4f;
            f.colour.at(column, row) = glm::vec3(stripes * (1 - 0.4f * side * side * side * side));
            f.inside.at(column, row) =
                static_cast<float>(std::min({column + 1, 160 - column, row + 1, 120 - row})) / 60;
        }
    return f;
}

TEST(Cleared, KeepsTheShadesOfWhatIsBright) {
    for (const float clearing : {1.1f, 1.3f}) {
        EXPECT_NEAR(panorama::cleared(glm::vec3(0.2f), clearing).r, 0.2f * clearing, 1e-3f);
        EXPECT_EQ(panorama::cleared(glm::vec3(1.0f), clearing).r, 1.0f);
        float last = 0;
        for (int i = 1; i <= 100; ++i) {
            const float c = panorama::cleared(glm::vec3(0.01f * static_cast<float>(i)), clearing).r;
            EXPECT_GT(c, last) << i;
            EXPECT_NEAR(panorama::uncleared(glm::vec3(c), clearing).r,
                        0.01f * static_cast<float>(i), 1e-3f);
            last = c;
        }
    }
}

TEST(FindCorrections, BringsPicturesToTheSameLightAtASeamNearAnEdge) {
    const std::vector<panorama::Footprint> prints = {darkSided(0, 0), darkSided(1, 90)};
    constexpr int kSeam = 152;  // eight cells before the first one ends
    Image<int> labels(512, 256, -1);
    for (int y = 70; y < 190; ++y)
        for (int x = 0; x < 250; ++x) labels.at(x, y) = x < kSeam ? 0 : 1;
    const auto corrections =
        panorama::findCorrections(prints, {glm::dvec3(1), glm::dvec3(1)}, labels);
    ASSERT_EQ(corrections.size(), 2u);
    const auto lightOf = [&](std::size_t k, int x, int y) {
        const int column = x - prints[k].box.x, row = y - prints[k].box.y;
        return prints[k].colour.at(column, row).g * corrections[k].at(column, row).g;
    };
    for (int y = 90; y < 170; ++y) {
        // A third before.
        EXPECT_GT(prints[1].colour.at(kSeam - 90, y - 70).g / prints[0].colour.at(kSeam, y - 70).g,
                  1.3f);
        EXPECT_NEAR(lightOf(1, kSeam, y) / lightOf(0, kSeam, y), 1, 0.03) << y;
    }
    // What only one of them sees stays as it is.
    EXPECT_NEAR(corrections[0].at(40, 60).g, 1, 0.01);
    EXPECT_NEAR(corrections[1].at(140, 60).g, 1, 0.01);
}

}  // namespace
}  // namespace stx
