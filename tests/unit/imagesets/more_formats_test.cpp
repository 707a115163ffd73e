// MIV's other projections and raw planes, our cameras.json, OpenEXR of other programs.

#include <cmath>

#include "formats/exr/bundle_exr.hpp"
#include "formats/imagesets/camera_file.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

std::string mivCamera(const std::string& name, int w, int h, const std::string& projection) {
    return fmt::format(
        R"({{"Name":"{}","Position":[1,2,3],"Rotation":[30,-20,10],"Depth_range":[1,20],)"
        R"("Resolution":[{},{}],"BitDepthColor":8,"BitDepthDepth":16,{}}})",
        name, w, h, projection);
}

/// R = Rz(yaw) Ry(pitch) Rx(roll) in x forward, y left, z up, by its definition; then our axes.
glm::dvec3 mivWorld(glm::dvec3 inCamera) {
    const double y = glm::radians(30.0), p = glm::radians(-20.0), r = glm::radians(10.0);
    const glm::dmat3 rz(std::cos(y), std::sin(y), 0, -std::sin(y), std::cos(y), 0, 0, 0, 1);
    const glm::dmat3 ry(std::cos(p), 0, -std::sin(p), 0, 1, 0, std::sin(p), 0, std::cos(p));
    const glm::dmat3 rx(1, 0, 0, 0, std::cos(r), std::sin(r), 0, -std::sin(r), std::cos(r));
    const glm::dvec3 w = rz * ry * rx * inCamera + glm::dvec3(1, 2, 3);
    return {-w.y, w.z, -w.x};
}

double mivDepth(int code) {
    const double s = code / 65535.0;
    return 20 / (1 + s * 19);
}

ReferenceView plain(int w, int h) {
    ReferenceView view;
    view.texture = Rgba8Image(w, h, {10, 200, 30, 255});
    return view;
}

int codeAt(int x, int y) {
    return (x * 977 + y * 1313) % 65536;
}

TEST(Miv, PerspectiveIsExactAndCodeZeroIsFarUnlessInvalid) {
    TemporaryFolder folder;
    const int w = 40, h = 30;
    writeColour(folder / "a_texture.png", plain(w, h));
    writeCodes(folder / "a_depth.png", w, h, 16, codeAt);
    const std::string projection =
        R"("Projection":"Perspective","Focal":[33,35],"Principle_point":[19,16])";
    for (const bool invalid : {false, true}) {
        writeText(
            folder / "list.json",
            "{\"cameras\":[" +
                mivCamera("a", w, h, projection + (invalid ? ",\"HasInvalidDepth\":true" : "")) +
                "," + mivCamera("viewport", w, h, projection) + "]}");
        const auto read = readSet(folder.path());
        ASSERT_TRUE(read) << read.error().text();
        ASSERT_EQ(read->views.size(), 1u);  // the one without images is not a source
        const auto& view = read->views[0];
        EXPECT_EQ(hasPoint(view.depth.at(0, 0)), !invalid);
        for (int y = 0; y < h; ++y)
            for (int x = 1; x < w; ++x) {
                if (codeAt(x, y) == 0) continue;
                const double z = mivDepth(codeAt(x, y));
                const glm::dvec3 truth =
                    mivWorld({z, -(x + 0.5 - 19) / 33 * z, -(y + 0.5 - 16) / 35 * z});
                ASSERT_LT(glm::length(view.worldPoint(x, y) - truth), 1e-5 * z);
            }
    }
}

TEST(Miv, OrthographicWindow) {
    TemporaryFolder folder;
    const int w = 40, h = 30;
    writeColour(folder / "a_color.png", plain(w, h));
    writeCodes(folder / "a_depth16.png", w, h, 16, codeAt);
    writeText(
        folder / "list.json",
        "{\"cameras\":[" +
            mivCamera("a", w, h,
                      R"("Projection":"Orthographic","Hor_range":[-4,4],"Ver_range":[-2,4])") +
            "]}");
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const glm::dvec3 truth =
                mivWorld({mivDepth(codeAt(x, y)), 4 - (x + 0.5) / 5, 4 - (y + 0.5) / 5});
            ASSERT_LT(glm::length(read->views[0].worldPoint(x, y) - truth), 1e-4);
        }
}

TEST(Miv, EquirectangularDepthIsRayLength) {
    TemporaryFolder folder;
    const int w = 64, h = 32;
    writeColour(folder / "a_color.png", plain(w, h));
    // A sphere of radius 4 around the camera: one code everywhere.
    writeCodes(folder / "a_depth16.png", w, h, 16, [](int, int) { return 13797; });
    writeText(
        folder / "list.json",
        "{\"cameras\":[" +
            mivCamera(
                "a", w, h,
                R"("Projection":"Equirectangular","Hor_range":[-180,180],"Ver_range":[-90,90])") +
            "]}");
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 6u);
    for (const auto& view : read->views)
        for (int y = 0; y < view.camera.height; ++y)
            for (int x = 0; x < view.camera.width; ++x)
                ASSERT_NEAR(glm::length(view.worldPoint(x, y) - mivWorld({0, 0, 0})),
                            mivDepth(13797), 1e-4);
    // The front face looks where the picture's middle does.
    const glm::dvec3 forward = mivWorld({1, 0, 0}) - mivWorld({0, 0, 0});
    EXPECT_LT(glm::length(read->views[0].camera.forward() - forward), 1e-9);
}

TEST(Miv, YuvFramesAndSizesThatDoNotFit) {
    TemporaryFolder folder;
    const int w = 8, h = 6;
    std::string texture, depth;
    for (int frame = 0; frame < 3; ++frame) {
        // Grey of 8 bits, limited range: 16 is black, 235 white.
        texture += std::string(static_cast<std::size_t>(w * h), static_cast<char>(16 + 73 * frame));
        texture += std::string(static_cast<std::size_t>(w * h / 2), '\x80');
        for (int i = 0; i < w * h; ++i) {
            const int code = 20000 + 1000 * frame;
            depth += static_cast<char>(code & 255);
            depth += static_cast<char>(code >> 8);
        }
        depth += std::string(static_cast<std::size_t>(w * h), '\0');
    }
    writeText(folder / "a_texture_8x6_yuv420p.yuv", texture);
    writeText(folder / "a_depth_8x6_yuv420p16le.yuv", depth);
    writeText(folder / "list.json",
              "{\"cameras\":[" +
                  mivCamera("a", w, h,
                            R"("Projection":"Perspective","Focal":[5,5],"Principle_point":[4,3])") +
                  "]}");
    Job job;
    EXPECT_EQ(imageSetFrameCount(folder.path(), {}, job).value_or(0), 3);
    for (int frame = 0; frame < 3; ++frame) {
        ImageSetOptions options;
        options.frame = frame;
        const auto read = readSet(folder.path(), options);
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ(read->views[0].texture.rgba8()->at(3, 2),
                  glm::u8vec4(85 * frame, 85 * frame, 85 * frame, 255));
        EXPECT_NEAR(read->views[0].depth.at(3, 2), mivDepth(20000 + 1000 * frame), 1e-5);
    }
    // A mask for each frame: of frame k the first k + 1 rows.
    ImageSetOptions masked;
    masked.maskPattern = "mask_{frame:03}.png";
    for (int frame = 0; frame < 3; ++frame)
        writeCodes(folder / fmt::format("mask_{:03}.png", frame), w, h, 8,
                   [&](int, int y) { return y <= frame ? 255 : 0; });
    const auto film = openImageSet(folder.path(), masked, job);
    ASSERT_TRUE(film) << film.error().text();
    for (int frame = 0; frame < 3; ++frame) {
        const auto shown = (*film)->frame(static_cast<std::size_t>(frame), job);
        ASSERT_TRUE(shown) << shown.error().text();
        EXPECT_EQ(shown->views[0].pointCount(), w * (frame + 1));
    }
    ImageSetOptions second;
    second.every = 2;
    const auto thinned = openImageSet(folder.path(), second, job);
    ASSERT_TRUE(thinned) << thinned.error().text();
    EXPECT_EQ((*thinned)->timeline().count(), 2u);
    EXPECT_NEAR((*thinned)->timeline().end, 3 / 25.0, 1e-9) << "as long as it is with all frames";
    ImageSetOptions options;
    options.frame = 3;
    expectError(readSet(folder.path(), options), {"frame 3", "3"});
    writeText(folder / "a_texture_8x6_yuv420p.yuv", texture.substr(1));
    expectError(readSet(folder.path()), {"a_texture_8x6_yuv420p.yuv", "215 bytes", "8x6"});
    writeText(folder / "list.json",
              "{\"cameras\":[" + mivCamera("a", w, h, R"("Projection":"Fisheye")") + "]}");
    expectError(readSet(folder.path()), {"list.json", "cameras[0]", "Fisheye"});
}

TEST(CamerasJson, DepthImageCodesComeBackAndUnlikeSizesAreResampled) {
    const auto views = roomViews(1);
    const Camera& c = views[0].camera;
    TemporaryFolder folder;
    // Colour of twice the size.
    const ReferenceView large = viewOfAnalyticScene(AnalyticScene::room, c.resized(192, 128), 1);
    writeColour(folder / "t.png", large);
    const DepthCode code{0.1, 40, 65535};
    writeCodes(folder / "d.png", 96, 64, 16,
               [&](int x, int y) { return code.encode(views[0].depth.at(x, y)); });
    const glm::dvec4 a = axisAngleFromQuat(c.orientation);
    const auto json = [&](const std::string& more) {
        writeText(
            folder / "cameras.json",
            fmt::format("{{\"cameras\":[{{\"texture\":\"t.png\",\"depth\":\"d.png\",\"width\":"
                        "192,\"height\":128,\"position\":[{},{},{}],\"orientation\":[{},{},{},"
                        "{}],\"fx\":{},\"fy\":{},\"cx\":{},\"cy\":{}{}}}]}}",
                        c.position.x, c.position.y, c.position.z, a.x, a.y, a.z, a.w, 2 * c.fx,
                        2 * c.fy, 2 * c.cx, 2 * c.cy, more));
    };
    json(",\"nearPlane\":0.1,\"farPlane\":40");
    EXPECT_EQ(recogniseImageSet(folder.path()).value_or(""), "cameras");
    ImageSetOptions reduced;
    reduced.refine.set(RefineStep::raise, false);
    const auto read = readSet(folder.path(), reduced);
    ASSERT_TRUE(read) << read.error().text();
    expectSame(views[0], read->views[0], [&](double) { return code.step(); });
    // By default the depth is raised to the picture: nearly all of it as if it had been measured.
    const auto raised = readSet(folder.path());
    ASSERT_TRUE(raised) << raised.error().text();
    ASSERT_EQ(raised->views[0].depth.width(), 192);
    EXPECT_EQ(raised->views[0].camera.fx, 2 * c.fx);
    int good = 0;
    for (std::size_t i = 0; i < large.depth.count(); ++i)
        good += std::abs(raised->views[0].depth.data()[i] / large.depth.data()[i] - 1) < 0.02f;
    EXPECT_GT(good, 0.97 * large.depth.count());
    json("");
    expectError(readSet(folder.path()), {"d.png", "depthUnit"});
    json(",\"nearPlane\":40,\"farPlane\":0.1");
    expectError(readSet(folder.path()), {"cameras[0]", "nearPlane"});
}

/// Times of its poses are for films and paths of cameras.
TEST(CamerasJson, IsOfOneMomentWhateverItsTimes) {
    const auto views = roomViews(2, 24, 16);
    TemporaryFolder folder;
    std::string cameras;
    for (int i = 0; i < 2; ++i) {
        writeColour(folder / fmt::format("t{}.png", i), views[i]);
        writeCodes(folder / fmt::format("d{}.png", i), 24, 16, 16, [](int, int) { return 2000; });
        cameras +=
            fmt::format(R"({}{{"texture":"t{}.png","depth":"d{}.png","width":24,"height":16,)"
                        R"("position":[{},0,0],"orientation":[0,1,0,0],"fx":20,"time":{},)"
                        R"("depthUnit":0.001}})",
                        i ? "," : "", i, i, i, 0.5 * i);
    }
    writeText(folder / "cameras.json", "{\"cameras\":[" + cameras + "]}");
    Job job;
    const auto set = openImageSet(folder.path(), {}, job);
    ASSERT_TRUE(set) << set.error().text();
    EXPECT_FALSE((*set)->timeline().moves());
    EXPECT_EQ((*set)->frame(0, job)->views.size(), 2u);
    const auto named = readCameraFile(folder / "cameras.json", job);
    ASSERT_TRUE(named) << named.error().text();
    EXPECT_EQ(named->at(1).time, 0.5);
}

TEST(ExrSet, PartsOfTheirOwnAndDataWindowsAndCamerasFromAttributes) {
    const auto views = roomViews(1);
    const ReferenceView& v = views[0];
    TemporaryFolder folder;
    // Z lies in a window of its own inside the display window.
    const int x0 = 8, y0 = 6, w = 80, h = 50;
    Image<float> z(w, h);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) z.at(x, y) = v.depth.at(x + x0, y + y0);
    RgbaFloatImage colour(96, 64);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 96; ++x) colour.at(x, y) = glm::vec4(x / 96.0f, y / 64.0f, 0.5f, 1.0f);
    ExrPart rgba;
    rgba.name = "rgba";
    rgba.view = "main";
    rgba.width = rgba.displayWidth = 96;
    rgba.height = rgba.displayHeight = 64;
    for (const char* n : {"R", "G", "B", "A"})
        rgba.channels.push_back({n, ExrChannel::Type::float32});
    rgba.pixelAspectRatio = v.camera.fy / v.camera.fx;
    setExrCamera(rgba, v.camera, 0.1, 100);
    ExrPart depth = rgba;
    depth.name = "depth";
    depth.channels = {{"Z", ExrChannel::Type::float32}};
    depth.originX = x0;
    depth.originY = y0;
    depth.width = w;
    depth.height = h;
    depth.attributes.erase("worldToCamera");
    depth.attributes.erase("worldToNDC");
    {
        auto file = OutputFile::create(folder / "shot.exr");
        ASSERT_TRUE(file);
        auto writer = ExrWriter::create(*file, {rgba, depth});
        ASSERT_TRUE(writer) << writer.error().text();
        const float* at = &colour.data()->x;
        ASSERT_TRUE(writer->writePart(
            0, {{"R", at, 4}, {"G", at + 1, 4}, {"B", at + 2, 4}, {"A", at + 3, 4}}));
        ASSERT_TRUE(writer->writePart(1, {{"Z", z.data(), 1}}));
        ASSERT_TRUE(writer->finish());
        ASSERT_TRUE(file->commit());
    }
    EXPECT_EQ(recogniseImageSet(folder / "shot.exr").value_or(""), "exr");
    const auto read = readSet(folder / "shot.exr");
    ASSERT_TRUE(read) << read.error().text();
    const auto& out = read->views[0];
    EXPECT_EQ(out.name, "main");
    ASSERT_EQ(out.depth.size(), glm::ivec2(w, h));
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            const glm::dvec3 truth = v.worldPoint(x + x0, y + y0);
            // Attributes are single precision.
            ASSERT_LT(glm::length(out.worldPoint(x, y) - truth), 1e-5 * z.at(x, y));
            ASSERT_NEAR(out.texture.at(x, y).x, (x + x0) / 96.0, 1e-6);
        }
}

}  // namespace
