#include "lib/render/surface/cpu/cpu_surface.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include "lib/base/parallel.hpp"

namespace stx {
namespace {

struct Hit {
    double t;
    glm::dvec3 colour, normal;
};
using Scene = std::function<std::optional<Hit>(glm::dvec3 from, glm::dvec3 along)>;

glm::dvec3 paint(glm::dvec3 p) {
    return glm::dvec3(0.5) + 0.3 * glm::sin(p * 5.0 + glm::dvec3(0, 1, 2));
}

std::optional<Hit> sphere(glm::dvec3 centre, double radius, glm::dvec3 from, glm::dvec3 along) {
    const glm::dvec3 d = from - centre;
    const double b = glm::dot(d, along), c = glm::dot(d, d) - radius * radius;
    if (b * b < c) return {};
    const double t = -b - std::sqrt(b * b - c);
    if (t <= 0) return {};
    const glm::dvec3 p = from + t * along;
    return Hit{t, paint(p), (p - centre) / radius};
}

/// The plane z = `z`, seen from above, where `there` says so.
template <class There>
std::optional<Hit> plane(double z, There there, glm::dvec3 from, glm::dvec3 along) {
    const double t = (z - from.z) / along.z;
    if (!(t > 0) || along.z >= 0) return {};
    const glm::dvec3 p = from + t * along;
    if (!there(p.x, p.y)) return {};
    return Hit{t, paint(p), {0, 0, 1}};
}

std::optional<Hit> ball(glm::dvec3 from, glm::dvec3 along) {
    return sphere({0, 0, 0}, 1, from, along);
}

struct Ray {
    glm::dvec3 from, along;
};

Ray rayOf(const Camera& c, double x, double y) {
    if (c.orthographic)
        return {c.position + c.orientation * (c.unproject(x, y, 0) * glm::dvec3(1, 1, 0)),
                c.forward()};
    return {c.position, c.viewDirection(x, y)};
}

/// Premultiplied colour and coverage, box-filtered.
glm::dvec4 pixelOf(const Scene& scene, const Camera& c, int x, int y) {
    constexpr int kSamples = 4;
    glm::dvec4 sum(0.0);
    for (int j = 0; j < kSamples; ++j) {
        for (int i = 0; i < kSamples; ++i) {
            const Ray r = rayOf(c, x + (i + 0.5) / kSamples, y + (j + 0.5) / kSamples);
            if (const auto hit = scene(r.from, r.along)) sum += glm::dvec4(hit->colour, 1.0);
        }
    }
    return sum / static_cast<double>(kSamples * kSamples);
}

ReferenceView capture(const Scene& scene, const Camera& c, const std::string& name) {
    ReferenceView view;
    view.name = name;
    view.camera = c;
    view.depthBits = 32;
    Rgba8Image colour(c.width, c.height, glm::u8vec4(0));
    view.depth = Image<float>(c.width, c.height, kNoDepth);
    double nearest = 1e9, farthest = 0;
    for (int y = 0; y < c.height; ++y) {
        for (int x = 0; x < c.width; ++x) {
            const glm::dvec4 p = pixelOf(scene, c, x, y);
            if (p.a > 0) colour.at(x, y) = glm::round(glm::dvec4(glm::dvec3(p) / p.a, p.a) * 255.0);
            const Ray r = rayOf(c, x + 0.5, y + 0.5);
            const auto hit = scene(r.from, r.along);
            if (!hit) continue;
            const double dist = hit->t * glm::dot(r.along, c.forward());
            nearest = std::min(nearest, dist);
            farthest = std::max(farthest, dist);
            view.depth.at(x, y) = static_cast<float>(dist);
        }
    }
    view.nearPlane = nearest * 0.99;
    view.farPlane = farthest * 1.01;
    view.texture = Texture(std::move(colour));
    bleedColour(view.texture);
    return view;
}

Camera at(glm::dvec3 eye, glm::dvec3 target = {0, 0, 0}, int size = 160, double fov = 0.8) {
    return Camera::fromFieldOfView(eye, *lookAt(eye, target), {fov, fov}, false, size, size);
}

Camera orthographicAt(glm::dvec3 eye, double window, int size = 160) {
    return Camera::fromFieldOfView(eye, *lookAt(eye, {0, 0, 0}), {window, window}, true, size,
                                   size);
}

Bundle bundleOf(const Scene& scene, const std::vector<Camera>& cameras) {
    Bundle bundle;
    for (const Camera& c : cameras)
        bundle.views.push_back(capture(scene, c, "view" + std::to_string(bundle.views.size())));
    return bundle;
}

Frame draw(const Bundle& bundle, const Camera& camera, RenderSettings settings = {}) {
    Job job;
    auto frame = makeCpuSurfaceRenderer(bundle, settings, job)->render(camera);
    EXPECT_TRUE(frame) << frame.error().text();
    return std::move(*frame);
}

RenderSettings with(Quality quality, Fill fill = Fill::background) {
    RenderSettings settings;
    settings.quality = quality;
    settings.fill = fill;
    return settings;
}

double psnr(const Frame& frame, const Scene& scene, const Camera& camera) {
    double error = 0;
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec4 d = glm::dvec4(frame.colour.at(x, y)) - pixelOf(scene, camera, x, y);
            error += glm::dot(glm::dvec3(d), glm::dvec3(d)) / 3;
        }
    }
    return -10 * std::log10(error / (camera.width * camera.height));
}

double coverage(const Frame& frame) {
    double sum = 0;
    for (const glm::vec4& p : frame.colour.pixels()) sum += p.a;
    return sum;
}

std::vector<Camera> around() {
    return {at({3, 0, 0}), at({0, 0, 3}), at({2, 1, 2}), at({-1, 1, 2.6}), at({1, -1, 2.6})};
}

TEST(CpuSurface, ASourcesOwnPoseComesBackExactly) {
    auto cameras = around();
    cameras.push_back(orthographicAt({0, 3, 0.5}, 2.4));
    const Bundle bundle = bundleOf(ball, cameras);
    for (const ReferenceView& view : bundle.views) {
        const Frame frame = draw(bundle, view.camera);
        for (int y = 0; y < view.camera.height; ++y) {
            for (int x = 0; x < view.camera.width; ++x) {
                const glm::vec4 source = view.texture.at(x, y);
                ASSERT_EQ(frame.colour.at(x, y), glm::vec4(glm::vec3(source) * source.a, source.a));
                ASSERT_EQ(frame.depth.at(x, y), view.depth.at(x, y));
            }
        }
    }
}

TEST(CpuSurface, NovelViewsMatchTheScene) {
    const Bundle bundle = bundleOf(ball, around());
    const Camera novel = at({0.7, 0.5, 2.8});
    EXPECT_GT(psnr(draw(bundle, novel, with(Quality::normal)), ball, novel), 36.0);
    EXPECT_GT(psnr(draw(bundle, novel, with(Quality::best)), ball, novel), 38.0);
}

// Every view paints the plane in a grey of its own, so that each change of the views that a pixel
// takes its colour from would show. More of them see it than it takes.
TEST(CpuSurface, ViewsFadeWhenOthersTakeTheirPlace) {
    const Scene floor = [](glm::dvec3 from, glm::dvec3 along) {
        return plane(
            0, [](double, double) { return true; }, from, along);
    };
    const auto eye = [](double degrees) {
        const double a = glm::radians(degrees);
        return glm::dvec3(3 * std::sin(a), 0.3, 3 * std::cos(a));
    };
    std::vector<Camera> cameras;
    for (int i = -3; i <= 3; ++i) cameras.push_back(at(eye(18.0 * i), {0, 0, 0}, 48, 0.5));
    Bundle bundle = bundleOf(floor, cameras);
    const std::array<std::uint8_t, 7> greys{40, 220, 90, 130, 30, 240, 120};
    for (std::size_t i = 0; i < greys.size(); ++i)
        bundle.views[i].texture =
            Texture(Rgba8Image(48, 48, glm::u8vec4(greys[i], greys[i], greys[i], 255)));
    Job job;
    for (const Quality quality : {Quality::normal, Quality::best}) {
        const auto renderer = makeCpuSurfaceRenderer(bundle, with(quality), job);
        double last = -1, largest = 0;
        for (int step = 0; step < 240; ++step) {
            const Camera camera = at(eye(-12.03 + 0.1 * step), {0, 0, 0}, 16, 0.167);
            const double here = 255.0 * renderer->render(camera)->colour.at(8, 8).r;
            if (last >= 0) largest = std::max(largest, std::abs(here - last));
            last = here;
        }
        EXPECT_LT(largest, 1.0) << "quality " << static_cast<int>(quality);
    }
}

// Rows of samples of a steep plane are pieces of their own: the first gave a depth 0.38 pixels
// aside.
TEST(CpuSurface, DepthOfASteepPlaneIsThatAtThePixelsCentre) {
    const Scene floor = [](glm::dvec3 from, glm::dvec3 along) {
        return plane(
            0, [](double x, double y) { return std::abs(x) < 1 && std::abs(y) < 1; }, from, along);
    };
    const Bundle bundle =
        bundleOf(floor, {at({2, 0, 1.2}), at({1, 1.7, 1.2}), at({-1, 1.7, 1.2}), at({0, 0.1, 3})});
    const Camera novel = at({2.2, 0.9, 0.55}, {0, 0, 0}, 200);
    const Frame frame = draw(bundle, novel);
    const auto truth = [&](double x, double y) {
        const Ray r = rayOf(novel, x, y);
        const auto hit = floor(r.from, r.along);
        return hit ? hit->t * glm::dot(r.along, novel.forward()) : 0.0;
    };
    int seen = 0;
    for (int y = 0; y < novel.height; ++y) {
        for (int x = 0; x < novel.width; ++x) {
            const double across = std::abs(truth(x + 1, y + 0.5) - truth(x, y + 0.5));
            const double down = std::abs(truth(x + 0.5, y + 1) - truth(x + 0.5, y));
            if (frame.colour.at(x, y).a < 0.999f || across + down > 1) continue;
            ++seen;
            EXPECT_NEAR(frame.depth.at(x, y), truth(x + 0.5, y + 0.5),
                        0.26 * (across + down) + 1e-4)
                << x << ", " << y;
        }
    }
    EXPECT_GT(seen, 2000);
}

TEST(CpuSurface, MapsBetweenBothProjections) {
    const std::vector<Camera> flat = {orthographicAt({0, 0, 3}, 2.4),
                                      orthographicAt({1, 0.5, 2.8}, 2.4),
                                      orthographicAt({-1, 0.3, 2.8}, 2.4)};
    const Camera perspective = at({0.2, 0.3, 3});
    const Camera orthographic = orthographicAt({0.3, 0.2, 3}, 2.3);
    EXPECT_GT(psnr(draw(bundleOf(ball, flat), perspective), ball, perspective), 34.0);
    EXPECT_GT(psnr(draw(bundleOf(ball, flat), orthographic), ball, orthographic), 34.0);
    auto all = around();
    for (const glm::dvec3 eye :
         {glm::dvec3(-3, 0, 0), glm::dvec3(0, 3, 0.1), glm::dvec3(0, -3, 0.1)})
        all.push_back(at(eye));
    EXPECT_GT(psnr(draw(bundleOf(ball, all), orthographic), ball, orthographic), 34.0);
}

/// The walls, the floor and the ceiling of a room, from inside.
std::optional<Hit> room(glm::dvec3 from, glm::dvec3 along) {
    const glm::dvec3 least(-3, -2, -4), most(2.5, 1.7, 3.6);
    Hit nearest{1e9, {}, {}};
    for (int axis = 0; axis < 3; ++axis) {
        const double t = ((along[axis] > 0 ? most : least)[axis] - from[axis]) / along[axis];
        if (!(t > 0 && t < nearest.t)) continue;
        nearest.t = t;
        nearest.normal = glm::dvec3(0);
        nearest.normal[axis] = along[axis] > 0 ? -1 : 1;
    }
    nearest.colour = paint(from + nearest.t * along);
    return nearest;
}

// Planar pieces of walls reach behind a camera whose field of view is wide.
TEST(CpuSurface, WallsAreWholeHoweverWideThePicture) {
    const glm::dvec3 eye(0.1, -0.2, 0.3);
    std::vector<Camera> cameras;
    for (const glm::dvec3 side : {glm::dvec3(1, 0, 0), glm::dvec3(0, 1e-3, 1), glm::dvec3(0, 1, 0)})
        for (const double sign : {-1.0, 1.0})
            cameras.push_back(at(eye, eye + sign * side, 96, glm::radians(96.0)));
    const Bundle bundle = bundleOf(room, cameras);
    for (const double degrees : {120.0, 150.0, 165.0}) {
        Camera wide = at(eye, {-1, 0.3, -2}, 120, glm::radians(degrees));
        const Frame frame = draw(bundle, wide);
        int open = 0, off = 0;
        for (int y = 0; y < wide.height; ++y) {
            for (int x = 0; x < wide.width; ++x) {
                open += frame.colour.at(x, y).a < 0.999f;
                const Ray r = rayOf(wide, x + 0.5, y + 0.5);
                const double truth = room(r.from, r.along)->t * glm::dot(r.along, wide.forward());
                off += !(std::abs(frame.depth.at(x, y) - truth) < 0.1 * truth);
            }
        }
        EXPECT_EQ(open, 0) << degrees;
        EXPECT_LT(off, 10) << degrees;
    }
}

TEST(CpuSurface, GeneralIntrinsics) {
    Camera novel = at({0.7, 0.5, 2.8});
    novel.fx *= 1.2;
    novel.cx += 13.3;
    novel.cy -= 7.7;
    novel.width = 201;
    novel.height = 93;
    EXPECT_GT(psnr(draw(bundleOf(ball, around()), novel), ball, novel), 35.0);
}

TEST(CpuSurface, SilhouettesAreAntiAliased) {
    const Bundle bundle = bundleOf(ball, around());
    const Camera novel = at({0.7, 0.5, 2.8});
    const Frame frame = draw(bundle, novel, with(Quality::best));
    double truth = 0;
    int partial = 0;
    for (int y = 0; y < novel.height; ++y) {
        for (int x = 0; x < novel.width; ++x) {
            truth += pixelOf(ball, novel, x, y).a;
            const float a = frame.colour.at(x, y).a;
            partial += a > 0.05f && a < 0.95f;
        }
    }
    EXPECT_NEAR(coverage(frame) / truth, 1.0, 0.004);
    EXPECT_GT(partial, 150);
}

TEST(CpuSurface, ASeeThroughGapStaysOpen) {
    // Holes of 4 pixels: small enough to be filled, if nobody looked through them.
    const Scene grille = [](glm::dvec3 from, glm::dvec3 along) {
        return plane(
            0,
            [](double x, double y) {
                const double u = x - std::round(x * 4) / 4, v = y - std::round(y * 4) / 4;
                return std::abs(x) < 0.9 && std::abs(y) < 0.9 && u * u + v * v > 0.04 * 0.04;
            },
            from, along);
    };
    const Bundle bundle = bundleOf(grille, {at({0.3, 0, 3}), at({-0.3, 0.1, 3}), at({0, -0.3, 3})});
    const Camera novel = at({0, 0.1, 2.9});
    const Frame frame = draw(bundle, novel);
    double truth = 0;
    for (int y = 0; y < novel.height; ++y)
        for (int x = 0; x < novel.width; ++x) truth += pixelOf(grille, novel, x, y).a;
    EXPECT_NEAR(coverage(frame) / truth, 1.0, 0.016);
    const glm::dvec3 middle =
        novel.project(glm::inverse(novel.orientation) * (glm::dvec3(0) - novel.position));
    EXPECT_LT(frame.colour.at(static_cast<int>(middle.x), static_cast<int>(middle.y)).a, 0.05f);
}

TEST(CpuSurface, SmallHolesThatNobodyLooksThroughAreFilled) {
    const Scene sheet = [](glm::dvec3 from, glm::dvec3 along) {
        return plane(
            0, [](double x, double y) { return std::abs(x) < 0.9 && std::abs(y) < 0.9; }, from,
            along);
    };
    Bundle bundle = bundleOf(sheet, {at({0.3, 0, 3}), at({-0.3, 0.1, 3})});
    // The depth of a spot is missing in both, as a scanner would leave it.
    for (ReferenceView& view : bundle.views) {
        for (int y = 0; y < view.camera.height; ++y)
            for (int x = 0; x < view.camera.width; ++x)
                if (hasPoint(view.depth.at(x, y)) && glm::length(view.worldPoint(x, y)) < 0.06)
                    view.depth.at(x, y) = kNoDepth;
    }
    const Camera novel = at({0, 0.1, 2.9});
    const Frame frame = draw(bundle, novel);
    for (int y = 60; y < 100; ++y)
        for (int x = 60; x < 100; ++x) ASSERT_GT(frame.colour.at(x, y).a, 0.99f) << x << "," << y;
    EXPECT_GT(psnr(frame, sheet, novel), 30.0);
}

TEST(CpuSurface, LongSlitsAreFilledUnlessSomebodyLooksThroughThem) {
    const auto sheetWith = [](bool slit) -> Scene {
        return [slit](glm::dvec3 from, glm::dvec3 along) {
            return plane(
                0,
                [slit](double x, double y) {
                    const bool inSlit = std::abs(x) < 0.05 && std::abs(y) < 0.6;
                    return std::abs(x) < 0.9 && std::abs(y) < 0.9 && !(slit && inSlit);
                },
                from, along);
        };
    };
    const std::vector<Camera> cameras = {at({0.3, 0, 3}), at({-0.3, 0.1, 3})};
    const Camera novel = at({0, 0.1, 2.9});
    const auto middle = glm::ivec2(
        novel.project(glm::inverse(novel.orientation) * (glm::dvec3(0) - novel.position)));

    Bundle untold = bundleOf(sheetWith(false), cameras);
    for (ReferenceView& view : untold.views) {
        for (int y = 0; y < view.camera.height; ++y) {
            for (int x = 0; x < view.camera.width; ++x) {
                if (!hasPoint(view.depth.at(x, y))) continue;
                const auto p = view.worldPoint(x, y);
                if (std::abs(p.x) < 0.05 && std::abs(p.y) < 0.6) view.depth.at(x, y) = kNoDepth;
            }
        }
    }
    EXPECT_GT(
        draw(untold, novel, with(Quality::normal, Fill::none)).colour.at(middle.x, middle.y).a,
        0.99f)
        << "unseen: filled";

    const Bundle open = bundleOf(sheetWith(true), cameras);
    EXPECT_LT(draw(open, novel).colour.at(middle.x, middle.y).a, 0.05f) << "seen through: open";
}

/// A red plate with a square opening (or a slot from its middle to its upper edge), and a blue wall
/// behind it. Two views look in from the sides: neither sees the middle of the wall.
Bundle pit(bool slot, bool wall) {
    const Scene scene = [=](glm::dvec3 from, glm::dvec3 along) {
        auto plate = plane(
            0,
            [=](double x, double y) {
                const bool opening = std::abs(x) < 0.22 && y > -0.22 && (slot || y < 0.22);
                return std::abs(x) < 0.9 && std::abs(y) < 0.9 && !opening;
            },
            from, along);
        if (plate) {
            plate->colour = {0.8, 0.1, 0.1};
            return plate;
        }
        auto behind = plane(
            -0.85, [](double x, double y) { return std::abs(x) < 0.7 && std::abs(y) < 0.7; }, from,
            along);
        if (behind) behind->colour = {0.1, 0.2, 0.9};
        return wall ? behind : std::optional<Hit>();
    };
    return bundleOf(scene, {at({1.8, 0, 3}), at({-1.8, 0, 3})});
}

TEST(CpuSurface, AHoleShowsTheSurfaceThatContinuesIntoIt) {
    const Camera novel = at({0, 0, 3}, {0, 0, 0}, 100);
    RenderSettings settings;
    settings.normals = true;
    const Bundle bundle = pit(false, true);
    const Frame frame = draw(bundle, novel, settings);
    for (int y = 47; y < 53; ++y) {
        for (int x = 46; x < 54; ++x) {
            const glm::vec4 c = frame.colour.at(x, y);
            ASSERT_GT(c.a, 0.99f) << x << "," << y;
            // The wall's own rim has half of the plate in it, as views take pictures.
            EXPECT_GT(c.b, 0.4f) << "the plate bled into " << x << "," << y;
            EXPECT_NEAR(frame.depth.at(x, y), 3.85f, 0.02f) << x << "," << y;
            EXPECT_GT(frame.normal.at(x, y).z, 0.99f) << x << "," << y;
        }
    }
    // Nothing is behind it: both views see through.
    EXPECT_LT(draw(pit(false, false), novel).colour.at(50, 50).a, 0.05f);
}

TEST(CpuSurface, WhatNobodySawIsFilledFromTheBackground) {
    const Scene room = [](glm::dvec3 from, glm::dvec3 along) -> std::optional<Hit> {
        auto wall = plane(
            -3, [](double, double) { return true; }, from, along);
        if (wall) wall->colour = {0.1, 0.2, 0.9};
        auto front = sphere({0, 0, 0}, 0.5, from, along);
        if (front) front->colour = {0.9, 0.1, 0.1};
        return front ? front : wall;
    };
    const Bundle bundle = bundleOf(room, {at({0, 0, 3}, {0, 0, 0})});
    const Camera novel = at({0.8, 0, 2.9}, {0.8, 0, 0});
    const Frame open = draw(bundle, novel, with(Quality::normal, Fill::none));
    const Frame filled = draw(bundle, novel);
    int holes = 0;
    for (int y = 20; y < 140; ++y) {
        for (int x = 5; x < 120; ++x) {
            ASSERT_GT(filled.colour.at(x, y).a, 0.99f);
            if (open.colour.at(x, y).a > 0.01f) continue;
            ++holes;
            EXPECT_LT(filled.colour.at(x, y).r, 0.3f) << "the red ball bled into " << x << "," << y;
        }
    }
    EXPECT_GT(holes, 50);
}

TEST(CpuSurface, TheSameBytesOnAnyNumberOfThreads) {
    const Bundle bundle = bundleOf(ball, around());
    const Camera novel = at({0.7, 0.5, 2.8}, {0, 0, 0}, 200);
    for (const Quality quality : {Quality::normal, Quality::best}) {
        Frame one, many;
        {
            const ThreadLimit limit(1);
            one = draw(bundle, novel, with(quality));
        }
        {
            const ThreadLimit limit(4);
            many = draw(bundle, novel, with(quality));
        }
        EXPECT_EQ(one.colour, many.colour);
        EXPECT_EQ(one.depth, many.depth);
    }
}

TEST(CpuSurface, EverySimdTargetDrawsTheSame) {
    const Bundle bundle = bundleOf(ball, around());
    const Camera novel = at({0.7, 0.5, 2.8});
    const Frame reference = draw(bundle, novel);
    for (const auto target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().DeInit();
        const Frame frame = draw(bundle, novel);
        hwy::SetSupportedTargetsForTest(0);
        hwy::GetChosenTarget().DeInit();
        double error = 0;
        for (std::size_t i = 0; i < frame.colour.count(); ++i) {
            const glm::dvec4 d(frame.colour.data()[i] - reference.colour.data()[i]);
            error += glm::dot(d, d);
        }
        EXPECT_LT(error / static_cast<double>(frame.colour.count()), 1e-5)
            << hwy::TargetName(target);
    }
}

TEST(CpuSurface, CamerasThatSeeNothingGiveEmptyFrames) {
    const Bundle bundle = bundleOf(ball, around());
    for (const Camera& camera : {at({0, 0, 0.1}, {0, 0, 1}), at({0.1, 0, 0}, {0, 5, 0}),
                                 at({0, 0, 3}, {0, 0, 9}), at({0, 0, 900}, {900, 0, 900}, 1)}) {
        const Frame frame = draw(bundle, camera);
        ASSERT_EQ(frame.colour.size(), glm::ivec2(camera.width, camera.height));
        ASSERT_EQ(frame.depth.size(), glm::ivec2(camera.width, camera.height));
        EXPECT_EQ(coverage(frame), 0.0);
        for (const float dist : frame.depth.pixels()) ASSERT_FALSE(hasPoint(dist));
    }
    Job job;
    Camera bad = at({0, 0, 3});
    bad.fx = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(makeCpuSurfaceRenderer(bundle, {}, job)->render(bad));
    bad = at({0, 0, 3});
    bad.width = 0;
    EXPECT_FALSE(makeCpuSurfaceRenderer(bundle, {}, job)->render(bad));
}

TEST(CpuSurface, DepthAndLitNormalsFollowTheSurface) {
    const Bundle bundle = bundleOf(ball, around());
    const Camera novel = at({0.7, 0.5, 2.8});
    RenderSettings settings;
    settings.lighting.lights.push_back({.kind = Light::Kind::directional, .vector = {0, 0, -1}});
    const Frame frame = draw(bundle, novel, settings);
    ASSERT_FALSE(frame.albedo.empty());
    ASSERT_FALSE(frame.normal.empty());
    int count = 0;
    double angle = 0;
    for (int y = 0; y < novel.height; ++y) {
        for (int x = 0; x < novel.width; ++x) {
            const Ray r = rayOf(novel, x + 0.5, y + 0.5);
            const auto hit = ball(r.from, r.along);
            if (!hit || -glm::dot(hit->normal, r.along) < 0.4) continue;
            ASSERT_NEAR(frame.depth.at(x, y), hit->t * glm::dot(r.along, novel.forward()), 0.01);
            const double cosine = glm::dot(glm::dvec3(frame.normal.at(x, y)), hit->normal);
            ASSERT_GT(cosine, 0.9) << x << "," << y;
            angle += std::acos(std::min(cosine, 1.0));
            const float expected = 0.2f + std::max(0.0f, static_cast<float>(hit->normal.z));
            ASSERT_NEAR(frame.colour.at(x, y).g, frame.albedo.at(x, y).g * expected, 0.15);
            ++count;
        }
    }
    EXPECT_GT(count, 3000);
    EXPECT_LT(angle / count, 0.03);
}

TEST(CpuSurface, CoarseDepthCodesStillGiveAClosedSurface) {
    Bundle bundle = bundleOf(ball, around());
    for (ReferenceView& view : bundle.views) {
        view.depthBits = 8;
        for (float& dist : view.depth.pixels())
            dist = static_cast<float>(view.depthCode().decode(view.depthCode().encode(dist)));
    }
    const Camera novel = at({0.7, 0.5, 2.8});
    const Frame frame = draw(bundle, novel);
    EXPECT_GT(psnr(frame, ball, novel), 28.0);
    for (int y = 60; y < 100; ++y)
        for (int x = 60; x < 100; ++x) ASSERT_GT(frame.colour.at(x, y).a, 0.99f) << x << "," << y;
}

// Pieces of a surface that reach behind the plane of an orthographic camera end there.
TEST(CpuSurface, AnOrthographicCameraAmidAPlaneSeesWhatIsBeforeIt) {
    const Scene floor = [](glm::dvec3 from, glm::dvec3 along) {
        return plane(
            0.0, [](double, double) { return true; }, from, along);
    };
    const Bundle bundle = bundleOf(floor, {at({0, 0, 2.2}, {0, 0.001, 0}, 96, 0.9273)});
    const glm::dvec3 eye(0, 0, 0.001);
    const Camera camera =
        Camera::fromFieldOfView(eye, *lookAt(eye, {0, 1, -1}, {0, 0, 1}), {1.5, 1.5}, true, 96, 96);
    const Frame frame = draw(bundle, camera, with(Quality::normal, Fill::none));
    for (int y = 0; y < 47; ++y) EXPECT_GT(frame.colour.at(48, y).a, 0.5f) << y;
    for (int y = 49; y < 96; ++y) EXPECT_EQ(frame.colour.at(48, y).a, 0.0f) << y;
}

}  // namespace
}  // namespace stx
