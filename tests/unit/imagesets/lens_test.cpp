// Lenses and skew that are undone as a set is read: where the pixels go, and what is left of the
// picture.

#include <cmath>

#include "formats/imagesets/kinds.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

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

}  // namespace
