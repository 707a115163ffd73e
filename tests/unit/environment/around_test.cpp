// Pictures all around: what is where in them, and views that become a cube seen from inside.
#include <random>

#include <gtest/gtest.h>
#include <glm/gtc/constants.hpp>

#include "formats/any/open.hpp"
#include "formats/images/frames.hpp"
#include "lib/base/parallel.hpp"
#include "lib/render/around/around.hpp"
#include "lib/render/factory.hpp"
#include "tests/painted_environment.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// A room of 4 x 2.5 x 6 units around the origin, painted by direction: the ray length to its wall.
double wallAt(glm::dvec3 direction) {
    const glm::dvec3 half(2, 1.25, 3);
    const glm::dvec3 d = glm::abs(glm::normalize(direction));
    double ray = 1e9;
    for (int c = 0; c < 3; ++c)
        if (d[c] > 1e-9) ray = std::min(ray, half[c] / d[c]);
    return ray;
}

/// What a camera at the origin sees of the room.
ReferenceView roomView(const Camera& camera, const std::string& name) {
    ReferenceView view;
    view.name = name;
    view.camera = camera;
    view.depth = Image<float>(camera.width, camera.height);
    Rgba8Image image(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
            const glm::dvec3 d = camera.viewDirection(x + 0.5, y + 0.5);
            view.depth.at(x, y) = static_cast<float>(wallAt(d) * glm::dot(d, camera.forward()));
            image.at(x, y) = glm::u8vec4(glm::round(glm::dvec4(paintedColour(d), 1.0) * 255.0));
        }
    }
    view.texture = std::move(image);
    view.depthBits = 32;
    view.nearPlane = 0.5;
    view.farPlane = 5;
    return view;
}

Bundle room(int half) {
    Bundle bundle;
    const auto cameras = facesAround(Camera(), half);
    for (std::size_t f = 0; f < cameras.size(); ++f)
        bundle.views.push_back(roomView(cameras[f], kFacesAround[f]));
    return bundle;
}

TEST(Around, ShowsEachDirectionAndTheLengthOfItsRay) {
    const Bundle bundle = room(facesHalf(512));
    Job job;
    const auto renderer = makeRenderer(Backend::cpu, bundle, {}, -1, job);
    ASSERT_TRUE(renderer) << renderer.error().text();
    Camera pose;
    pose.orientation = glm::angleAxis(0.4, glm::normalize(glm::dvec3(0.2, 1, 0)));
    for (const Camera& camera : {Camera(), pose}) {
        const auto frame = renderAround(**renderer, camera, 512, 256, job);
        ASSERT_TRUE(frame) << frame.error().text();
        double colour = 0, relative = 0;
        int open = 0, count = 0;
        for (int y = 0; y < 256; ++y) {
            for (int x = 0; x < 512; ++x) {
                const glm::dvec3 d =
                    camera.orientation * latlongDirection({(x + 0.5) / 512, (y + 0.5) / 256});
                const glm::vec4 c = frame->colour.at(x, y);
                const float ray = frame->depth.at(x, y);
                ++count;
                if (!hasPoint(ray) || c.a < 1) {
                    ++open;
                    continue;
                }
                colour += glm::length(glm::dvec3(c) - paintedColour(d));
                relative += std::abs(ray / wallAt(d) - 1);
            }
        }
        EXPECT_LT(open, count / 200);
        EXPECT_LT(colour / count, 0.005);
        EXPECT_LT(relative / count, 0.002);
    }
}

/// A light that moves with the camera is one light for all faces, not one for each.
TEST(Around, HasTheLightsOfItsCamera) {
    const Bundle bundle = room(facesHalf(128));
    Camera pose;
    pose.orientation = glm::angleAxis(0.9, glm::normalize(glm::dvec3(0.3, 1, 0.2)));
    Light light{.kind = Light::Kind::directional, .vector = {0.3f, -0.2f, -1}};
    RenderSettings inWorld;
    inWorld.lighting.ambient = glm::vec3(0.1f);
    inWorld.lighting.lights = {light};
    inWorld.lighting.lights[0].vector =
        glm::vec3(pose.orientation * glm::normalize(glm::dvec3(light.vector)));
    RenderSettings moving = inWorld;
    light.inCameraSpace = true;
    moving.lighting.lights = {light};
    for (const RenderMode mode : {RenderMode::surface, RenderMode::splat}) {
        inWorld.mode = moving.mode = mode;
        Job job;
        const auto one = makeRenderer(Backend::cpu, bundle, inWorld, -1, job);
        const auto other = makeRenderer(Backend::cpu, bundle, moving, -1, job);
        ASSERT_TRUE(one && other);
        const auto a = renderAround(**one, pose, 128, 64, job),
                   b = renderAround(**other, pose, 128, 64, job);
        ASSERT_TRUE(a && b);
        float most = 0;
        for (std::size_t i = 0; i < a->colour.count(); ++i)
            most = std::max(most, glm::distance(a->colour.data()[i], b->colour.data()[i]));
        EXPECT_LT(most, 1e-3f);
        // Pictures that follow have their own lights again.
        const Camera face = facesAround(pose, 16)[2];
        const auto fresh = makeRenderer(Backend::cpu, bundle, moving, -1, job);
        ASSERT_TRUE(fresh);
        EXPECT_EQ((*other)->render(face)->colour, (*fresh)->render(face)->colour);
    }
}

TEST(Around, RefusesOtherShapes) {
    const Bundle bundle = room(16);
    Job job;
    const auto renderer = makeRenderer(Backend::cpu, bundle, {}, -1, job);
    ASSERT_TRUE(renderer);
    const auto frame = renderAround(**renderer, Camera(), 100, 60, job);
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, ErrorCode::usage);
    EXPECT_NE(frame.error().text().find("twice as wide as high"), std::string::npos);
}

TEST(Around, IsReadBackAsAPanorama) {
    const TemporaryFolder folder("around");
    const Bundle bundle = room(facesHalf(512));
    Job job;
    const auto renderer = makeRenderer(Backend::cpu, bundle, {}, -1, job);
    ASSERT_TRUE(renderer);
    const auto frame = renderAround(**renderer, Camera(), 512, 256, job);
    ASSERT_TRUE(frame);
    FrameOptions file;
    file.around = true;
    ASSERT_TRUE(writeFrame(*frame, folder / "room.exr", file));
    OpenOptions open;
    open.set.from = "panorama";
    open.set.depthBits = 32;
    const auto back = openBundle(folder / "room.exr", open, job);
    ASSERT_TRUE(back) << back.error().text();
    ASSERT_EQ(back->views.size(), 6u);
    double colour = 0, depth = 0, count = 0;
    for (const ReferenceView& view : back->views) {
        for (int y = 0; y < view.camera.height; ++y) {
            for (int x = 0; x < view.camera.width; ++x) {
                const float dist = view.depth.at(x, y);
                if (!hasPoint(dist)) continue;
                const glm::dvec3 d = view.camera.viewDirection(x + 0.5, y + 0.5);
                const glm::vec4 c = view.texture.at(x, y);
                const glm::dvec3 coded(srgbFromLinear(c.r), srgbFromLinear(c.g),
                                       srgbFromLinear(c.b));
                const glm::dvec3 off =
                    (view.texture.isLinear() ? coded : glm::dvec3(c)) - paintedColour(d);
                colour += glm::dot(off, off) / 3;
                depth += std::abs(dist / (wallAt(d) * glm::dot(d, view.camera.forward())) - 1);
                ++count;
            }
        }
    }
    const double psnr = 10 * std::log10(count / colour);
    RecordProperty("round trip",
                   fmt::format("{:.1f} dB, depth off by {:.4f} %", psnr, 100 * depth / count));
    EXPECT_GT(count, 6 * 0.99 * back->views[0].camera.width * back->views[0].camera.height);
    EXPECT_GT(psnr, 42);
    EXPECT_LT(depth / count, 0.002);
}

TEST(Around, ThePictureOfTheLeftEyeIsReadOfAPair) {
    // Both eyes' pictures in one, the left one above.
    const TemporaryFolder folder("pair");
    Frame frame;
    frame.linear = true;
    frame.colour = Image<glm::vec4>(64, 64, glm::vec4(1, 0, 0, 1));
    frame.depth = Image<float>(64, 64, 2.0f);
    for (int y = 32; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            frame.colour.at(x, y) = glm::vec4(0, 0, 1, 1);
            frame.depth.at(x, y) = 3.0f;
        }
    }
    FrameOptions file;
    file.around = true;
    ASSERT_TRUE(writeFrame(frame, folder / "pair.exr", file));
    Job job;
    OpenOptions open;
    open.set.from = "panorama";
    open.set.depthBits = 32;
    const auto bundle = openBundle(folder / "pair.exr", open, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_EQ(bundle->views.size(), 6u);
    for (const ReferenceView& view : bundle->views) {
        const Camera& c = view.camera;
        for (const glm::ivec2 at : {glm::ivec2(c.width / 2, c.height / 2), {3, 3}}) {
            EXPECT_LT(glm::distance(view.texture.at(at.x, at.y), glm::vec4(1, 0, 0, 1)), 0.01);
            const glm::dvec3 d = c.viewDirection(at.x + 0.5, at.y + 0.5);
            EXPECT_NEAR(view.depth.at(at.x, at.y), 2 * glm::dot(glm::normalize(d), c.forward()),
                        0.01);
        }
    }
    const auto notes = job.takeNotes();
    ASSERT_FALSE(notes.empty());
    EXPECT_NE(notes[0].find("the upper one (left) is read"), std::string::npos) << notes[0];
}

TEST(CubeFromInside, MergesViewsOfATurningSensor) {
    // 30 pictures of 60 x 45 degrees in three rings.
    Bundle bundle;
    for (int ring = -1; ring <= 1; ++ring) {
        for (int i = 0; i < 10; ++i) {
            const glm::dquat turn =
                glm::angleAxis(i * glm::two_pi<double>() / 10, glm::dvec3(0, 1, 0)) *
                glm::angleAxis(ring * 0.7, glm::dvec3(1, 0, 0));
            const Camera camera =
                Camera::fromFieldOfView({0.002 * i, 0, 0}, turn, {1.05, 0.8}, false, 160, 120);
            Camera centred = camera;
            centred.position = {};
            ReferenceView view = roomView(centred, fmt::format("v{}_{}", ring + 1, i));
            view.camera = camera;
            bundle.views.push_back(std::move(view));
        }
    }
    Job job;
    const auto cube = cubeFromInside(bundle, job);
    ASSERT_TRUE(cube) << cube.error().text();
    ASSERT_EQ(cube->views.size(), 6u);
    double relative = 0, count = 0, all = 0;
    for (const ReferenceView& view : cube->views) {
        EXPECT_FALSE(view.camera.orthographic);
        for (int y = 0; y < view.camera.height; ++y) {
            for (int x = 0; x < view.camera.width; ++x) {
                ++all;
                const float dist = view.depth.at(x, y);
                if (!hasPoint(dist)) continue;
                const glm::dvec3 d = view.camera.viewDirection(x + 0.5, y + 0.5);
                relative += std::abs(dist / (wallAt(d) * glm::dot(d, view.camera.forward())) - 1);
                ++count;
            }
        }
    }
    // Straight up and down nothing was taken: 3 rings reach 0.7 + 0.4 rad.
    EXPECT_GT(count / all, 0.75);
    EXPECT_LT(relative / count, 0.01);
}

TEST(CubeFromInside, RefusesCamerasWithoutACommonPlace) {
    Bundle bundle = room(16);
    bundle.views[2].camera.position.x += 2;
    Job job;
    const auto cube = cubeFromInside(bundle, job);
    ASSERT_FALSE(cube);
    EXPECT_NE(cube.error().text().find("share no place"), std::string::npos);
}

}  // namespace
}  // namespace stx
