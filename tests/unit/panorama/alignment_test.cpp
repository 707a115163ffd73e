#include <gtest/gtest.h>

#include "formats/images/images.hpp"
#include "lib/base/parallel.hpp"
#include "lib/metrics/compare.hpp"
#include "lib/model/srgb8.hpp"
#include "tests/shared_data.hpp"
#include "tests/unit/panorama/turning_camera.hpp"

namespace stx {
namespace {

constexpr double kDegree = M_PI / 180;

const PanoramaImage& discs() {
    static const PanoramaImage sphere{texturedSphere(2048)};
    return sphere;
}

/// The largest angle between found and true rotations, degrees, once the world is turned as one.
double rotationError(const TurningCamera& camera, const PanoramaAlignment& found) {
    // The turn between the two worlds, by all pictures together.
    glm::dquat sum(0, 0, 0, 0);
    for (std::size_t k = 0; k < found.cameras.size(); ++k) {
        if (!found.cameras[k].used) continue;
        glm::dquat d = camera.worldFromCamera[k] * glm::inverse(found.cameras[k].worldFromCamera);
        if (glm::dot(d, sum) < 0) d = -d;
        sum = sum + d;
    }
    const glm::dquat turn = glm::normalize(sum);
    double worst = 0;
    for (std::size_t k = 0; k < found.cameras.size(); ++k)
        if (found.cameras[k].used)
            worst =
                std::max(worst, panorama::angleBetween(camera.worldFromCamera[k],
                                                       turn * found.cameras[k].worldFromCamera));
    return worst / kDegree;
}

PanoramaAlignment mustAlign(TurningCamera& camera, PanoramaSettings settings = {}) {
    Job job;
    auto found = alignPanorama(camera, settings, job);
    EXPECT_TRUE(found) << found.error().text();
    return found ? std::move(*found) : PanoramaAlignment{};
}

/// Checks what was found against what is known.
void expectFound(const TurningCamera& camera, const PanoramaAlignment& found) {
    ASSERT_EQ(found.used(), camera.count());
    EXPECT_LT(rotationError(camera, found), 0.02);
    EXPECT_NEAR(found.focal / camera.lens.focal, 1, 1e-3);
    EXPECT_LT(found.rms, 0.6);
}

/// PSNR over the directions that the panorama covers, with the world turned onto the true one.
double psnrOfPanorama(const TurningCamera& camera, PanoramaAlignment found, int width) {
    // Into the true world: pixels then lie where the original's do.
    const std::size_t first = 0;
    const glm::dquat turn =
        camera.worldFromCamera[first] * glm::inverse(found.cameras[first].worldFromCamera);
    for (auto& c : found.cameras) c.worldFromCamera = turn * c.worldFromCamera;
    auto& source = const_cast<TurningCamera&>(camera);
    Job job;
    ComposeSettings settings;
    settings.width = width;
    const auto made = composePanorama(source, found, settings, job);
    EXPECT_TRUE(made) << made.error().text();
    if (!made) return 0;
    double sum = 0;
    std::size_t count = 0;
    for (int y = 0; y < made->height(); ++y)
        for (int x = 0; x < made->width(); ++x) {
            const glm::u8vec4 p = made->pixels.at(x, y);
            if (p.a < 255) continue;
            const glm::vec3 truth =
                255.0f * glm::vec3(camera.sphere->sample(
                             PanoramaImage::direction({x + 0.5, y + 0.5}, made->width())));
            const glm::vec3 d = truth - glm::vec3(p);
            sum += glm::dot(d, d) / 3;
            ++count;
        }
    EXPECT_GT(count, std::size_t{1000});
    return 10 * std::log10(255 * 255 / (sum / static_cast<double>(count)));
}

TurningCamera partOfATurn() {
    TurningCamera camera;
    camera.sphere = &discs();
    camera.lens = {1.6, 0.05 * 1.6 * 1.6};
    for (int k = 0; k < 6; ++k)
        camera.add(18 * kDegree * k, (k % 3 - 1) * 4 * kDegree, (k % 2) * 3 * kDegree);
    return camera;
}

TEST(AlignPanorama, FindsRotationsFocalLengthAndDistortion) {
    auto camera = partOfATurn();
    const auto found = mustAlign(camera);
    expectFound(camera, found);
    EXPECT_NEAR(found.k1, camera.lens.k1, 0.01);
    EXPECT_FALSE(found.closed);
    EXPECT_GT(psnrOfPanorama(camera, found, 2048), 35);
}

TEST(AlignPanorama, AGivenFieldOfViewThatAClosedTurnContradictsIsNoted) {
    TurningCamera camera;
    camera.sphere = &discs();
    camera.size = {240, 320};
    camera.lens = {2.0, -0.04 * 4};
    for (int k = 0; k < 16; ++k) camera.add(22.5 * kDegree * k, 3 * kDegree, 0);
    const double right = 2 * std::atan(0.6 / camera.lens.focal);
    const auto notesWith = [&](double fieldOfView, bool closeLoop = true) {
        PanoramaSettings settings;
        settings.fieldOfView = fieldOfView;
        settings.closeLoop = closeLoop;
        Job job;
        EXPECT_TRUE(alignPanorama(camera, settings, job));
        std::string all;
        for (const auto& note : job.takeNotes()) all += note + "\n";
        return all;
    };
    EXPECT_EQ(notesWith(right).find("field of view of"), std::string::npos) << notesWith(right);
    for (const double wrong : {0.85 * right, 0.97 * right, 1.03 * right, 1.15 * right}) {
        const std::string notes = notesWith(wrong);
        EXPECT_NE(notes.find(fmt::format("{:.1f}° is given, but the pictures close a full turn at "
                                         "{:.1f}°",
                                         wrong / kDegree, right / kDegree)),
                  std::string::npos)
            << notes;
    }
    EXPECT_EQ(notesWith(1.15 * right, false).find("full turn"), std::string::npos);
    // Part of a turn tells nothing.
    camera.worldFromCamera.resize(6);
    EXPECT_EQ(notesWith(1.15 * right).find("full turn"), std::string::npos);
}

TEST(AlignPanorama, ClosesATurnOfPortraits) {
    TurningCamera camera;
    camera.sphere = &discs();
    camera.size = {240, 320};
    camera.lens = {2.0, -0.04 * 4};
    // In no order.
    for (int k = 0; k < 16; ++k) camera.add(22.5 * kDegree * (k * 7 % 16), 3 * kDegree, 0);
    const auto found = mustAlign(camera);
    expectFound(camera, found);
    EXPECT_TRUE(found.closed);
    EXPECT_LT(found.gapAfter, 0.1 * kDegree);
    // Level: all look up by as much.
    for (const auto& c : found.cameras)
        EXPECT_NEAR((c.worldFromCamera * glm::dvec3(0, 0, -1)).y, std::sin(3 * kDegree), 5e-4);
    EXPECT_GT(psnrOfPanorama(camera, found, 2048), 35);
}

TEST(AlignPanorama, ALoopThatStaysOpenEndsWithItsLastPicture) {
    TurningCamera camera;
    camera.sphere = &discs();
    camera.size = {240, 320};
    camera.lens = {2.0, -0.04 * 4};
    // From the last to the first it is 15 degrees: they have the most in common.
    for (int k = 0; k < 16; ++k) camera.add(23 * kDegree * k, 3 * kDegree, 0);
    PanoramaSettings settings;
    settings.closeLoop = false;
    const auto found = mustAlign(camera, settings);
    ASSERT_EQ(found.used(), 16);
    EXPECT_FALSE(found.closed);
    ASSERT_EQ(found.pairs.size(), 15u);
    for (const PanoramaPair& pair : found.pairs) EXPECT_EQ(pair.b, pair.a + 1);
}

TEST(AlignPanorama, TakesCamerasThatAreRolled) {
    TurningCamera camera;
    camera.sphere = &discs();
    const double rolls[] = {0, 90, 45, -45};
    for (int k = 0; k < 4; ++k) camera.add(8 * kDegree * k, 2 * kDegree * k, rolls[k] * kDegree);
    const auto found = mustAlign(camera);
    ASSERT_EQ(found.used(), 4);
    EXPECT_LT(rotationError(camera, found), 0.03);
    EXPECT_NEAR(found.focal / camera.lens.focal, 1, 3e-3);
    // The axis around which a camera only rolled is not up: the first one's top is.
    EXPECT_GT((found.cameras[0].worldFromCamera * glm::dvec3(0, 1, 0)).y, 0.995);
    for (const auto& c : found.cameras)
        EXPECT_LT(std::abs((c.worldFromCamera * glm::dvec3(0, 0, -1)).y), 0.2);
}

TEST(AlignPanorama, FindsGains) {
    auto camera = partOfATurn();
    camera.gains = {1, 0.7f, 0.8f, 0.6f, 1, 0.9f};
    auto found = mustAlign(camera);
    ASSERT_EQ(found.used(), 6);
    EXPECT_LT(rotationError(camera, found), 0.02);
    Job job;
    ASSERT_TRUE(composePanorama(camera, found, {}, job));
    for (std::size_t k = 1; k < 6; ++k)
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(found.cameras[k].gain[c] / found.cameras[0].gain[c],
                        camera.gains[0] / camera.gains[k], 0.02);
}

TEST(AlignPanorama, FindsFocalLengthsOfACameraThatFocusedAnew) {
    auto camera = partOfATurn();
    camera.stretch = {1, 1, 1.002, 0.998, 0.985, 0.986};
    const auto found = mustAlign(camera);
    ASSERT_EQ(found.used(), 6);
    EXPECT_LT(rotationError(camera, found), 0.03);
    EXPECT_LT(found.rms, 0.1);
    for (std::size_t k = 1; k < 6; ++k)
        EXPECT_NEAR(found.cameras[k].focal / found.cameras[0].focal, camera.stretch[k], 1e-3) << k;
    EXPECT_GT(psnrOfPanorama(camera, found, 1024), 35);
    // One that did not has one.
    camera.stretch.clear();
    const auto one = mustAlign(camera);
    for (const auto& c : one.cameras) EXPECT_EQ(c.focal, one.cameras[0].focal);
}

TEST(AlignPanorama, IsTheSameOnAnyNumberOfThreads) {
    auto camera = partOfATurn();
    PanoramaAlignment first;
    Rgba8Image picture;
    for (const int threads : {1, 2, 5}) {
        const ThreadLimit limit(threads);
        auto found = mustAlign(camera);
        Job job;
        auto made = composePanorama(camera, found, {.width = 512}, job);
        ASSERT_TRUE(made);
        if (threads == 1) {
            first = found;
            picture = made->pixels;
            continue;
        }
        EXPECT_EQ(found.focal, first.focal);
        EXPECT_TRUE(made->pixels == picture);
    }
}

/// Pictures in which a disc of one colour is somewhere else each time.
class WithMover final : public PictureSource {
  public:
    explicit WithMover(TurningCamera& camera) : camera_(camera) {}
    [[nodiscard]] int count() const override { return camera_.count(); }
    [[nodiscard]] std::string name(int k) const override { return camera_.name(k); }
    [[nodiscard]] double focalHint(int) const override { return 0; }
    [[nodiscard]] Result<Rgba8Image> picture(int k) override {
        STX_TRY(auto picture, camera_.picture(k));
        const glm::dmat3 world =
            glm::mat3_cast(camera_.worldFromCamera[static_cast<std::size_t>(k)]);
        // Goes to the left, slower than the camera turns: neighbours see it at two places.
        const glm::dvec3 middle =
            glm::angleAxis((20 + 9 * k) * kDegree, glm::dvec3(0, 1, 0)) * glm::dvec3(0, 0, -1);
        const double half = 0.5 * glm::length(glm::dvec2(camera_.size));
        for (int y = 0; y < picture.height(); ++y)
            for (int x = 0; x < picture.width(); ++x) {
                const glm::dvec2 p =
                    glm::dvec2(x + 0.5 - 0.5 * camera_.size.x, 0.5 * camera_.size.y - y - 0.5) /
                    half;
                if (glm::dot(world * camera_.lens.ray(p), middle) > std::cos(2.5 * kDegree))
                    picture.at(x, y) = {255, 0, 255, 255};
            }
        return picture;
    }

  private:
    TurningCamera& camera_;
};

/// Connected parts of the mover's colour that are larger than a few pixels.
int moversIn(Rgba8Image picture) {
    int movers = 0;
    const auto is = [&](int x, int y) {
        const glm::u8vec4 p = picture.at(x, y);
        return p.r > 225 && p.g < 40 && p.b > 225 && p.a == 255;
    };
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x) {
            if (!is(x, y)) continue;
            int pixels = 0;
            std::vector<glm::ivec2> open = {{x, y}};
            while (!open.empty()) {
                const glm::ivec2 p = open.back();
                open.pop_back();
                if (!picture.contains(p.x, p.y) || !is(p.x, p.y)) continue;
                picture.at(p.x, p.y) = {};
                ++pixels;
                for (const glm::ivec2 d : {glm::ivec2(1, 0), {-1, 0}, {0, 1}, {0, -1}})
                    open.push_back(p + d);
            }
            movers += pixels > 25;
        }
    return movers;
}

TEST(AlignPanorama, DrawsAMoverOnce) {
    TurningCamera camera;
    camera.sphere = &discs();
    for (int k = 0; k < 4; ++k) camera.add(16 * kDegree * k, 0, 0);
    WithMover source(camera);
    Job job;
    auto found = alignPanorama(source, {}, job);
    ASSERT_TRUE(found) << found.error().text();
    ASSERT_EQ(found->used(), 4);
    EXPECT_LT(rotationError(camera, *found), 0.05);  // the mover has its share
    const auto once = composePanorama(source, *found, {.width = 1024}, job);
    ASSERT_TRUE(once);
    EXPECT_EQ(moversIn(once->pixels), 1);
    const auto often = composePanorama(source, *found, {.width = 1024, .hideSeams = false}, job);
    ASSERT_TRUE(often);
    EXPECT_GT(moversIn(often->pixels), 1);  // it would be there more than once
}

TEST(AlignPanorama, ComesNearToPicturesThatAreLeftOut) {
    auto camera = partOfATurn();
    const auto found = mustAlign(camera);
    Job job;
    const auto leftOut = leaveEachOut(camera, found, {.width = 1024}, job);
    ASSERT_TRUE(leftOut);
    ASSERT_EQ(leftOut->size(), 6u);
    for (const LeftOutPicture& one : *leftOut) {
        EXPECT_GT(one.covered, 0.4);
        EXPECT_LE(one.covered, 1.0);
        EXPECT_GT(one.psnr, 28);
    }
}

TEST(AlignPanorama, BringsBackAnEquirectangularPicture) {
    REQUIRE_SHARED(path, "data/panorama/boofcv-equirectangular/equirectangular_half_dome_01.jpg");
    Job job;
    const auto bytes = readFile(path, job.limits);
    ASSERT_TRUE(bytes);
    const auto decoded = decodeRgba8(*bytes, "half dome", job.limits);
    ASSERT_TRUE(decoded);
    const PanoramaImage sphere{*decoded};
    TurningCamera camera;
    camera.sphere = &sphere;
    camera.size = {384, 512};
    camera.lens = {1.3, -0.03};
    for (int k = 0; k < 14; ++k) camera.add(360.0 / 14 * kDegree * k, -5 * kDegree, 0);
    const auto found = mustAlign(camera);
    expectFound(camera, found);
    EXPECT_TRUE(found.closed);
    EXPECT_GT(psnrOfPanorama(camera, found, 800), 35);
}

}  // namespace
}  // namespace stx
