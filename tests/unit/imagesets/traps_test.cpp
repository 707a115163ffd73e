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

/// x' = x (1 + k1 r2 + k2 r4) + 2 p1 x y + p2 (r2 + 2 x2), y' = y (...) + p1 (r2 + 2 y2) + 2 p2 x
/// y, as COLMAP's and OpenCV's pages have it; its principal points count from the picture's corner.
glm::dvec2 distorted(glm::dvec2 pixel, glm::dvec2 f, glm::dvec2 c, double k1, double k2, double p1,
                     double p2) {
    const glm::dvec2 n = (pixel - c) / f;
    const double r2 = n.x * n.x + n.y * n.y, radial = 1 + k1 * r2 + k2 * r2 * r2;
    return {f.x * (n.x * radial + 2 * p1 * n.x * n.y + p2 * (r2 + 2 * n.x * n.x)) + c.x,
            f.y * (n.y * radial + p1 * (r2 + 2 * n.y * n.y) + 2 * p2 * n.x * n.y) + c.y};
}

/// A set of COLMAP's with one picture of 96x64, whose colours are positions, behind the lens of a
/// line of cameras.txt, and depthOf(pixel).
template <class DepthOf>
Result<Bundle> readThroughLens(const std::string& cameras, const DepthOf& depthOf, Job& job) {
    TemporaryFolder folder;
    writeText(folder / "sparse/cameras.txt", cameras);
    writeText(folder / "sparse/images.txt", "1 1 0 0 0 0 0 0 1 a.exr\n\n");
    writePositions(folder / "images/a.exr", 96, 64);
    std::string depth = "96&64&1&";
    for (int i = 0; i < 96 * 64; ++i) depth += floatBytes(depthOf(i));
    writeText(folder / "stereo/depth_maps/a.exr.geometric.bin", depth);
    ImageSetOptions options;
    options.refine.set(RefineStep::mixed, false);
    return readImageSet(folder.path(), options, job);
}

TEST(ColmapTraps, AFisheyeIsUndoneToAThousandthOfAPixel) {
    const double k[4] = {-0.04, 0.01, -0.003, 0.0005};
    for (const auto* line : {"OPENCV_FISHEYE 96 64 60 60 50 30 -0.04 0.01 -0.003 0.0005",
                             "SIMPLE_RADIAL_FISHEYE 96 64 60 50 30 -0.04"}) {
        const int terms = std::string_view(line).starts_with("SIMPLE") ? 1 : 4;
        Job job;
        const auto read = readThroughLens(
            fmt::format("1 {}\n", line), [](int) { return 2.0f; }, job);
        ASSERT_TRUE(read) << read.error().text();
        const ReferenceView& v = read->views[0];
        int checked = 0;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 96; ++x) {
                const glm::dvec2 n((x + 0.5 - 50) / 60, (y + 0.5 - 30) / 60);
                const double r = glm::length(n), t = std::atan(r);
                double bent = t;
                for (int i = 0; i < terms; ++i) bent += k[i] * std::pow(t, 2 * i + 3);
                const glm::dvec2 at = n / r * bent * 60.0 + glm::dvec2(50, 30);
                if (at.x < 2 || at.y < 2 || at.x > 94 || at.y > 62) continue;
                ASSERT_NEAR(v.texture.at(x, y).x, at.x, 1e-3) << line << " at " << x << "," << y;
                ASSERT_NEAR(v.texture.at(x, y).y, at.y, 1e-3) << line << " at " << x << "," << y;
                ++checked;
            }
        EXPECT_GT(checked, 5000);
    }
}

TEST(ColmapTraps, TheNoteSaysHowMuchOfAFisheyePictureIsCutAway) {
    for (const double f : {40.0, 60.0, 400.0}) {
        Job job;
        const auto read = readThroughLens(
            fmt::format("1 SIMPLE_RADIAL_FISHEYE 96 64 {} 50 30 0\n", f), [](int) { return 2.0f; },
            job);
        ASSERT_TRUE(read) << read.error().text();
        // The other way round: points of the fisheye's picture that the pinhole's does not have.
        int cut = 0, all = 0;
        for (double y = 0.125; y < 64; y += 0.25)
            for (double x = 0.125; x < 96; x += 0.25) {
                const glm::dvec2 bent(x - 50, y - 30);
                const double t = glm::length(bent) / f;
                const glm::dvec2 at = bent / t * std::tan(t) + glm::dvec2(50, 30);
                ++all;
                if (at.x < 0 || at.y < 0 || at.x > 96 || at.y > 64) ++cut;
            }
        const double percent = 100.0 * cut / all;
        const auto notes = job.takeNotes();
        const auto note = std::find_if(notes.begin(), notes.end(), [](const std::string& text) {
            return text.find("undone by resampling") != std::string::npos;
        });
        ASSERT_NE(note, notes.end());
        const auto at = note->find("; ");
        ASSERT_EQ(at == std::string::npos, percent < 0.5) << *note << " " << percent;
        if (at != std::string::npos) {
            EXPECT_NEAR(std::stod(note->substr(at + 2)), percent, 0.8) << *note;
            EXPECT_NE(note->find("% of the picture lie outside"), std::string::npos) << *note;
        }
    }
}

TEST(ColmapTraps, EachLensModelIsUndoneToAThousandthOfAPixel) {
    struct Model {
        std::string line;
        glm::dvec2 f;
        double k1, k2, p1, p2;
    };
    for (const Model& m : {Model{"SIMPLE_PINHOLE 96 64 80 50 30", {80, 80}, 0, 0, 0, 0},
                           Model{"SIMPLE_RADIAL 96 64 80 50 30 -0.11", {80, 80}, -0.11, 0, 0, 0},
                           Model{"RADIAL 96 64 80 50 30 0.07 -0.03", {80, 80}, 0.07, -0.03, 0, 0},
                           Model{"OPENCV 96 64 80 83 50 30 -0.12 0.04 0.003 -0.002",
                                 {80, 83},
                                 -0.12,
                                 0.04,
                                 0.003,
                                 -0.002}}) {
        Job job;
        const auto read = readThroughLens(
            "1 " + m.line + "\n", [](int i) { return i % 96 == 7 ? 0.0f : 2.0f; }, job);
        ASSERT_TRUE(read) << read.error().text();
        const auto notes = job.takeNotes();
        const bool ideal = m.k1 == 0;
        bool told = false;
        for (const auto& note : notes)
            told |= note.find("lens distortion of up to") != std::string::npos;
        EXPECT_EQ(told, !ideal);
        const ReferenceView& v = read->views[0];
        EXPECT_EQ(v.camera.fx, m.f.x);
        EXPECT_EQ(v.camera.fy, m.f.y);
        // The border that the picture does not show is cut off.
        const double left = 50 - v.camera.cx, top = 30 - v.camera.cy;
        EXPECT_EQ(left > 0, m.k1 > 0) << m.line;
        int checked = 0, unknown = 0;
        for (int y = 0; y < v.depth.height(); ++y)
            for (int x = 0; x < v.depth.width(); ++x) {
                unknown += hasPoint(v.depth.at(x, y)) ? 0 : 1;
                ASSERT_EQ(v.texture.at(x, y).a, 1) << m.line << " at " << x << "," << y;
                const auto at = distorted({left + x + 0.5, top + y + 0.5}, m.f, {50, 30}, m.k1,
                                          m.k2, m.p1, m.p2);
                // Beyond the outermost pixel centres there is nothing to interpolate between.
                if (at.x < 2 || at.y < 2 || at.x > 94 || at.y > 62) continue;
                ASSERT_NEAR(v.texture.at(x, y).x, at.x, 1e-3) << m.line << " at " << x << "," << y;
                ASSERT_NEAR(v.texture.at(x, y).y, at.y, 1e-3) << m.line << " at " << x << "," << y;
                ++checked;
            }
        EXPECT_GT(checked, 4500);
        EXPECT_GE(unknown, 50) << "a column of depth is 0: none";
    }
}

/// What a pinhole sees past the border of the picture is not known. It was "nothing is there",
/// which took away what other views show.
TEST(ColmapTraps, PastTheBorderOfALensIsNotEmpty) {
    Job job;
    const auto read = readThroughLens(
        "1 SIMPLE_RADIAL 96 64 60 48 32 0.25\n", [](int) { return 2.0f; }, job);
    ASSERT_TRUE(read) << read.error().text();
    const ReferenceView& v = read->views[0];
    EXPECT_EQ(v.noDepth, NoDepth::unknown);
    EXPECT_LT(v.camera.width, 96);
    EXPECT_EQ(v.camera.cx * 2, v.camera.width);
    EXPECT_EQ(v.camera.cy * 2, v.camera.height);
    EXPECT_EQ(v.pointCount(), v.camera.width * v.camera.height);
    for (const float z : v.depth.pixels()) ASSERT_NEAR(z, 2, 1e-3);
    std::string notes;
    for (const std::string& note : job.takeNotes()) notes += note + "\n";
    EXPECT_NE(
        notes.find(fmt::format("{}x{} of 96x64 pixels are left", v.camera.width, v.camera.height)),
        std::string::npos)
        << notes;
}

TEST(CamerasTraps, SkewIsRemovedAndItsSizeTold) {
    // The picture as it is, and half as large, as its depth is.
    for (const int shrunk : {1, 2}) {
        SCOPED_TRACE(shrunk);
        const int w = 96 / shrunk, h = 64 / shrunk;
        TemporaryFolder folder;
        writePositions(folder / "t.exr", 96, 64);
        writeCodes(folder / "d.png", w, h, 16, [](int, int) { return 2000; });
        writeText(
            folder / "cameras.json",
            "{\"cameras\":[{\"texture\":\"t.exr\",\"depth\":\"d.png\",\"width\":96,\"height\":64,"
            "\"position\":[0,0,0],\"quaternion\":[0,0,0,1],\"fx\":80,\"fy\":82,\"cx\":50,"
            "\"cy\":30,\"depthUnit\":0.001,\"skew\":2.5}]}");
        ImageSetOptions options;
        options.refine.set(RefineStep::raise, false);
        Job job;
        const auto read = readImageSet(folder.path(), options, job);
        ASSERT_TRUE(read) << read.error().text();
        std::string notes;
        for (const std::string& note : job.takeNotes()) notes += note + "\n";
        // Largest at the lower edge: 2.5 * (64 - 30) / 82.
        EXPECT_NE(notes.find(shrunk == 1 ? "skew of up to 1.04 pixels" : "skew of up to 0.52"),
                  std::string::npos)
            << notes;
        int checked = 0;
        const ReferenceView& v = read->views[0];
        const double left = 50.0 / shrunk - v.camera.cx;  // columns that the picture does not show
        for (int y = 0; y < v.depth.height(); ++y)
            for (int x = 0; x < v.depth.width(); ++x) {
                const glm::vec4 colour = v.texture.at(x, y);
                ASSERT_EQ(colour.a, 1);
                const glm::dvec2 p(shrunk * (left + x + 0.5), shrunk * (y + 0.5));
                const double at = p.x + 2.5 * (p.y - 30) / 82;
                if (at < 4 || at > 92 || p.y < 4 || p.y > 60) continue;
                ASSERT_NEAR(colour.x, at, 1e-3);
                ASSERT_NEAR(colour.y, p.y, 1e-3);
                ++checked;
            }
        EXPECT_GT(checked, 4500 / shrunk / shrunk);
    }
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

TEST(RgbdTraps, PublishedLensesOfTumsCamerasAreUsedAndTold) {
    struct Camera {
        std::string name;
        glm::dvec4 k;  // fx fy cx cy
        double d[5];   // as OpenCV has them: k1 k2 p1 p2 k3
    };
    // From the benchmark's page on file formats and calibration.
    for (const Camera& c :
         {Camera{"rgbd_dataset_freiburg1_desk",
                 {517.3, 516.5, 318.6, 255.3},
                 {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
          Camera{"rgbd_dataset_freiburg2_xyz",
                 {520.9, 521.0, 325.1, 249.7},
                 {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
          Camera{"rgbd_dataset_freiburg3_office", {535.4, 539.2, 320.1, 247.6}, {}}}) {
        TemporaryFolder parent;
        const auto folder = parent / c.name;
        writePositions(folder / "rgb/a.exr", 640, 480);
        writeCodes(folder / "depth/a.png", 640, 480, 16, [](int, int) { return 10000; });
        writeText(folder / "rgb.txt", "1.0 rgb/a.exr\n");
        writeText(folder / "depth.txt", "1.0 depth/a.png\n");
        writeText(folder / "groundtruth.txt", "1.0 0 0 0 0 0 0 1\n");
        Job job;
        const auto read = readImageSet(folder, {}, job);
        ASSERT_TRUE(read) << read.error().text();
        bool told = false;
        for (const auto& note : job.takeNotes())
            told |= note.find(c.name.substr(13, 9)) != std::string::npos;
        EXPECT_TRUE(told) << c.name;
        const ReferenceView& v = read->views[0];
        // The border that the picture does not show is cut off.
        const double left = c.k.z + 0.5 - v.camera.cx, top = c.k.w + 0.5 - v.camera.cy;
        EXPECT_EQ(left > 0.5, c.d[0] != 0);
        int checked = 0;
        for (int y = 0; y < v.depth.height(); y += 7)
            for (int x = 0; x < v.depth.width(); x += 7) {
                ASSERT_EQ(v.texture.at(x, y).a, 1);
                // Its pixel centres have whole numbers.
                const glm::dvec2 n((left + x - c.k.z) / c.k.x, (top + y - c.k.w) / c.k.y);
                const double r2 = glm::dot(n, n);
                const double radial = 1 + c.d[0] * r2 + c.d[1] * r2 * r2 + c.d[4] * r2 * r2 * r2;
                const glm::dvec2 at(c.k.x * (n.x * radial + 2 * c.d[2] * n.x * n.y +
                                             c.d[3] * (r2 + 2 * n.x * n.x)) +
                                        c.k.z + 0.5,
                                    c.k.y * (n.y * radial + c.d[2] * (r2 + 2 * n.y * n.y) +
                                             2 * c.d[3] * n.x * n.y) +
                                        c.k.w + 0.5);
                if (at.x < 2 || at.y < 2 || at.x > 638 || at.y > 478) continue;
                ASSERT_NEAR(v.texture.at(x, y).x, at.x, 1e-3) << c.name;
                ASSERT_NEAR(v.texture.at(x, y).y, at.y, 1e-3) << c.name;
                ++checked;
            }
        EXPECT_GT(checked, 5000);
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
