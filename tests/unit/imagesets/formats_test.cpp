// Each format written from an exact scene and read back, with the traps of its conventions.

#include <cmath>

#include "formats/exr/bundle_exr.hpp"
#include "formats/images/npy.hpp"
#include "formats/imagesets/camera_file.hpp"
#include "formats/imagesets/lens.hpp"
#include "formats/imagesets/msr.hpp"
#include "formats/imagesets/panorama.hpp"
#include "formats/imagesets/rgbd.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

std::string colmapDepth(const ReferenceView& v) {
    std::string out = fmt::format("{}&{}&1&", v.depth.width(), v.depth.height());
    for (const float d : v.depth.pixels()) out += floatBytes(hasPoint(d) ? d : 0.0f);
    return out;
}

std::string little(std::uint64_t value, int size) {
    std::string out;
    for (int i = 0; i < size; ++i) out += static_cast<char>(value >> (8 * i) & 255);
    return out;
}
std::string doubles(std::initializer_list<double> values) {
    std::string out;
    for (const double v : values) out += little(std::bit_cast<std::uint64_t>(v), 8);
    return out;
}

void writeColmap(const std::filesystem::path& root, const std::vector<ReferenceView>& views,
                 bool binary) {
    std::string cameras = binary ? little(views.size(), 8) : "# Camera list\n";
    std::string images = binary ? little(views.size(), 8) : "# Image list\n";
    for (std::size_t i = 0; i < views.size(); ++i) {
        const Camera& c = views[i].camera;
        const glm::dmat3 r = glm::transpose(visionRotation(c));
        const glm::dquat q = glm::quat_cast(r);
        const glm::dvec3 t = -(r * c.position);
        const std::string name = views[i].name + ".png";
        if (binary) {
            cameras += little(i + 1, 4) + little(1, 4) + little(c.width, 8) + little(c.height, 8) +
                       doubles({c.fx, c.fy, c.cx, c.cy});
            images += little(i + 1, 4) + doubles({q.w, q.x, q.y, q.z, t.x, t.y, t.z}) +
                      little(i + 1, 4) + name + '\0' + little(1, 8) + doubles({1, 2}) +
                      little(7, 8);
        } else {
            cameras += fmt::format("{} PINHOLE {} {} {} {} {} {}\n", i + 1, c.width, c.height, c.fx,
                                   c.fy, c.cx, c.cy);
            // The line of points may be empty.
            images += fmt::format("{} {} {} {} {} {} {} {} {} {}\n\n", i + 1, q.w, q.x, q.y, q.z,
                                  t.x, t.y, t.z, i + 1, name);
        }
        writeColour(root / "images" / name, views[i]);
        writeText(root / "stereo/depth_maps" / (name + ".geometric.bin"), colmapDepth(views[i]));
    }
    writeText(root / "sparse" / (binary ? "cameras.bin" : "cameras.txt"), cameras);
    writeText(root / "sparse" / (binary ? "images.bin" : "images.txt"), images);
}

ImageSetOptions keepAll() {
    ImageSetOptions options;
    options.refine.set(RefineStep::mixed, false);
    return options;
}

TEST(Colmap, TextAndBinaryComeBackExactly) {
    const auto views = roomViews();
    for (const bool binary : {false, true}) {
        TemporaryFolder folder;
        writeColmap(folder.path(), views, binary);
        EXPECT_EQ(recogniseImageSet(folder.path()).value_or(""), "colmap");
        const auto read = readSet(folder.path(), keepAll());
        ASSERT_TRUE(read) << read.error().text();
        ASSERT_EQ(read->views.size(), 2u);
        for (int i = 0; i < 2; ++i) expectSame(views[i], read->views[i]);
    }
}

TEST(Colmap, CutShortAndUnknownModelsAreErrors) {
    const auto views = roomViews(1);
    TemporaryFolder folder;
    writeColmap(folder.path(), views, true);
    std::filesystem::resize_file(folder / "sparse/images.bin", 50);
    expectError(readSet(folder.path()), {"images.bin", "cut short"});
    writeText(folder / "sparse/cameras.bin",
              little(1, 8) + little(1, 4) + little(6, 4) + little(4, 8) + little(4, 8));
    expectError(readSet(folder.path()), {"cameras.bin", "FULL_OPENCV", "PINHOLE"});
}

/// Else every second image would be taken for the points of the one before.
TEST(Colmap, ImagesWithoutTheirLinesOfPointsAreAnError) {
    const auto views = roomViews();
    TemporaryFolder folder;
    writeColmap(folder.path(), views, false);
    const auto file = folder / "sparse/images.txt";
    const auto bytes = readFile(file, {});
    ASSERT_TRUE(bytes);
    std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    const auto replaced = [&](const std::string& by) {
        std::string other = text;
        for (std::size_t at = 0; (at = other.find(".png\n\n", at)) != std::string::npos;)
            other.replace(at, 6, ".png\n" + by);
        writeText(file, other);
        return readSet(folder.path(), keepAll());
    };
    const auto with = replaced("12.5 7.25 -1 3 4 88 \r\n");
    ASSERT_TRUE(with) << with.error().text();
    EXPECT_EQ(with->views.size(), 2u);
    expectError(replaced(""), {"images.txt", "line 3", "'v1.png' where a line of points",
                               "'X Y POINT3D_ID'", "may be empty"});
}

/// A camera by which no image was taken may be of any model; sparse/ is a name of the model, too.
TEST(Colmap, OnlyCamerasInUseMatter) {
    const auto views = roomViews(1);
    TemporaryFolder folder;
    writeColmap(folder.path(), views, false);
    const auto file = folder / "sparse/cameras.txt";
    const auto bytes = readFile(file, {});
    ASSERT_TRUE(bytes);
    const std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    writeText(file, text + "\n77 FOV 96 64 80 80 48 32 0.9\n");
    const auto read = readSet(folder.path(), keepAll());
    ASSERT_TRUE(read) << read.error().text();
    expectSame(views[0], read->views[0]);
    std::filesystem::create_directory(folder / "sparse/0");
    for (const char* name : {"cameras.txt", "images.txt"})
        std::filesystem::rename(folder / "sparse" / name, folder / "sparse/0" / name);
    EXPECT_EQ(recogniseImageSet(folder / "sparse").value_or(""), "colmap");
    EXPECT_TRUE(readSet(folder / "sparse"));
}

/// Those of binary models, too, of which the number of parameters must be known.
TEST(Colmap, UnusedCamerasOfNewerModelsAreReadOver) {
    const auto views = roomViews(1);
    TemporaryFolder folder;
    writeColmap(folder.path(), views, true);
    const auto bytes = readFile(folder / "sparse/cameras.bin", {});
    ASSERT_TRUE(bytes);
    std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    text.replace(0, 8, little(2, 8));
    constexpr int kRadTanThinPrismFisheye = 11, kParameters = 16;
    text += little(99, 4) + little(kRadTanThinPrismFisheye, 4) + little(96, 8) + little(64, 8);
    for (int i = 0; i < kParameters; ++i) text += doubles({i < 4 ? 50.0 : 0.0});
    writeText(folder / "sparse/cameras.bin", text);
    const auto read = readSet(folder.path(), keepAll());
    ASSERT_TRUE(read) << read.error().text();
    expectSame(views[0], read->views[0]);
}

/// Views of a set and pictures of its cameras come in one order, whatever numbers COLMAP gave.
TEST(Colmap, ViewsAndCamerasAreInTheOrderOfNumbersInNames) {
    auto views = roomViews(3);
    views[0].name = "frame10";
    views[1].name = "frame2";
    views[2].name = "frame1";
    TemporaryFolder folder;
    writeColmap(folder.path(), views, true);
    const auto read = readSet(folder.path(), keepAll());
    ASSERT_TRUE(read) << read.error().text();
    Job job;
    const auto cameras = readCameraFile(folder.path(), job);
    ASSERT_TRUE(cameras) << cameras.error().text();
    ASSERT_EQ(read->views.size(), 3u);
    ASSERT_EQ(cameras->size(), 3u);
    const char* names[3] = {"frame1", "frame2", "frame10"};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(read->views[i].name, names[i]);
        EXPECT_EQ(cameras->at(i).name, names[i]);
    }
}

TEST(Msr, CheckValues) {
    EXPECT_NEAR(imagesets::msrWorldZ(128, 42, 130), 63.3612, 5e-5);
    EXPECT_NEAR(imagesets::msrWorldZ(128, 44, 120), 64.2734, 5e-5);
    EXPECT_NEAR(imagesets::msrWorldZ(0, 42, 130), 130, 1e-12);
}

/// Cameras turned against the world: own-axis z and the flip would both be seen.
TEST(Msr, OriginIsBottomLeftAndDepthIsTheWorldsZ) {
    TemporaryFolder folder;
    const int w = 60, h = 40;
    std::string text;
    std::vector<glm::dmat3> rotations;
    std::vector<glm::dvec3> centres;
    for (int i = 0; i < 2; ++i) {
        // File's axes: x right, y up (v counts upward), z forward.
        const glm::dmat3 r =
            glm::mat3_cast(quatFromAxisAngle({0.2, 0.9, 0.1, i == 0 ? 0.3 : -0.2}));
        const glm::dvec3 c(2.0 * i, -1.0, 0.5);
        const glm::dvec3 t = -(r * c);
        rotations.push_back(r);
        centres.push_back(c);
        text += fmt::format("{}\n80 0 28\n0 82 17\n0 0 1\n0\n0\n", i);
        for (int row = 0; row < 3; ++row)
            text += fmt::format("{} {} {} {}\n", r[0][row], r[1][row], r[2][row], t[row]);
        ReferenceView view;
        view.texture = Rgba8Image(w, h, {10, 20, 30, 255});
        writeColour(folder / fmt::format("cam{0}/color-cam{0}-f000.png", i), view);
        writeCodes(folder / fmt::format("cam{0}/depth-cam{0}-f000.png", i), w, h, 8,
                   [&](int x, int y) { return (x * 4 + y * 3) % 256; });
    }
    writeText(folder / "calibParams-test.txt", text);
    expectError(readSet(folder.path()), {"--depth-range", "calibParams-test.txt"});
    ImageSetOptions options;
    options.depthMin = 44;
    options.depthMax = 120;
    const auto read = readSet(folder.path(), options);
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 2u);
    for (int i = 0; i < 2; ++i) {
        const auto& view = read->views[static_cast<std::size_t>(i)];
        EXPECT_EQ(view.pointCount(), w * h);  // d = 0 is a valid far depth
        for (int y = 0; y < h; ++y) {
            for (int x = 0; x < w; ++x) {
                // The world is left-handed: our z is its negative.
                glm::dvec3 p = view.worldPoint(x, y);
                p.z = -p.z;
                const double z = imagesets::msrWorldZ((x * 4 + y * 3) % 256, 44, 120);
                ASSERT_NEAR(p.z, z, 1e-5 * z);
                const glm::dvec3 c = rotations[i] * (p - centres[i]);
                ASSERT_NEAR(80 * c.x / c.z + 28, x, 2e-4);
                ASSERT_NEAR(82 * c.y / c.z + 17, h - 1 - y, 2e-4);
            }
        }
    }
    writeText(folder / "calibParams-test.txt", text.substr(0, text.size() - 30));
    expectError(readSet(folder.path(), options), {"calibParams-test.txt", "camera 1", "cut short"});
}

TEST(Middlebury, PfmDisparityComesBackExactly) {
    TemporaryFolder folder;
    Camera camera = analyticCamera(AnalyticScene::room, 0, 1).resized(96, 64);
    camera.position = {0, 0, 0};
    camera.orientation = {1, 0, 0, 0};
    camera.fy = camera.fx;
    camera.cx = 40.5;
    camera.cy = 30.5;
    const double baseline = 0.2, doffs = 7;
    std::vector<ReferenceView> truth;
    for (int i = 0; i < 2; ++i) {
        Camera c = camera;
        c.position.x += i * baseline;
        c.cx += i * doffs;
        truth.push_back(viewOfAnalyticScene(AnalyticScene::room, c, 1));
        truth.back().depth.at(3, 5) = kNoDepth;
        writeColour(folder / fmt::format("im{}.png", i), truth.back());
        for (const bool little : {true}) {
            std::string pfm = "Pf\n96 64\n-1.0\n";
            for (int y = 63; y >= 0; --y)  // rows from the bottom
                for (int x = 0; x < 96; ++x) {
                    const float d = truth.back().depth.at(x, y);
                    pfm += floatBytes(
                        hasPoint(d) ? static_cast<float>(baseline * c.fx / d - doffs) : INFINITY,
                        little);
                }
            writeText(folder / fmt::format("disp{}.pfm", i), pfm);
        }
    }
    writeText(folder / "calib.txt",
              fmt::format("cam0=[{0} 0 40; 0 {0} 30; 0 0 1]\ncam1=[{0} 0 47; 0 {0} 30; 0 0 1]\n"
                          "doffs={1}\nbaseline={2}\nwidth=96\nheight=64\nndisp=64\n",
                          camera.fx, doffs, baseline));
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 2u);
    for (int i = 0; i < 2; ++i)
        expectSame(truth[i], read->views[i], [](double d) { return 2e-6 * d * d; });
    writeText(folder / "calib.txt", "cam0=[1 0 40; 0 1 30; 0 0 1]\n");
    expectError(readSet(folder.path()), {"calib.txt", "cam1", "missing"});
}

TEST(Rgbd, TumRecordingsAreAssociatedByTime) {
    auto views = roomViews();
    for (ReferenceView& view : views) view.depth.at(5, 4) = kNoDepth;
    TemporaryFolder folder;
    std::string rgb = "# colour\n", depth, poses = "# t tx ty tz qx qy qz qw\n";
    for (std::size_t i = 0; i < 2; ++i) {
        const auto& v = views[i];
        const glm::dquat q = glm::quat_cast(visionRotation(v.camera));
        writeColour(folder / fmt::format("rgb/{}.png", i), v);
        writeCodes(folder / fmt::format("depth/{}.png", i), 96, 64, 16, [&](int x, int y) {
            return x == 5 && y == 4 ? 65535L : std::lround(v.depth.at(x, y) * 5000);
        });
        rgb += fmt::format("{} rgb/{}.png\n", 10.0 + i, i);
        depth += fmt::format("{} depth/{}.png\n", 10.01 + i, i);
        for (const double dt : {-0.005, 0.005})
            poses += fmt::format("{} {} {} {} {} {} {} {}\n", 10.0 + i + dt, v.camera.position.x,
                                 v.camera.position.y, v.camera.position.z, q.x, q.y, q.z, q.w);
    }
    rgb += "20.0 rgb/1.png\n";  // without depth and pose
    writeText(folder / "rgb.txt", rgb);
    writeText(folder / "depth.txt", depth);
    writeText(folder / "groundtruth.txt", poses);
    const Camera& c = views[0].camera;
    writeText(folder / "intrinsics.txt",
              fmt::format("{} {} {} {}\n", c.fx, c.fy, c.cx - 0.5, c.cy - 0.5));
    const auto read = readSet(folder.path(), keepAll());
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 2u);
    for (int i = 0; i < 2; ++i) expectSame(views[i], read->views[i], [](double) { return 0.0001; });
    writeText(folder / "groundtruth.txt", "1 2 3\n");
    expectError(readSet(folder.path()), {"groundtruth.txt", "line 1", "3 numbers"});
}

/// Of two colour images near one depth image the nearer one has it, and the other one none.
TEST(Rgbd, ADepthImageOfTumIsUsedOnceAndByTheNearest) {
    const auto views = roomViews(1);
    TemporaryFolder folder;
    const auto line = [](double time, const char* what) {
        return fmt::format("{} {}\n", time, what);
    };
    const std::string pose = " 0 0 0 0 0 0 1\n";
    // Times between the pictures' are 0.018, 0.012, 0.018 and 0.002 s: all below 0.02.
    for (const char* name : {"a.png", "b.png", "c.png"}) writeColour(folder / name, views[0]);
    for (const int i : {0, 1})
        writeCodes(folder / fmt::format("d{}.png", i), 96, 64, 16,
                   [i](int, int) { return 5000 * (i + 1); });
    writeText(folder / "rgb.txt",
              line(10.0, "a.png") + line(10.03, "b.png") + line(10.05, "c.png"));
    writeText(folder / "depth.txt", line(10.018, "d0.png") + line(10.048, "d1.png"));
    writeText(folder / "groundtruth.txt", "10.0" + pose + "10.03" + pose + "10.05" + pose);
    writeText(folder / "intrinsics.txt", "80 80 48 32\n");
    Job job;
    ImageSetOptions options = keepAll();
    options.depthBits = 32;
    const auto read = readImageSet(folder.path(), options, job);
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 2u);
    EXPECT_EQ(read->views[0].name, "b");
    EXPECT_EQ(read->views[0].depth.at(9, 9), 1.0f);
    EXPECT_EQ(read->views[1].name, "c");
    EXPECT_EQ(read->views[1].depth.at(9, 9), 2.0f);
    const auto notes = job.takeNotes();
    EXPECT_TRUE(std::ranges::any_of(notes, [](const std::string& note) {
        return note.starts_with("1 of 3 colour images have no depth");
    }));
}

/// Names without leading zeros: 10.png comes after 9.png, and pictures without a pose are noted.
TEST(Open3d, NumbersInNamesSortAsNumbers) {
    const auto views = roomViews(1);
    TemporaryFolder folder;
    std::string log;
    for (int i = 0; i < 12; ++i) {
        writeColour(folder / fmt::format("color/{}.png", i), views[0]);
        writeCodes(folder / fmt::format("depth/{}.png", i), 96, 64, 16,
                   [i](int x, int y) { return x == 5 && y == 4 ? 65535 : 1000 + i; });
        if (i == 4) continue;
        log += fmt::format("{} {} {}\n1 0 0 {}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", i, i, i + 1, i);
    }
    writeText(folder / "trajectory.log", log);
    ImageSetOptions options = keepAll();
    options.depthBits = 32;
    const double k[4] = {80, 80, 48, 32};
    std::copy(k, k + 4, options.intrinsics);
    Job job;
    const auto read = readImageSet(folder.path(), options, job);
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 11u);
    for (const ReferenceView& view : read->views) {
        EXPECT_EQ(view.name, fmt::format("{:g}", view.camera.position.x));
        EXPECT_NEAR(view.depth.at(9, 9), 1 + 0.001 * view.camera.position.x, 1e-5);
        EXPECT_FALSE(hasPoint(view.depth.at(5, 4)));
    }
    const auto notes = job.takeNotes();
    EXPECT_TRUE(std::ranges::any_of(notes, [](const std::string& note) {
        return note.starts_with("1 of 12 pictures has no pose");
    }));
}

TEST(SevenScenes, ComesBackAndItsMissingValuesAreNone) {
    auto views = roomViews(1);
    ReferenceView& v = views[0];
    TemporaryFolder folder;
    v.depth.at(4, 4) = v.depth.at(5, 4) = kNoDepth;
    writeColour(folder / "frame-000000.color.png", v);
    writeCodes(folder / "frame-000000.depth.png", 96, 64, 16, [&](int x, int y) {
        if (x == 4 && y == 4) return 0L;
        if (x == 5 && y == 4) return 65535L;
        return std::lround(v.depth.at(x, y) * 1000);
    });
    const glm::dmat3 r = visionRotation(v.camera);
    std::string pose;
    for (int row = 0; row < 3; ++row)
        pose +=
            fmt::format("{} {} {} {}\n", r[0][row], r[1][row], r[2][row], v.camera.position[row]);
    writeText(folder / "frame-000000.pose.txt", pose + "0 0 0 1\n");
    ImageSetOptions options = keepAll();
    const Camera& c = v.camera;
    const double k[4] = {c.fx, c.fy, c.cx - 0.5, c.cy - 0.5};
    std::copy(k, k + 4, options.intrinsics);
    const auto read = readSet(folder.path(), options);
    ASSERT_TRUE(read) << read.error().text();
    expectSame(v, read->views[0], [](double) { return 0.0005; });
    writeText(folder / "frame-000000.pose.txt", "nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    expectError(readSet(folder.path(), options), {"frame-000000.pose.txt", "line 1", "nan"});
}

std::string transformsJson(const Camera& c, const std::string& extra) {
    const glm::dmat4 m = c.worldFromCamera();
    std::string rows;
    for (int r = 0; r < 4; ++r)
        rows += fmt::format("{}[{},{},{},{}]", r ? "," : "", m[0][r], m[1][r], m[2][r], m[3][r]);
    return fmt::format(
        "{{\"w\":{},\"h\":{},\"fl_x\":{},\"fl_y\":{},\"cx\":{},\"cy\":{},{}"
        "\"frames\":[{{\"file_path\":\"./a\",\"depth_file_path\":\"d.png\","
        "\"transform_matrix\":[{}]}}]}}",
        c.width, c.height, c.fx, c.fy, c.cx, c.cy, extra, rows);
}

/// The files that transformsJson() names: depth in millimetres.
void writeMillimetres(const TemporaryFolder& folder, const ReferenceView& view) {
    writeColour(folder / "a.png", view);
    writeCodes(folder / "d.png", 96, 64, 16,
               [&](int x, int y) { return std::lround(view.depth.at(x, y) * 1000); });
}

TEST(Transforms, MillimetresAndNamesWithoutAnEnding) {
    const auto views = roomViews(1);
    TemporaryFolder folder;
    writeMillimetres(folder, views[0]);
    writeText(folder / "transforms.json", transformsJson(views[0].camera, ""));
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    expectSame(views[0], read->views[0], [](double) { return 0.0005; });
}

/// 65535 is a sensor's "too far", or the end of a writer's codes; of steps that the file or the
/// user names it is a distance.
TEST(Transforms, TheLargestCodeIsADistanceOnlyOfStepsThatAreNamed) {
    auto views = roomViews(1);
    TemporaryFolder folder;
    views[0].depth.at(5, 4) = 65.535f;
    writeMillimetres(folder, views[0]);
    writeText(folder / "transforms.json", transformsJson(views[0].camera, ""));
    ImageSetOptions options = keepAll();
    options.depthBits = 32;
    const auto usual = readSet(folder.path(), options);
    ASSERT_TRUE(usual) << usual.error().text();
    EXPECT_FALSE(hasPoint(usual->views[0].depth.at(5, 4)));
    EXPECT_TRUE(hasPoint(usual->views[0].depth.at(6, 4)));
    options.depthUnit = 0.001;
    const auto asked = readSet(folder.path(), options);
    ASSERT_TRUE(asked) << asked.error().text();
    EXPECT_NEAR(asked->views[0].depth.at(5, 4), 65.535, 1e-4);
    options.depthUnit = 0;
    writeText(folder / "transforms.json",
              transformsJson(views[0].camera, "\"integer_depth_scale\":0.001,"));
    const auto named = readSet(folder.path(), options);
    ASSERT_TRUE(named) << named.error().text();
    EXPECT_NEAR(named->views[0].depth.at(5, 4), 65.535, 1e-4);
}

/// A far value among near points, as renderers write for the sky, leaves 16 bits few codes for
/// them.
TEST(Transforms, DepthOfAWideRangeStaysFloats) {
    auto views = roomViews(1);
    TemporaryFolder folder;
    writeColour(folder / "a.png", views[0]);
    Job job;
    const auto readFloats = [&](float far) -> ReferenceView {
        Image<float> depth = views[0].depth;
        depth.at(5, 4) = far;
        const Bytes bytes = encodeNumpy(depth);
        writeText(folder / "d.npy", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        std::string json = transformsJson(views[0].camera, "");
        json.replace(json.find("d.png"), 5, "d.npy");
        writeText(folder / "transforms.json", json);
        const auto read = readImageSet(folder.path(), {}, job);
        EXPECT_TRUE(read) << read.error().text();
        return read ? read->views[0] : ReferenceView();
    };
    EXPECT_EQ(readFloats(9).depthBits, 16);
    const ReferenceView view = readFloats(65504);
    EXPECT_EQ(view.depthBits, 32);
    EXPECT_EQ(view.depth.at(6, 4), views[0].depth.at(6, 4));
}

// The principal point, 3.25 and -1.75 pixels from the middle, tells the size but for that.
TEST(Transforms, WithoutTheSizeTakeThePicturesNearTheMiddle) {
    const auto views = roomViews(1);
    TemporaryFolder folder;
    writeMillimetres(folder, views[0]);
    std::string text = transformsJson(views[0].camera, "");
    text.replace(text.find("\"w\":96,\"h\":64,"), 14, "");
    writeText(folder / "transforms.json", text);
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    expectSame(views[0], read->views[0], [](double) { return 0.0005; });
    text.replace(text.find("\"cx\":"), 5, "\"cx\":1");
    writeText(folder / "transforms.json", text);
    expectError(readSet(folder.path()), {"a.png", "96x64", "'w' and 'h' are missing"});
}

TEST(Transforms, BadOnesAreOneSentenceEach) {
    const auto views = roomViews(1);
    TemporaryFolder folder;
    writeColour(folder / "a.png", views[0]);
    const auto file = folder / "transforms.json";
    writeCodes(folder / "d.png", 96, 64, 16, [](int, int) { return 0; });
    writeText(file, transformsJson(views[0].camera, ""));
    expectError(readSet(folder.path()), {"d.png", "valid depth"});
    writeCodes(folder / "d.png", 90, 64, 16, [](int, int) { return 500; });
    expectError(readSet(folder.path()), {"d.png", "90x64", "96x64"});
    std::filesystem::remove(folder / "d.png");
    expectError(readSet(folder.path()), {"transforms.json", "frames[0]", "d.png"});
    writeText(file, transformsJson(views[0].camera, "\"camera_model\":\"FISHEYE624\","));
    expectError(readSet(folder.path()), {"frames[0]", "FISHEYE624"});
    Camera broken = views[0].camera;
    broken.orientation = {0, 0, 0, 0};
    broken.orientation.w = 1;
    std::string text = transformsJson(broken, "");
    text.replace(text.find("[1,0,0"), 6, "[0,0,0");
    writeText(file, text);
    expectError(readSet(folder.path()), {"frames[0]", "singular"});
    text.replace(text.find("[0,0,0"), 6, "[NaN,0,0");
    writeText(file, text);
    expectError(readSet(folder.path()), {"transforms.json", "line 1"});
    std::string outside = transformsJson(views[0].camera, "");
    outside.replace(outside.find("./a"), 3, "../a");
    writeText(file, outside);
    expectError(readSet(folder.path()), {"frames[0]", "../a"});
}

TEST(Lens, DistortionIsUndoneToAFractionOfAPixel) {
    // A picture of its own coordinates through the lens: after undoing, each pixel tells where it
    // is in the ideal picture.
    auto views = roomViews(1);
    Camera c = views[0].camera;
    imagesets::Lens lens;
    lens.k1 = -0.12;
    lens.k2 = 0.03;
    lens.p1 = 0.002;
    lens.p2 = -0.001;
    TemporaryFolder folder;
    Rgba8Image image(96, 64, {0, 0, 0, 255});
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 96; ++x) {
            glm::dvec2 ideal(x + 0.5, y + 0.5);
            for (int i = 0; i < 30; ++i)
                ideal += glm::dvec2(x + 0.5, y + 0.5) - lens.realFromIdeal(c, ideal);
            image.at(x, y) = {std::lround(glm::clamp(ideal.x * 2, 0.0, 255.0)),
                              std::lround(glm::clamp(ideal.y * 2, 0.0, 255.0)), 0, 255};
        }
    views[0].texture = image;
    writeColour(folder / "a.png", views[0]);
    writeCodes(folder / "d.png", 96, 64, 16, [](int, int) { return 2000; });
    writeText(folder / "transforms.json",
              transformsJson(c, "\"k1\":-0.12,\"k2\":0.03,\"p1\":0.002,\"p2\":-0.001,"));
    Job job;
    const auto read = readImageSet(folder.path(), {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const auto notes = job.takeNotes();
    ASSERT_FALSE(notes.empty());
    EXPECT_NE(notes[0].find("pixels undone"), std::string::npos) << notes[0];
    const auto& out = *read->views[0].texture.rgba8();
    for (int y = 4; y < 60; ++y)
        for (int x = 4; x < 92; ++x) {
            EXPECT_NEAR(out.at(x, y).r / 2.0, x + 0.5, 0.51);
            EXPECT_NEAR(out.at(x, y).g / 2.0, y + 0.5, 0.51);
        }
}

TEST(Panorama, FacesHoldTheRayLengths) {
    // A sphere around a camera that stands off its centre is known in every direction.
    TemporaryFolder folder;
    const int w = 256, h = 128;
    const glm::dvec3 centre(0.3, -0.2, 0.4);
    const imagesets::Panorama panorama;
    writeCodes(folder / "depth.png", w, h, 16, [&](int x, int y) {
        const glm::dvec3 d = panorama.direction({(x + 0.5) / w, (y + 0.5) / h});
        const double b = glm::dot(d, centre);
        return std::lround(1000 * (b + std::sqrt(b * b - glm::dot(centre, centre) + 4.0)));
    });
    ReferenceView picture;
    picture.texture = Rgba8Image(w, h, {200, 100, 50, 255});
    writeColour(folder / "picture.png", picture);
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 6u);
    for (const auto& view : read->views) {
        EXPECT_EQ(view.pointCount(), view.camera.width * view.camera.height);
        for (int y = 0; y < view.camera.height; ++y)
            for (int x = 0; x < view.camera.width; ++x)
                ASSERT_NEAR(glm::length(view.worldPoint(x, y) - centre), 2.0, 0.004) << view.name;
    }
}

TEST(Panorama, TakesAnArrayOfDepth) {
    TemporaryFolder folder;
    const Bytes depth = encodeNumpy(Image<float>(256, 128, 3.0f));
    writeText(folder / "pano_depth.npy",
              {reinterpret_cast<const char*>(depth.data()), depth.size()});
    ReferenceView picture;
    picture.texture = Rgba8Image(256, 128, {200, 100, 50, 255});
    writeColour(folder / "pano.png", picture);
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 6u);
    const ReferenceView& view = read->views[0];
    EXPECT_NEAR(glm::length(view.worldPoint(10, 20)), 3.0, 1e-4);
    // Beside pictures arrays may be anything.
    writeText(folder / "poses.npy", {reinterpret_cast<const char*>(depth.data()), depth.size()});
    writeCodes(folder / "depth.png", 256, 128, 16, [](int, int) { return 2000; });
    const auto picturesFirst = readSet(folder.path());
    ASSERT_TRUE(picturesFirst) << picturesFirst.error().text();
    EXPECT_NEAR(glm::length(picturesFirst->views[0].worldPoint(10, 20)), 2.0, 1e-3);
}

}  // namespace
