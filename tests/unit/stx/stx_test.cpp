#include "formats/stx/stx.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "formats/images/exif.hpp"
#include "formats/stx/mesh_views.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/model/splat_cloud.hpp"
#include "tests/made_photos.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

Mesh quad() {
    Mesh mesh;
    mesh.materials.emplace_back();
    mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0.2f}, {-1, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    mesh.triangleMaterial = {0, 0};
    return mesh;
}

ConvertSettings smallViews(const std::string& views) {
    ConvertSettings settings;
    settings.views = views;
    settings.width = 32;
    settings.height = 24;
    return settings;
}

/// As viewers show them, whatever their EXIF says.
TEST(Stx, PicturesAreOpenedUpright) {
    TemporaryFolder folder;
    Job job;
    const Bytes stored = made::colourJpeg(32, 24);
    ASSERT_TRUE(writeFile(folder / "plain.jpg", stored));
    const auto plain = openPicture(folder / "plain.jpg", job);
    ASSERT_TRUE(plain) << plain.error().text();
    for (int orientation = 1; orientation <= 8; ++orientation) {
        ASSERT_TRUE(writeFile(folder / "turned.jpg",
                              made::withSegments(stored, {made::exifSegment(orientation, 28)})));
        const auto turned = openPicture(folder / "turned.jpg", job);
        ASSERT_TRUE(turned) << turned.error().text();
        EXPECT_TRUE(turned->coded == turnedUpright(plain->coded, orientation)) << orientation;
    }
}

TEST(Stx, ConvertsMeshByLayoutByBestViewsAndByCameras) {
    Job job;
    for (const auto& [views, count] : {std::pair{"ring:3", 3}, {"auto:2", 2}}) {
        const auto bundle = convert(quad(), smallViews(views), job);
        ASSERT_TRUE(bundle) << bundle.error().text();
        EXPECT_EQ(static_cast<int>(bundle->views.size()), count);
        EXPECT_EQ(bundle->views[0].camera.width, 32);
        EXPECT_EQ(bundle->views[0].depthBits, 16);
    }
    ConvertSettings settings;
    settings.title = "a quad";
    settings.cameras = {*cameraAt({0, 0, 4}, {0, 0, 0}, {})};
    const auto bundle = convert(quad(), settings, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    EXPECT_EQ(bundle->views.size(), 1u);
    EXPECT_EQ(bundle->views[0].camera, settings.cameras[0]);
    EXPECT_EQ(bundle->title, "a quad");
}

TEST(Stx, FramesCubesOrthographicallyUnlessToldOtherwise) {
    Job job;
    auto settings = smallViews("cube");
    EXPECT_TRUE(convert(quad(), settings, job)->views[0].camera.orthographic);
    settings.orthographic = false;
    EXPECT_FALSE(convert(quad(), settings, job)->views[0].camera.orthographic);
}

TEST(Stx, ViewsOfACloudStandOnWhatIsUpByItsFormat) {
    Job job;
    Mesh mesh = quad();
    const auto right = convert(mesh, smallViews("ring:3"), job);
    EXPECT_EQ(upOf(mesh), glm::dvec3(0, 1, 0));
    SplatCloud cloud;
    cloud.up = {0, 0, -1};
    mesh.splats = std::make_shared<const SplatCloud>(cloud);
    EXPECT_EQ(upOf(mesh), glm::dvec3(0, 0, -1));
    const auto views = chooseViews(mesh, smallViews("ring:3"), job);
    ASSERT_TRUE(right && views);
    EXPECT_EQ(upOf(*right), glm::dvec3(0, 1, 0));
    EXPECT_EQ(upOfCameras(views->cameras), glm::dvec3(0, 0, -1));
    auto settings = smallViews("ring:3");
    settings.up = {1, 0, 0};
    EXPECT_EQ(upOfCameras(chooseViews(mesh, settings, job)->cameras), glm::dvec3(1, 0, 0));
}

TEST(Stx, RefusesSettingsOutOfRange) {
    Job job;
    const auto codeOf = [&](auto change) {
        auto settings = smallViews("sphere:2");
        change(settings);
        const auto bundle = convert(quad(), settings, job);
        return bundle ? ErrorCode::difference : bundle.error().code;
    };
    EXPECT_EQ(codeOf([](auto& s) { s.views = "auto:0"; }), ErrorCode::usage);
    EXPECT_EQ(codeOf([](auto& s) { s.views = "auto:2x"; }), ErrorCode::usage);
    EXPECT_EQ(codeOf([](auto& s) { s.views = "rings"; }), ErrorCode::usage);
    EXPECT_EQ(codeOf([](auto& s) { s.width = 0; }), ErrorCode::usage);
    EXPECT_EQ(codeOf([](auto& s) { s.height = 1 << 20; }), ErrorCode::usage);
    EXPECT_EQ(codeOf([](auto& s) { s.fovRad = 0; }), ErrorCode::usage);
    EXPECT_EQ(codeOf([](auto& s) { s.supersampling = 9; }), ErrorCode::usage);
    EXPECT_EQ(codeOf([](auto& s) { s.elevationRad = 1; }), ErrorCode::usage);
    EXPECT_EQ(codeOf([](auto& s) { s.names = {"a", "b"}; }), ErrorCode::usage);
    EXPECT_EQ(codeOf([](auto& s) { s.depthBits = 12; }), ErrorCode::usage);
}

TEST(Stx, ConvertsAtlasToItsViews) {
    Job job;
    const auto bundle = smallBundle(3, 16, true, false);
    auto atlas = pack(bundle, {}, job);
    ASSERT_TRUE(atlas) << atlas.error().text();
    const auto back = convert(*atlas, {}, job);
    ASSERT_TRUE(back) << back.error().text();
    ASSERT_EQ(back->views.size(), bundle.views.size());
    for (std::size_t i = 0; i < bundle.views.size(); ++i)
        EXPECT_EQ(back->views[i].depth, bundle.views[i].depth) << i;

    atlas->bounds.reset();
    const Bounds fromAtlas = boundsOf(Model(*atlas)), fromBundle = bundle.computeBounds();
    EXPECT_NEAR(glm::distance(fromAtlas.min, fromBundle.min), 0, 1e-9);
    EXPECT_NEAR(glm::distance(fromAtlas.max, fromBundle.max), 0, 1e-9);
}

TEST(Stx, WhatIsNotSoundIsRefused) {
    Job job;
    Bundle wrong = smallBundle(2, 8, false, false);
    wrong.views[1].camera.width += 1;
    const auto converted = convert(Model(wrong), {}, job);
    ASSERT_FALSE(converted);
    EXPECT_EQ(converted.error().code, ErrorCode::invalidInput);

    const auto still = sequenceOf(smallBundle(1, 8, false, false));
    EXPECT_TRUE(still->frame(0, job));
    const auto beyond = still->frame(99, job);
    ASSERT_FALSE(beyond);
    EXPECT_EQ(beyond.error().code, ErrorCode::usage);

    auto atlas = pack(smallBundle(2, 16, false, false), {}, job);
    ASSERT_TRUE(atlas);
    atlas->bounds.reset();
    EXPECT_FALSE(boundsOf(Model(*atlas)).empty());
    atlas->pages.clear();
    EXPECT_TRUE(boundsOf(Model(*atlas)).empty());
}

TEST(Stx, ColoursThatAreNotFiniteAreRefused) {
    Job job;
    const TemporaryFolder folder;
    Bundle bundle = smallBundle(2, 8, false, false);
    for (ReferenceView& view : bundle.views)
        view.texture = RgbaFloatImage(view.camera.width, view.camera.height, glm::vec4(0.5f));
    auto atlas = pack(bundle, {}, job);
    ASSERT_TRUE(atlas) << atlas.error().text();
    bundle.views[1].texture.rgbaFloat()->at(3, 2).g = NAN;
    atlas->pages[0].texture.rgbaFloat()->at(1, 0).r = INFINITY;
    const auto refused = [](const auto& result, const std::string& expected) {
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, ErrorCode::invalidInput);
        EXPECT_EQ(result.error().text(), expected);
    };
    const std::string wrong = "a colour at column 3, row 2 is not finite";
    const std::string exr = folder / "a.exr";
    refused(bundle.check(), "view 1: " + wrong);
    refused(save(bundle, exr, {}, job), "'" + exr + "': view 1: " + wrong);
    refused(save(bundle, folder / "a.mp4", {}, job), "view 1 'view 1': " + wrong);
    refused(render(Model(bundle), bundle.views[0].camera, {}, job), "view 1: " + wrong);
    refused(atlas->check(), "page 0: a colour at column 1, row 0 is not finite");
    const std::string file = STX_SOURCE_DIR "/tests/fuzz/corpus/exr/not_finite_colour.exr";
    refused(open(file, {}, job), "'" + file + "': view 0: " + wrong);
    const auto findings = validateFile(file, {}, job);
    ASSERT_TRUE(findings);
    ASSERT_EQ(findings->size(), 1u);
    EXPECT_EQ((*findings)[0].rule->number, 4005);
    Environment around;
    around.layout = Environment::Layout::equirectangular;
    around.pictures = {RgbaFloatImage(4, 2, glm::vec4(NAN))};
    refused(around.check(), "an environment: a colour at column 0, row 0 is not finite");
}

TEST(Stx, ATextureWithoutPixelsIsRefused) {
    Job job;
    Mesh mesh = quad();
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.textures.resize(1);
    mesh.materials[0].baseColourTexture = 0;
    const auto converted = convert(Model(mesh), {}, job);
    ASSERT_FALSE(converted);
    EXPECT_EQ(converted.error().text(), "texture 0 has no pixels");
}

TEST(Stx, SettingsOfPicturesOutOfRangeAreRefused) {
    Job job;
    const Bundle bundle = smallBundle(1, 8, false, false);
    const auto messageOf = [&](auto change) {
        RenderSettings settings;
        settings.lighting.lights.emplace_back();
        change(settings);
        const auto frame = render(Model(bundle), bundle.views[0].camera, settings, job);
        if (frame) return std::string("none");
        EXPECT_EQ(frame.error().code, ErrorCode::usage);
        return frame.error().text();
    };
    EXPECT_EQ(messageOf([](auto&) {}), "none");
    EXPECT_EQ(messageOf([](auto& s) { s.lighting.shininess = 0; }),
              "shininess is 0; a number above 0 is expected");
    EXPECT_EQ(messageOf([](auto& s) { s.lighting.shininess = NAN; }),
              "shininess is nan; a number above 0 is expected");
    EXPECT_EQ(messageOf([](auto& s) { s.lighting.ambient = glm::vec3(NAN, 0, 0); }),
              "ambient is nan, 0, 0; light is 0 or more");
    EXPECT_EQ(messageOf([](auto& s) { s.lighting.specular.y = -1; }),
              "specular is 0, -1, 0; light is 0 or more");
    EXPECT_EQ(messageOf([](auto& s) { s.lighting.lights[0].vector = glm::vec3(0); }),
              "light 0 is along 0, 0, 0; a direction is expected");
    EXPECT_EQ(messageOf([](auto& s) { s.lighting.lights[0].colour.z = -2; }),
              "light 0 has the colour 1, 1, -2; light is 0 or more");
    EXPECT_EQ(messageOf([](auto& s) { s.splatCoefficient = NAN; }),
              "splatCoefficient is nan; 0 or more is expected");
}

TEST(Stx, SettingsOfFilesOutOfRangeAreRefused) {
    Job job;
    const TemporaryFolder folder;
    const Bundle bundle = smallBundle(1, 8, false, false);
    const auto refuses = [&](const SaveOptions& options, const char* name) {
        const auto saved = save(bundle, folder.path() / name, options, job);
        return !saved && saved.error().code == ErrorCode::usage;
    };
    EXPECT_TRUE(refuses({.bifsVersion = 3}, "a.mp4"));
    EXPECT_TRUE(refuses({.jpegQuality = -1}, "a.mp4"));
    EXPECT_TRUE(refuses({.h264 = 99}, "a.mp4"));
    EXPECT_TRUE(refuses({.pointTexture = true}, "a.exr"));
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    Environment sky;
    sky.skyColours = {glm::vec3(1)};
    EXPECT_FALSE(asCube(sky, 0, {}));
    EXPECT_FALSE(asEquirectangular(sky, 4, 0, {}));
    const auto messageOf = [](const Result<void>& saved) {
        if (saved) return std::string("none");
        EXPECT_EQ(saved.error().code, ErrorCode::usage);
        return saved.error().text();
    };
    for (const char* name : {"sky.jpg", "sky.mp4", "sky"})
        EXPECT_EQ(messageOf(saveEnvironment(sky, folder.path() / name, {.jpegQuality = 200}, job)),
                  "the quality of JPEG is 200; 1 to 100, or 0 (PNG), is expected");
    const auto frame = render(Model(bundle), bundle.views[0].camera, {}, job);
    ASSERT_TRUE(frame);
    for (const int quality : {0, 101}) {
        PictureOptions options;
        options.jpegQuality = quality;
        EXPECT_EQ(messageOf(save(*frame, folder.path() / "a.jpg", options, job)),
                  fmt::format("the quality of JPEG is {}; 1 to 100 is expected", quality));
    }
    PictureOptions options;
    options.background = glm::vec3(2, -1, NAN);
    EXPECT_EQ(messageOf(save(*frame, folder.path() / "a.png", options, job)),
              "the background is 2, -1, nan; values of 0 to 1 are expected");
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Stx, NotesWhatDepthInEightBitsCosts) {
    Job job;
    ConvertSettings settings;
    settings.depthBits = 8;
    const auto bundle = convert(smallBundle(2, 16, false, false), settings, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    EXPECT_EQ(bundle->views[1].depthBits, 8);
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("8 bits"), std::string::npos) << notes[0];
}

TEST(Stx, CamerasLookAtTheirTargetAndHoldTheSphere) {
    CameraSettings lens;
    lens.width = 200;
    lens.height = 100;
    const auto camera = cameraAt({3, 4, 5}, {1, 1, 1}, lens);
    ASSERT_TRUE(camera);
    const auto middle =
        camera->project(glm::dvec3(camera->cameraFromWorld() * glm::dvec4(1, 1, 1, 1)));
    EXPECT_NEAR(middle.x, 100, 1e-9);
    EXPECT_NEAR(middle.y, 50, 1e-9);
    EXPECT_NEAR(camera->fieldOfView().y, lens.fovRad, 1e-12);

    const auto orbit = orbitCameras({1, 0, 0}, 2.0, 4, 0.0, lens);
    ASSERT_TRUE(orbit);
    ASSERT_EQ(orbit->size(), 4u);
    EXPECT_NEAR((*orbit)[0].position.x, 1.0, 1e-12);
    EXPECT_GT((*orbit)[0].position.z, 2.0);
    const double distance = (*orbit)[0].position.z;
    const double reach = std::asin(2.0 / distance);  // of the sphere, from the viewpoint
    EXPECT_LT(reach, lens.fovRad / 2);
    EXPECT_GT(reach, lens.fovRad / 2 * 0.95);

    lens.orthoHeight = 4;
    EXPECT_DOUBLE_EQ(cameraAt({0, 0, 5}, {0, 0, 0}, lens)->fy, 25.0);
    lens.fovRad = std::numbers::pi;
    EXPECT_EQ(cameraAt({0, 0, 5}, {0, 0, 0}, lens).error().code, ErrorCode::usage);
    EXPECT_EQ(cameraAt({1, 1, 1}, {1, 1, 1}, {}).error().code, ErrorCode::usage);
    EXPECT_EQ(orbitCameras({}, 1, 0, 0, {}).error().code, ErrorCode::usage);
    EXPECT_EQ(orbitCameras({}, std::numeric_limits<double>::quiet_NaN(), 1, 0, {}).error().message,
              "the sphere's radius is nan; a finite number is expected");
}

TEST(Stx, RendererKeepsItsModel) {
    Job job;
    const auto camera = *cameraAt({0, 0, 4}, {0, 0, 0}, {.width = 48, .height = 32});
    const auto bundle = *convert(quad(), smallViews("ring:3"), job);
    for (const Model& model : {Model(quad()), Model(bundle), Model(*pack(bundle, {}, job))}) {
        const auto once = render(model, camera, {}, job);
        ASSERT_TRUE(once) << once.error().text();
        const auto renderer = rendererOf(model, {}, job);
        ASSERT_TRUE(renderer) << renderer.error().text();
        EXPECT_EQ((*renderer)->render(camera)->colour, once->colour);
        const auto pixels = once->colour.pixels();
        EXPECT_TRUE(std::any_of(pixels.begin(), pixels.end(), [](auto p) { return p.a > 0.5f; }));
    }
}

TEST(Stx, OpensAndValidatesWhatItSaved) {
    Job job;
    const TemporaryFolder folder;
    const auto bundle = smallBundle(2, 16, false, false);
    ASSERT_TRUE(save(bundle, folder / "a.exr", {}, job));
    EXPECT_TRUE(validateFile(folder / "a.exr", {}, job)->empty());
    const auto opened = open(folder / "a.exr", {}, job);
    ASSERT_TRUE(opened) << opened.error().text();
    EXPECT_EQ(differenceOf(std::get<Bundle>(*opened), bundle), "");

    SaveOptions keep;
    keep.noClobber = true;
    EXPECT_EQ(save(bundle, folder / "a.exr", keep, job).error().code, ErrorCode::io);
    EXPECT_EQ(save(bundle, folder / "a.png", {}, job).error().code, ErrorCode::usage);
    EXPECT_EQ(open(folder / "b.exr", {}, job).error().code, ErrorCode::io);

    ASSERT_TRUE(save(*pack(bundle, {}, job), folder / "atlas", {}, job));
    EXPECT_TRUE(std::holds_alternative<Atlas>(*open(folder / "atlas", {}, job)));
    EXPECT_TRUE(validateFile(folder / "atlas", {}, job)->empty());
}

TEST(Stx, ComparesPicturesOfFloatsAndOfBytes) {
    Job job;
    Picture bytes{Rgba8Image(16, 16, glm::u8vec4(255)), {}};
    Picture floats{Rgba8Image(16, 16, glm::u8vec4(255)), RgbaFloatImage(16, 16, glm::vec4(1))};
    EXPECT_TRUE(compare(floats, floats, {}, job)->identical());
    EXPECT_TRUE(job.takeNotes().empty());
    EXPECT_TRUE(compare(bytes, floats, {}, job)->identical());
    EXPECT_EQ(job.takeNotes().size(), 1u);
    bytes.coded.at(3, 4) = {0, 0, 0, 255};
    EXPECT_EQ(compare(bytes, floats, {}, job)->worst.x, 3);
}

}  // namespace
}  // namespace stx
