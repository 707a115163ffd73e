#include "lib/refine/agree.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "lib/refine/colours.hpp"
#include "lib/refine/noise.hpp"
#include "lib/refine/silhouettes.hpp"
#include "tests/noisy_depth.hpp"

namespace stx {
namespace {

/// Of keepInSilhouettes().
constexpr SilhouetteAlpha kLevels{0.4625f, 0.99f};
constexpr int kPictureSide = 64;
constexpr double kSheetDist = 10.0, kSheetNoise = 0.004;

/// A camera that looks at the middle of the plane z = 0 from an angle around the y axis.
PixelSpace spaceAt(double angle) {
    Camera camera;
    camera.position = {kSheetDist * std::sin(angle), 0, kSheetDist * std::cos(angle)};
    camera.orientation = *lookAt(camera.position, {0, 0, 0});
    camera.width = camera.height = kPictureSide;
    camera.fx = camera.fy = 100;
    camera.cx = camera.cy = 0.5 * kPictureSide;
    return PixelSpace(camera, 2 * kSheetDist);
}

/// Views of that plane as prepareSource() has them before they are compared.
struct NoisySheet {
    std::vector<PixelSpace> spaces;
    std::vector<Image<float>> exact, q;
    std::vector<NoisyView> views;

    /// `behind`: how far behind the plane the last view has it, scene units.
    explicit NoisySheet(const std::vector<double>& angles, double behind = 0) {
        for (const double angle : angles) spaces.push_back(spaceAt(angle));
        for (std::size_t i = 0; i < angles.size(); ++i) {
            Image<float> image(kPictureSide, kPictureSide);
            const Camera& camera = spaces[i].camera;
            const double z = i + 1 == angles.size() ? -behind : 0;
            for (int y = 0; y < kPictureSide; ++y) {
                for (int x = 0; x < kPictureSide; ++x) {
                    const glm::dvec3 ray =
                        camera.orientation * camera.unproject(x + 0.5, y + 0.5, 1.0);
                    image.at(x, y) = static_cast<float>(ray.z / (z - camera.position.z));
                }
            }
            exact.push_back(image);
            for (std::size_t k = 0; k < image.count(); ++k)
                image.data()[k] *= static_cast<float>(1 + kSheetNoise * noisy::normal(i, k));
            q.push_back(image);
        }
        views.resize(angles.size());
        for (std::size_t i = 0; i < angles.size(); ++i) {
            views[i].left = smoothDepth(q[i], {}, kSheetNoise, &views[i].surface);
            views[i].space = &spaces[i];
            views[i].q = &q[i];
        }
    }

    /// Root of the mean square of what a view is off by, a share of q.
    [[nodiscard]] double off(std::size_t view) const {
        double sum = 0;
        for (std::size_t k = 0; k < q[view].count(); ++k) {
            const double d = q[view].data()[k] / exact[view].data()[k] - 1;
            sum += d * d;
        }
        return std::sqrt(sum / static_cast<double>(q[view].count()));
    }
};

TEST(NoisyViews, AreLessNoisyTogether) {
    NoisySheet sheet({-0.3, -0.1, 0.1, 0.3});
    const double before = sheet.off(1);
    const float left = sheet.views[1].left;
    agreeOnDepth(sheet.views);
    EXPECT_LT(sheet.off(1), 0.75 * before);
    EXPECT_LT(sheet.views[1].left, 0.75f * left);
    EXPECT_GT(sheet.views[1].left, sheet.off(1));
}

TEST(NoisyViews, OtherSurfacesAndTheirBacksDoNotCount) {
    // Seen from behind, and a surface that lies 3 % of the distance farther away.
    for (NoisySheet sheet : {NoisySheet({0.1, 3.1}), NoisySheet({0.1, -0.1}, 0.3)}) {
        for (std::size_t i = 0; i < 2; ++i) sheet.views[i].q = &sheet.q[i];
        for (std::size_t i = 0; i < 2; ++i) sheet.views[i].space = &sheet.spaces[i];
        const Image<float> before = sheet.q[0];
        agreeOnDepth(sheet.views);
        for (std::size_t k = 0; k < before.count(); ++k)
            ASSERT_EQ(sheet.q[0].data()[k], before.data()[k]) << k;
    }
}

TEST(NoisyViews, NoPointIsBehindWhatAnotherSeesFromBehind) {
    // Both sides of a sheet: each view has it farther away than the other, or nearer, as if it
    // were thick.
    constexpr float kOff = 0.003f, kDoubtShare = 0.002f;
    for (const float off : {-kOff, kOff}) {
        NoisySheet sheet({0.85, 2.25});
        for (std::size_t i = 0; i < 2; ++i) {
            const Image<float>& exact = sheet.exact[i];
            for (int y = 0; y < kPictureSide; ++y) {
                for (int x = 0; x < kPictureSide; ++x) {
                    const int left = std::min(x, kPictureSide - 2);
                    sheet.q[i].at(x, y) = (1 + off) * exact.at(x, y);
                    sheet.views[i].surface.at(x, y) = {exact.at(left + 1, y) - exact.at(left, y), 0,
                                                       kDoubtShare * exact.at(x, y)};
                }
            }
        }
        agreeOnDepth(sheet.views);
        const double middle = sheet.q[0].at(kPictureSide / 2, kPictureSide / 2) /
                              sheet.exact[0].at(kPictureSide / 2, kPictureSide / 2);
        if (off < 0)
            EXPECT_NEAR(middle, 1, 0.1 * kOff);
        else
            EXPECT_NEAR(middle, 1 + kOff, 1e-6);
    }
}

TEST(NoisyViews, OneAloneStaysAsItIs) {
    NoisySheet sheet({0.2});
    const Image<float> before = sheet.q[0];
    const float left = sheet.views[0].left;
    agreeOnDepth(sheet.views);
    EXPECT_EQ(sheet.views[0].left, left);
    for (std::size_t k = 0; k < before.count(); ++k)
        ASSERT_EQ(sheet.q[0].data()[k], before.data()[k]);
}

/// What a camera sees of the plane z = `z`, as q and where it is in the world.
template <class Visit>
void forEachOnPlane(const PixelSpace& space, double z, const Visit& visit) {
    const Camera& camera = space.camera;
    for (int y = 0; y < kPictureSide; ++y) {
        for (int x = 0; x < kPictureSide; ++x) {
            const glm::dvec3 ray = camera.orientation * camera.unproject(x + 0.5, y + 0.5, 1.0);
            const double dist = (z - camera.position.z) / ray.z;
            visit(x, y, static_cast<float>(1 / dist), camera.position + ray * dist);
        }
    }
}

TEST(NoisyViews, PointsThatAreOutsideASilhouetteMoveIntoIt) {
    // A thin sheet from before, and from its edge, where it is a strip of six pixels.
    constexpr double kHalfStrip = 0.3;
    constexpr float kDoubtShare = 0.03f;
    const std::vector<PixelSpace> spaces = {spaceAt(0), spaceAt(1.5707963)};
    Image<float> before(kPictureSide, kPictureSide), none(kPictureSide, kPictureSide, 0.0f);
    Image<glm::vec3> surface(kPictureSide, kPictureSide);
    forEachOnPlane(spaces[0], 0, [&](int x, int y, float q, glm::dvec3) {
        // Every third point is 1 before the sheet, which is 3.3 of its standard deviations.
        before.at(x, y) = (x + y) % 3 == 0 ? static_cast<float>(1 / (1 / q - 1)) : q;
        surface.at(x, y) = {0, 0, kDoubtShare * q};
    });
    const Texture full(Rgba8Image(kPictureSide, kPictureSide, glm::u8vec4(255)));
    Rgba8Image edge(kPictureSide, kPictureSide, glm::u8vec4(0));
    for (int y = 0; y < kPictureSide; ++y)
        for (int x = 0; x < kPictureSide; ++x)
            if (std::abs(x + 0.5 - kPictureSide / 2) < 10 * kHalfStrip)
                edge.at(x, y) = glm::u8vec4(255);
    const Texture strip(edge);
    Image<float> q = before;
    const std::vector<NoisyView> views = {{&spaces[0], &full, &q, surface, 0},
                                          {&spaces[1], &strip, &none, surface, 0}};
    keepInSilhouettes(views, kLevels);
    constexpr int kMiddle = kPictureSide / 2, kSeen = 12;
    for (int y = kMiddle - kSeen; y < kMiddle + kSeen; ++y) {
        for (int x = kMiddle - kSeen; x < kMiddle + kSeen; ++x) {
            const double z = kSheetDist - 1.0 / q.at(x, y);
            ASSERT_LT(std::abs(z), 2 * kHalfStrip) << x << ' ' << y;
            if ((x + y) % 3 != 0) {
                ASSERT_EQ(q.at(x, y), before.at(x, y)) << x << ' ' << y;
            }
        }
    }
    // Exact depth is not touched.
    for (glm::vec3& s : surface.pixels()) s.z = 0;
    q = before;
    const std::vector<NoisyView> exact = {{&spaces[0], &full, &q, surface, 0},
                                          {&spaces[1], &strip, &none, surface, 0}};
    keepInSilhouettes(exact, kLevels);
    for (std::size_t k = 0; k < q.count(); ++k) ASSERT_EQ(q.data()[k], before.data()[k]);
}

TEST(NoisyViews, OfManySilhouettesThoseFromOtherSidesTell) {
    // As above, with 70 more views from before, whose pictures have background in a corner.
    constexpr std::size_t kBefore = 70;
    constexpr float kDoubtShare = 0.03f;
    std::vector<PixelSpace> spaces;
    for (std::size_t i = 0; i <= kBefore; ++i)
        spaces.push_back(spaceAt(0.001 * static_cast<double>(i)));
    spaces.push_back(spaceAt(1.5707963));
    Image<float> q(kPictureSide, kPictureSide), none(kPictureSide, kPictureSide, 0.0f);
    Image<glm::vec3> surface(kPictureSide, kPictureSide);
    forEachOnPlane(spaces[0], 1, [&](int x, int y, float there, glm::dvec3) {
        q.at(x, y) = there;
        surface.at(x, y) = {0, 0, kDoubtShare * there};
    });
    Rgba8Image corner(kPictureSide, kPictureSide, glm::u8vec4(255)),
        strip(kPictureSide, kPictureSide, glm::u8vec4(0));
    corner.at(0, 0) = glm::u8vec4(0);
    for (int y = 0; y < kPictureSide; ++y)
        for (int x = kPictureSide / 2 - 3; x < kPictureSide / 2 + 3; ++x)
            strip.at(x, y) = glm::u8vec4(255);
    const Texture before(corner), aside(strip);
    std::vector<NoisyView> views{{&spaces[0], &before, &q, surface, 0}};
    for (std::size_t i = 1; i < spaces.size(); ++i)
        views.push_back({&spaces[i], i <= kBefore ? &before : &aside, &none, surface, 0});
    keepInSilhouettes(views, kLevels);
    const int middle = kPictureSide / 2;
    EXPECT_LT(std::abs(kSheetDist - 1.0 / q.at(middle, middle)), 0.6);
}

TEST(NoisyViews, ColoursTellWhereASurfaceIs) {
    // All points of the first view are 1 % too far, as what smoothing leaves is alike around a
    // pixel.
    constexpr float kOff = 0.01f;
    const std::vector<double> angles = {0, -0.2, 0.2, 0.4};
    std::vector<PixelSpace> spaces;
    for (const double angle : angles) spaces.push_back(spaceAt(angle));
    std::vector<Image<float>> q;
    std::vector<Texture> textures;
    std::vector<Image<glm::vec3>> surfaces;
    for (const PixelSpace& space : spaces) {
        Image<float> exact(kPictureSide, kPictureSide);
        Image<glm::vec3> surface(kPictureSide, kPictureSide);
        RgbaFloatImage colours(kPictureSide, kPictureSide);
        forEachOnPlane(space, 0, [&](int x, int y, float here, glm::dvec3 at) {
            exact.at(x, y) = here;
            const auto wave = static_cast<float>(std::sin(6 * at.x) * std::cos(5 * at.y));
            colours.at(x, y) = glm::vec4(glm::vec3(0.5f + 0.3f * wave), 1);
        });
        for (int y = 0; y < kPictureSide; ++y) {
            for (int x = 0; x < kPictureSide; ++x) {
                const float here = exact.at(x, y);
                const float slope = x > 0 ? here - exact.at(x - 1, y) : exact.at(1, y) - here;
                surface.at(x, y) = {slope, 0, kOff * here};
            }
        }
        q.push_back(exact);
        textures.emplace_back(colours);
        surfaces.push_back(surface);
    }
    const Image<float> exact = q[0];
    for (float& here : q[0].pixels()) here *= 1 - kOff;
    std::vector<NoisyView> views;
    for (std::size_t i = 0; i < spaces.size(); ++i)
        views.push_back({&spaces[i], &textures[i], &q[i], surfaces[i], 0});
    agreeOnColours(views);
    double sum = 0;
    for (std::size_t k = 0; k < exact.count(); ++k)
        sum += std::abs(q[0].data()[k] / exact.data()[k] - 1);
    EXPECT_LT(sum / static_cast<double>(exact.count()), 0.4 * kOff);
}

}  // namespace
}  // namespace stx
