// The traps of the formats, one test each: what goes wrong in silence when it is overlooked.

#include <cmath>

#include "formats/imagesets/camera_file.hpp"
#include "formats/imagesets/kinds.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

/// Depth as renderers write it: in three equal channels, one of any name, with 1e10, infinity or 0
/// where there is nothing.
TEST(TransformsTraps, FloatDepthOfAnyLayoutAndItsNothings) {
    const auto view = roomViews(1)[0];
    const Camera& c = view.camera;
    auto depth = view.depth;
    depth.at(1, 1) = 1e10f;
    depth.at(2, 1) = INFINITY;
    depth.at(3, 1) = 0;
    depth.at(4, 1) = -1;
    depth.at(5, 1) = NAN;
    auto truth = view;
    for (int x = 1; x <= 5; ++x) truth.depth.at(x, 1) = kNoDepth;
    const Planes layouts[] = {
        {{"R", depth}, {"G", depth}, {"B", depth}},
        {{"V", depth}},
        {{"Z", depth}},
        {{"A", plane(96, 64, [](int, int) { return 1; })}, {"Depth.Z", depth}}};
    for (const Planes& layout : layouts) {
        TemporaryFolder folder;
        writeColour(folder / "a.png", view);
        writeExr(folder / "d.exr", layout);
        writeText(folder / "transforms.json",
                  fmt::format("{{\"w\":96,\"h\":64,\"fl_x\":{},\"fl_y\":{},\"cx\":{},\"cy\":{},"
                              "\"frames\":[{}]}}",
                              c.fx, c.fy, c.cx, c.cy,
                              transformsFrame(c.worldFromCamera(), ",\"depth_file_path\":\"d\"")));
        const auto read = readSet(folder.path());
        ASSERT_TRUE(read) << read.error().text() << " with " << layout[0].first;
        expectSame(truth, read->views[0]);
    }
}

TEST(TransformsTraps, AnglesAndIntrinsicsOfAFrameOfItsOwn) {
    TemporaryFolder folder;
    const auto views = roomViews(1);
    writeColour(folder / "a.png", views[0]);
    writeCodes(folder / "d.png", 96, 64, 16, [](int, int) { return 2000; });
    const std::string depth = ",\"depth_file_path\":\"d.png\"";
    writeText(folder / "transforms.json",
              "{\"camera_angle_x\":0.8,\"frames\":[" + transformsFrame(glm::dmat4(1), depth) + "," +
                  transformsFrame(glm::dmat4(1),
                                  depth + ",\"w\":96,\"h\":64,\"fl_x\":70,\"fl_y\":71,\"cx\":40,"
                                          "\"cy\":30") +
                  "]}");
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    const Camera &a = read->views[0].camera, &b = read->views[1].camera;
    // fx = w / 2 / tan(angle / 2), square pixels, the middle.
    EXPECT_NEAR(a.fx, 48 / std::tan(0.4), 1e-9);
    EXPECT_NEAR(a.fy, 48 / std::tan(0.4), 1e-9);
    EXPECT_EQ(a.cx, 48);
    EXPECT_EQ(a.cy, 32);
    EXPECT_EQ(glm::dvec4(b.fx, b.fy, b.cx, b.cy), glm::dvec4(70, 71, 40, 30));
}

TEST(TransformsTraps, AnglesHavePrincipalPointsToo) {
    TemporaryFolder folder;
    writeColour(folder / "a.png", roomViews(1)[0]);
    writeCodes(folder / "d.png", 96, 64, 16, [](int, int) { return 2000; });
    const std::string frame = transformsFrame(glm::dmat4(1), ",\"depth_file_path\":\"d.png\"");
    writeText(
        folder / "transforms.json",
        "{\"camera_angle_x\":0.8,\"fl_y\":90,\"cx\":30,\"cy\":40.5,\"frames\":[" + frame + "]}");
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    const Camera& c = read->views[0].camera;
    EXPECT_NEAR(c.fx, 48 / std::tan(0.4), 1e-9);
    EXPECT_EQ(glm::dvec3(c.fy, c.cx, c.cy), glm::dvec3(90, 30, 40.5));
    // Without pictures the principal point is taken for the middle.
    Job job;
    const auto cameras = readCameraFile(folder / "transforms.json", job);
    ASSERT_TRUE(cameras) << cameras.error().text();
    const Camera& alone = cameras->at(0).camera;
    EXPECT_EQ(glm::ivec2(alone.width, alone.height), glm::ivec2(60, 81));
    EXPECT_NEAR(alone.fx, 30 / std::tan(0.4), 1e-9);
    EXPECT_EQ(glm::dvec3(alone.fy, alone.cx, alone.cy), glm::dvec3(90, 30, 40.5));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("size; 60x81 is used"), std::string::npos) << notes[0];
}

TEST(TransformsTraps, AFramesOwnFocalLengthComesBeforeTheFiles) {
    TemporaryFolder folder;
    writeColour(folder / "a.png", roomViews(1)[0]);
    writeCodes(folder / "d.png", 96, 64, 16, [](int, int) { return 2000; });
    const auto camerasOf = [&](const std::string& file, const std::string& frame) {
        writeText(folder / "transforms.json",
                  "{\"w\":96,\"h\":64," + file + "\"frames\":[" +
                      transformsFrame(glm::dmat4(1), ",\"depth_file_path\":\"d.png\"" + frame) +
                      "]}");
        const auto read = readSet(folder.path());
        EXPECT_TRUE(read) << read.error().text();
        return read ? glm::dvec2(read->views[0].camera.fx, read->views[0].camera.fy)
                    : glm::dvec2(0);
    };
    const double fx = 48 / std::tan(0.4);
    const std::string both = "\"fl_x\":70,\"fl_y\":71,";
    const glm::dvec2 square = camerasOf(both, ",\"camera_angle_x\":0.8");
    EXPECT_NEAR(square.x, fx, 1e-9);
    EXPECT_NEAR(square.y, fx, 1e-9);
    const glm::dvec2 upright = camerasOf(both, ",\"camera_angle_y\":0.8");
    EXPECT_EQ(upright.x, 70);
    EXPECT_NEAR(upright.y, 32 / std::tan(0.4), 1e-9);
    EXPECT_EQ(camerasOf(both, ",\"fl_x\":80,\"camera_angle_x\":0.8"), glm::dvec2(80, 80));
    EXPECT_EQ(camerasOf("\"fl_y\":71,", ",\"fl_x\":80"), glm::dvec2(80, 71));
}

/// As at the end of nerfstudio's _generate_dataparser_outputs(): poses are s * T * p, and written
/// are T * A and s * a, with A and a of the transforms.json.
TEST(TransformsTraps, NerfstudiosScaleHoldsTheAppliedOne) {
    const glm::dvec3 p(1, 2, 3), t(0.5, -2, 3), shift(7, 0, -1);
    const double s = 0.25, a = 4;
    imagesets::SetView view;
    view.camera = Camera::fromFieldOfView(s * (p + t), {1, 0, 0, 0}, {1, 0.8}, false, 16, 12);
    const auto matrix = [](const glm::dvec3& move) {
        glm::dmat4 m(1);
        m[3] = glm::dvec4(move, 1);
        return imagesets::Json::parse(rowsOf(m));
    };
    const imagesets::Json dataparser = {{"transform", matrix(t + shift)}, {"scale", s * a}};
    imagesets::Json transforms = {{"applied_transform", matrix(shift)}, {"applied_scale", a}};
    Job job;
    std::vector<imagesets::SetView> views{view};
    ASSERT_TRUE(imagesets::undoDataparser(dataparser, &transforms, views, job));
    EXPECT_LT(glm::length(views[0].camera.position - p), 1e-12);
    transforms.erase("applied_transform");
    views = {view};
    const imagesets::Json unmoved = {{"transform", matrix(t)}, {"scale", s * a}};
    ASSERT_TRUE(imagesets::undoDataparser(unmoved, &transforms, views, job));
    EXPECT_LT(glm::length(views[0].camera.position - p), 1e-12);
    transforms["applied_scale"] = 0;
    const auto wrong = imagesets::undoDataparser(dataparser, &transforms, views, job);
    ASSERT_FALSE(wrong);
    EXPECT_EQ(wrong.error().text(), "transforms.json: 'applied_scale' is 0; it must be above 0");
}

TEST(TransformsTraps, RotationThatIsNotQuiteOneIsRepairedAndItsSizeTold) {
    TemporaryFolder folder;
    const auto view = roomViews(1)[0];
    const Camera& c = view.camera;
    writeColour(folder / "a.png", view);
    writeCodes(folder / "d.png", 96, 64, 16, [](int, int) { return 2000; });
    glm::dmat4 pose = c.worldFromCamera();
    pose[0] += 0.004 * pose[1];
    pose[1] += 0.004 * pose[0];
    writeText(folder / "transforms.json",
              fmt::format("{{\"w\":96,\"h\":64,\"fl_x\":{},\"frames\":[{}]}}", c.fx,
                          transformsFrame(pose, ",\"depth_file_path\":\"d.png\"")));
    Job job;
    const auto read = readImageSet(folder.path(), {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    // Sheared by 0.008: half of that for each column, times the focal length.
    EXPECT_NE(notes[0].find(fmt::format("repaired by up to {:.2g} pixels", 0.004 * c.fx)),
              std::string::npos)
        << notes[0];
    const Camera& got = read->views[0].camera;
    EXPECT_NEAR(glm::length(got.orientation), 1, 1e-12);
    EXPECT_GT(std::abs(glm::dot(got.orientation, c.orientation)), 1 - 1e-8);
}

TEST(MivTraps, FarOfAThousandIsInfinity) {
    TemporaryFolder folder;
    ReferenceView plain;
    plain.texture = Rgba8Image(40, 30, {10, 200, 30, 255});
    writeColour(folder / "a_texture.png", plain);
    writeCodes(folder / "a_depth.png", 40, 30, 16,
               [](int x, int y) { return 1000 + 1000 * x + y; });
    for (const auto& [range, endless] : {std::pair{"[0.5,1000]", true}, {"[0.5,999]", false}}) {
        writeText(folder / "list.json", mivJson(40, 30, range));
        const auto read = readSet(folder.path());
        ASSERT_TRUE(read) << read.error().text();
        for (int y = 0; y < 30; ++y)
            for (int x = 0; x < 40; ++x) {
                const double s = (1000 + 1000 * x + y) / 65535.0;
                const double z = endless ? 0.5 / s : 0.5 * 999 / (0.5 + s * (999 - 0.5));
                ASSERT_NEAR(read->views[0].depth.at(x, y), z, 1e-6 * z) << range;
            }
    }
    // z = 1000 at s = 0 in either way, but 2 % apart at the code 1000: the two must differ.
    EXPECT_GT(std::abs(0.5 / (1000 / 65535.0) - 0.5 * 999 / (0.5 + 1000 / 65535.0 * 998.5)), 0.5);
}

/// Y, Cb, Cr of a colour by the definitions of BT.601 and BT.709, in codes of `bits`.
glm::dvec3 yuvOf(glm::dvec3 rgb, bool bt601, bool full, int bits) {
    const double kr = bt601 ? 0.299 : 0.2126, kb = bt601 ? 0.114 : 0.0722;
    const double y = kr * rgb.r + (1 - kr - kb) * rgb.g + kb * rgb.b;
    const double cb = (rgb.b - y) / (2 * (1 - kb)), cr = (rgb.r - y) / (2 * (1 - kr));
    const double unit = std::exp2(bits - 8), most = std::exp2(bits) - 1;
    if (full) return {y * most, cb * most + 128 * unit, cr * most + 128 * unit};
    return {(16 + 219 * y) * unit, (128 + 224 * cb) * unit, (128 + 224 * cr) * unit};
}

TEST(MivTraps, YuvMatricesAndRangesOf8And10Bits) {
    const glm::dvec3 colour(200 / 255.0, 90 / 255.0, 40 / 255.0);
    for (const int bits : {8, 10})
        for (const bool bt601 : {false, true})
            for (const bool full : {false, true}) {
                TemporaryFolder folder;
                const auto yuv = yuvOf(colour, bt601, full, bits);
                std::string planes;
                for (const auto& [code, count] :
                     {std::pair{yuv.x, 8 * 6}, {yuv.y, 4 * 3}, {yuv.z, 4 * 3}})
                    for (int i = 0; i < count; ++i) {
                        const auto v = std::lround(code);
                        planes += static_cast<char>(v & 255);
                        if (bits > 8) planes += static_cast<char>(v >> 8);
                    }
                writeText(
                    folder / fmt::format("a_texture_8x6_yuv420p{}.yuv", bits > 8 ? "10le" : ""),
                    planes);
                writeCodes(folder / "a_depth.png", 8, 6, 16, [](int, int) { return 30000; });
                writeText(folder / "list.json", mivJson(8, 6, "[1,20]", bits));
                ImageSetOptions options;
                options.yuv = {bt601 ? YuvMatrix::bt601 : YuvMatrix::bt709, full};
                const auto read = readSet(folder.path(), options);
                ASSERT_TRUE(read) << read.error().text();
                const glm::dvec3 got(read->views[0].texture.rgba8()->at(3, 2));
                // Codes are rounded: half a step of Y, Cb and Cr each.
                const double allowed = bits == 8 ? 2.0 : 1.0;
                for (int k = 0; k < 3; ++k)
                    EXPECT_NEAR(got[k], colour[k] * 255, allowed)
                        << bits << " bits, 601 " << bt601 << ", full " << full << ", channel " << k;
            }
}

TEST(MiddleburyTraps, BigEndianFloatsAndOlderSetsWithUnknownPixels) {
    TemporaryFolder folder;
    ReferenceView plain;
    plain.texture = Rgba8Image(96, 64, {10, 200, 30, 255});
    writeColour(folder / "im0.png", plain);
    std::string pfm = "Pf\n96 64\n1.0\n";  // a positive scale: big-endian
    for (int y = 63; y >= 0; --y)
        for (int x = 0; x < 96; ++x)
            pfm += floatBytes(static_cast<float>(10 + x * 0.25 + y * 0.5), false);
    writeText(folder / "disp0.pfm", pfm);
    writeText(folder / "calib.txt",
              "cam0=[90 0 40; 0 90 30; 0 0 1]\ncam1=[90 0 47; 0 90 30; 0 0 1]\n"
              "doffs=7\nbaseline=0.2\nwidth=96\nheight=64\nndisp=64\n");
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 96; ++x)
            ASSERT_NEAR(read->views[0].depth.at(x, y), 0.2 * 90 / (10 + x * 0.25 + y * 0.5 + 7),
                        1e-6);
    EXPECT_EQ(read->views[0].camera.cx, 40.5);

    TemporaryFolder older;
    writeColour(older / "view1.png", plain);
    writeColour(older / "view5.png", plain);
    for (const char* name : {"disp1.png", "disp5.png"})
        writeCodes(older / name, 96, 64, 8,
                   [](int x, int y) { return x == y ? 0 : 20 + 5 * (x % 40); });
    ImageSetOptions options;
    options.focal = 90;
    options.baseline = 0.2;
    options.disparityOffset = 30;
    options.refine.set(RefineStep::gaps, false);
    const auto pair = readSet(older.path(), options);
    ASSERT_TRUE(pair) << pair.error().text();
    ASSERT_EQ(pair->views.size(), 2u);
    for (const auto& view : pair->views)
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 96; ++x) {
                if (x == y) {
                    ASSERT_FALSE(hasPoint(view.depth.at(x, y)));
                } else {
                    // Steps of 5 are no stairs: nothing is smoothed.
                    ASSERT_NEAR(view.depth.at(x, y), 0.2 * 90 / (20 + 5 * (x % 40) + 30), 1e-6);
                }
            }
    // A point of disparity d is at x in view 1 and at x - d in view 5.
    const glm::dvec3 p = pair->views[0].worldPoint(60, 20);
    const Camera& c5 = pair->views[1].camera;
    EXPECT_NEAR(c5.project(glm::dvec3(c5.cameraFromWorld() * glm::dvec4(p, 1))).x,
                60.5 - (20 + 5 * (60 % 40)), 1e-4);
}

TEST(RgbdTraps, NegativeFocalLengthTurnsThePictureNotTheScene) {
    // ICL-NUIM: fy < 0, so its camera's y points up; poses and depth as ever.
    TemporaryFolder folder;
    ReferenceView plain;
    plain.texture = Rgba8Image(64, 48, {10, 200, 30, 255});
    writeColour(folder / "color/1.png", plain);
    writeCodes(folder / "depth/1.png", 64, 48, 16,
               [](int x, int y) { return 5000 + 20 * x + 30 * y; });
    writeText(folder / "pose.txt", "0.1 0.2 0.3 0.1 0.2 0.3 0.9273618495495703\n");
    ImageSetOptions options;
    const double k[4] = {50, -49, 31.5, 23.5};
    std::copy(k, k + 4, options.intrinsics);
    const auto read = readSet(folder.path(), options);
    ASSERT_TRUE(read) << read.error().text();
    const glm::dmat3 r =
        glm::mat3_cast(glm::normalize(glm::dquat(0.9273618495495703, 0.1, 0.2, 0.3)));
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) {
            const double z = (5000 + 20 * x + 30 * y) / 5000.0;
            glm::dvec3 p = r * glm::dvec3((x - 31.5) / 50 * z, (y - 23.5) / -49 * z, z) +
                           glm::dvec3(0.1, 0.2, 0.3);
            p.z = -p.z;  // its world is left-handed
            ASSERT_LT(glm::length(read->views[0].worldPoint(x, y) - p), 1e-5 * z);
        }
}

/// Calibrations have five digits, so rotations are only nearly that, and a skew.
TEST(MsrTraps, SkewAndRotationOfFiveDigits) {
    TemporaryFolder folder;
    const int w = 60, h = 40;
    const glm::dmat3 r = glm::mat3_cast(quatFromAxisAngle({0.2, 0.9, 0.1, 0.3}));
    const glm::dvec3 c(2, -1, 0.5), t = -(r * c);
    std::string text = "0\n80 1.5 28\n0 82 17\n0 0 1\n0\n0\n";
    for (int row = 0; row < 3; ++row)
        text += fmt::format("{:.5f} {:.5f} {:.5f} {}\n", r[0][row] + (row == 1 ? 0.002 : 0),
                            r[1][row], r[2][row], t[row]);
    writeText(folder / "calibParams-test.txt", text);
    writePositions(folder / "t.exr", w, h);
    writeCodes(folder / "d.png", w, h, 8, [](int x, int y) { return (x * 4 + y * 3) % 256; });
    ImageSetOptions options;
    options.depthMin = 44;
    options.depthMax = 120;
    options.texturePattern = "t.exr";
    options.depthPattern = "d.png";
    Job job;
    const auto read = readImageSet(folder.path(), options, job);
    ASSERT_TRUE(read) << read.error().text();
    std::string notes;
    for (const auto& note : job.takeNotes()) notes += note + "\n";
    EXPECT_NE(notes.find("not quite orthonormal; repaired by up to 0."), std::string::npos)
        << notes;
    // Rows count upward: the skew is largest at the top, 1.5 * (40 - 0.5 - 17) / 82.
    EXPECT_NE(notes.find("skew of up to 0.41 pixels"), std::string::npos) << notes;
    int checked = 0;
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
            if (read->views[0].texture.at(x, y).a < 1) continue;
            const double up = (h - 1 - y - 17) / 82.0, at = x + 0.5 + 1.5 * up;
            if (at < 2 || at > w - 2) continue;
            ASSERT_NEAR(read->views[0].texture.at(x, y).x, at, 1e-3);
            ++checked;
        }
    EXPECT_GT(checked, 2000);
}

TEST(ExrTraps, StereoOfSeveralPartsWithCamerasFromAJsonBeside) {
    TemporaryFolder folder;
    const auto views = roomViews(2);
    std::vector<ExrPart> parts;
    for (const char* side : {"left", "right"})
        for (const char* what : {"rgba", "depth"}) {
            ExrPart part;
            part.name = fmt::format("{}.{}", what, side);
            part.view = side;
            part.width = part.displayWidth = 96;
            part.height = part.displayHeight = 64;
            for (const char* n : {"R", "G", "B"})
                if (what[0] == 'r') part.channels.push_back({n});
            if (what[0] == 'd') part.channels.push_back({"Z"});
            parts.push_back(part);
        }
    {
        auto file = OutputFile::create(folder / "shot.exr");
        ASSERT_TRUE(file);
        auto writer = ExrWriter::create(*file, parts);
        ASSERT_TRUE(writer) << writer.error().text();
        for (int i = 0; i < 2; ++i) {
            const auto grey = plane(96, 64, [&](int, int) { return 0.25 + 0.5 * i; });
            ASSERT_TRUE(writer->writePart(
                2 * i, {{"R", grey.data()}, {"G", grey.data()}, {"B", grey.data()}}));
            ASSERT_TRUE(writer->writePart(
                2 * i + 1, {{"Z", views[static_cast<std::size_t>(i)].depth.data()}}));
        }
        ASSERT_TRUE(writer->finish());
        ASSERT_TRUE(file->commit());
    }
    expectError(readSet(folder / "shot.exr"), {"shot.exr", "left", "no camera"});
    // In the other order: by name, not by place.
    std::string cameras;
    for (const int i : {1, 0}) {
        const Camera& c = views[static_cast<std::size_t>(i)].camera;
        cameras += fmt::format(
            "{}{{\"name\":\"{}\",\"width\":96,\"height\":64,\"position\":[{},{},{}],"
            "\"quaternion\":[{},{},{},{}],\"fx\":{},\"fy\":{},\"cx\":{},\"cy\":{}}}",
            cameras.empty() ? "" : ",", i == 0 ? "left" : "right", c.position.x, c.position.y,
            c.position.z, c.orientation.x, c.orientation.y, c.orientation.z, c.orientation.w, c.fx,
            c.fy, c.cx, c.cy);
    }
    writeText(folder / "shot.json", "{\"cameras\":[" + cameras + "]}");
    const auto read = readSet(folder / "shot.exr");
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 2u);
    for (int i = 0; i < 2; ++i) {
        const auto& view = read->views[static_cast<std::size_t>(i)];
        EXPECT_EQ(view.name, i == 0 ? "left" : "right");
        expectSame(views[static_cast<std::size_t>(i)], view);
        EXPECT_TRUE(view.texture.isLinear());
        EXPECT_NEAR(view.texture.at(5, 5).x, 0.25 + 0.5 * i, 1e-6);
    }
    writeText(folder / "shot.json", "{\"cameras\":[]}");
    expectError(readSet(folder / "shot.exr"), {"shot.json", "no camera"});
}

TEST(PanoramaTraps, ColoursAndPolesAreWhereTheirDirectionsAre) {
    // Each pixel's colour is its direction; a cube of half side 2 around the camera has planar
    // distance 2 on every face.
    TemporaryFolder folder;
    const int w = 1024, h = 512;
    const auto direction = [&](int x, int y) {
        const double longitude = 3.14159265358979 * (1 - 2 * (x + 0.5) / w);
        const double latitude = 3.14159265358979 * (0.5 - (y + 0.5) / h);
        return glm::dvec3(-std::sin(longitude) * std::cos(latitude), std::sin(latitude),
                          -std::cos(longitude) * std::cos(latitude));
    };
    const auto along = [&](int k) {
        return plane(w, h, [&](int x, int y) { return 2 + direction(x, y)[k]; });
    };
    writeExr(folder / "picture.exr", {{"R", along(0)}, {"G", along(1)}, {"B", along(2)}});
    writeExr(folder / "depth.exr", {{"Z", plane(w, h, [&](int x, int y) {
                                         const auto d = glm::abs(direction(x, y));
                                         return 2 / std::max({d.x, d.y, d.z});
                                     })}});
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 6u);
    double worst = 0, worstDepth = 0;
    for (const auto& view : read->views) {
        EXPECT_EQ(view.pointCount(), view.camera.width * view.camera.height);
        for (int y = 0; y < view.camera.height; ++y)
            for (int x = 0; x < view.camera.width; ++x) {
                const glm::dvec3 p = view.worldPoint(x, y);
                const auto c = view.texture.at(x, y);
                worst = std::max(worst, glm::length(glm::dvec3(c) - 2.0 - glm::normalize(p)));
                // On the cube itself; its edges are rounded by interpolation.
                const auto a = glm::abs(p);
                const double second =
                    a.x + a.y + a.z - std::max({a.x, a.y, a.z}) - std::min({a.x, a.y, a.z});
                if (second < 1.85)
                    worstDepth = std::max(worstDepth, std::abs(std::max({a.x, a.y, a.z}) - 2));
            }
    }
    // A tenth of a pixel (0.35 degrees, 0.006 radians) in colour, the poles included.
    EXPECT_LT(worst, 6e-4);
    EXPECT_LT(worstDepth, 5e-4);
    std::printf("panorama: colours within %.2g, distances within %.2g of 2\n", worst, worstDepth);
}

}  // namespace
