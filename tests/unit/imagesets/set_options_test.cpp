// Options of image sets that only some kinds take.

#include "formats/images/npy.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

constexpr int kCode = 2000;  // of all depth here

/// One picture of 24x16 and its depth, a wall, in the layout of a kind.
void writeWall(const TemporaryFolder& folder, const std::string& kind) {
    ReferenceView view;
    view.texture = Rgba8Image(24, 16, {10, 200, 30, 255});
    const auto files = [&](const std::string& colour, const std::string& depth) {
        writeColour(folder / colour, view);
        writeCodes(folder / depth, 24, 16, 16, [](int, int) { return kCode; });
    };
    const std::string rows = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    if (kind == "transforms") {
        files("a.png", "d.png");
        writeText(folder / "transforms.json",
                  "{\"w\":24,\"h\":16,\"fl_x\":20,\"frames\":[" +
                      transformsFrame(glm::dmat4(1), ",\"depth_file_path\":\"d.png\"") + "]}");
    } else if (kind == "cameras") {
        files("a.png", "d.png");
        writeText(folder / "cameras.json",
                  R"({"cameras":[{"name":"a","texture":"a.png","depth":"d.png","width":24,)"
                  R"("height":16,"position":[0,0,0],"orientation":[0,1,0,0],"fx":20,"fy":20,)"
                  R"("depthUnit":0.001}]})");
    } else if (kind == "tum") {
        files("rgb/1.png", "depth/1.png");
        writeText(folder / "rgb.txt", "1 rgb/1.png\n");
        writeText(folder / "depth.txt", "1 depth/1.png\n");
        writeText(folder / "groundtruth.txt", "1 0 0 0 0 0 0 1\n");
        writeText(folder / "intrinsics.txt", "20 20 11.5 7.5\n");
    } else if (kind == "7scenes") {
        files("frame-000000.color.png", "frame-000000.depth.png");
        writeText(folder / "frame-000000.pose.txt", rows);
    } else if (kind == "open3d") {
        files("color/0.png", "depth/0.png");
        writeText(folder / "trajectory.log", "0 0 1\n" + rows);
        writeText(folder / "camera.json", R"({"intrinsic_matrix":[20,0,0,0,20,0,11.5,7.5,1]})");
    } else {
        files("a.png", "a_depth.png");
    }
}

ImageSetOptions optionsOf(const std::string& kind) {
    ImageSetOptions options;
    options.refine = *RefineSettings::from("off");
    options.from = kind;
    if (kind == "7scenes") {
        const double k[4] = {20, 20, 11.5, 7.5};
        std::copy(k, k + 4, options.intrinsics);
    }
    return options;
}

/// What a message names first.
struct Given {
    std::string name;
    void (*give)(ImageSetOptions&);
    std::string kinds;  ///< that take it, of those here
};
const Given kGiven[] = {
    {"--texture", [](ImageSetOptions& o) { o.texturePattern = "x.png"; }, "panorama"},
    {"--depth", [](ImageSetOptions& o) { o.depthPattern = "x.png"; }, "panorama"},
    {"--depth-range", [](ImageSetOptions& o) { o.depthMin = 1, o.depthMax = 2; }, ""},
    {"--intrinsics", [](ImageSetOptions& o) { o.intrinsics[0] = o.intrinsics[1] = 9; },
     "tum 7scenes open3d"},
    {"--depth-intrinsics",
     [](ImageSetOptions& o) {
         o.depthIntrinsics = {9, 9, 9, 9};
     },
     "tum 7scenes"},
    {"--depth-to-colour", [](ImageSetOptions& o) { o.depthToColour = "none"; }, "tum 7scenes"},
    {"--focal", [](ImageSetOptions& o) { o.focal = 9; }, ""},
    {"--baseline", [](ImageSetOptions& o) { o.baseline = 9; }, ""},
    {"--disparity-offset", [](ImageSetOptions& o) { o.disparityOffset = 9; }, ""},
    {"--disparity-scale", [](ImageSetOptions& o) { o.disparityScale = 9; }, ""},
    {"--yuv", [](ImageSetOptions& o) { o.yuv.fullRange = true; }, ""},
    {"--depth-near", [](ImageSetOptions& o) { o.photo.nearIs = NearIs::black; }, ""},
    {"--colour-of", [](ImageSetOptions& o) { o.photo.portrait = true; }, ""},
    {"--behind", [](ImageSetOptions& o) { o.photo.behindPercent = 3; }, ""},
};

}  // namespace

TEST(SetOptions, AUnitIsOfAllIntegersInSteps) {
    for (const std::string kind :
         {"transforms", "cameras", "tum", "7scenes", "open3d", "panorama"}) {
        SCOPED_TRACE(kind);
        const TemporaryFolder folder;
        writeWall(folder, kind);
        ImageSetOptions options = optionsOf(kind);
        options.depthUnit = 0.0025;
        const auto read = readSet(folder.path(), options);
        ASSERT_TRUE(read) << read.error().text();
        float nearest = kNoDepth;
        for (const ReferenceView& view : read->views)
            for (const float d : view.depth.pixels()) nearest = std::min(nearest, d);
        // Depth of a panorama is the length of rays; its faces reach beyond 45 degrees.
        const double share = kind == "panorama" ? 2 : 1;
        EXPECT_GE(nearest, kCode * 0.0025 / share * (1 - 1e-4));
        EXPECT_LE(nearest, kCode * 0.0025 * (1 + 1e-4));
    }
}

/// Arrays of floats are scene units in recordings, too, whose integers count steps.
TEST(SetOptions, FloatsOfRecordingsAreDistances) {
    for (const std::string kind : {"tum", "open3d"}) {
        SCOPED_TRACE(kind);
        const TemporaryFolder folder;
        writeWall(folder, kind);
        const std::string depth = kind == "tum" ? "depth/1" : "depth/0";
        std::filesystem::remove(folder / (depth + ".png"));
        writeExr(folder / (depth + ".exr"), {{"Z", plane(24, 16, [](int, int) { return 2; })}});
        if (kind == "tum") writeText(folder / "depth.txt", "1 depth/1.exr\n");
        ImageSetOptions options = optionsOf(kind);
        const auto read = readSet(folder.path(), options);
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ(read->views[0].depth.at(9, 9), 2);
        options.depthUnit = 0.001;
        expectError(readSet(folder.path(), options), {depth.c_str(), "--depth-unit", "floats"});
    }
}

TEST(SetOptions, AUnitIsNotOfOtherCodes) {
    const TemporaryFolder folder;
    writeWall(folder, "transforms");
    ImageSetOptions options = optionsOf("transforms");
    options.depthUnit = 0.001;
    const std::string frames = "\"w\":24,\"h\":16,\"fl_x\":20,\"frames\":[" +
                               transformsFrame(glm::dmat4(1), ",\"depth_file_path\":\"d.png\"") +
                               "]}";
    writeText(folder / "transforms.json",
              "{\"depth_coding\":{\"normalised_disparity\":true,\"near\":1,\"far\":2}," + frames);
    expectError(readSet(folder.path(), options), {"--depth-unit", "depth_coding"});
    writeText(folder / "transforms.json", "{" + frames);
    EXPECT_TRUE(readSet(folder.path(), options));
    std::filesystem::remove(folder / "d.png");
    writeExr(folder / "d.exr", {{"Z", plane(24, 16, [](int, int) { return 3; })}});
    std::string floats = frames;
    floats.replace(floats.find("d.png"), 5, "d.exr");
    writeText(folder / "transforms.json", "{" + floats);
    const auto read = readSet(folder.path(), options);
    expectError(read, {"--depth-unit", "floats"});
    EXPECT_EQ(read.error().code, ErrorCode::usage);
}

TEST(SetOptions, OnesOfOtherKindsAreRefused) {
    for (const std::string kind :
         {"transforms", "cameras", "tum", "7scenes", "open3d", "panorama"}) {
        const TemporaryFolder folder;
        writeWall(folder, kind);
        for (const Given& given : kGiven) {
            if (given.kinds.find(kind) != std::string::npos) continue;
            SCOPED_TRACE(kind + " " + given.name);
            ImageSetOptions options = optionsOf(kind);
            given.give(options);
            const auto read = readSet(folder.path(), options);
            expectError(read, {(given.name + " ").c_str(), kind.c_str(), "this set is"});
            EXPECT_EQ(read.error().code, ErrorCode::usage);
        }
    }
}

/// Lists of many inputs may hold sets that take them.
TEST(SetOptions, OnesOfOtherKindsAreNotedInLists) {
    const TemporaryFolder folder;
    writeWall(folder, "cameras");
    ImageSetOptions options = optionsOf("cameras");
    options.manyKinds = true;
    options.focal = 9;
    options.yuv.fullRange = true;
    Job job;
    EXPECT_TRUE(readImageSet(folder.path(), options, job));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("--focal"), std::string::npos) << notes[0];
    EXPECT_NE(notes[1].find("--yuv"), std::string::npos) << notes[1];
}

namespace {

/// A folder without intrinsics and with pictures of that size.
void writeBare(const TemporaryFolder& folder, const std::string& kind, glm::ivec2 size) {
    writeWall(folder, kind);
    std::filesystem::remove(folder / "intrinsics.txt");
    std::filesystem::remove(folder / "camera.json");
    ReferenceView view;
    view.texture = Rgba8Image(size.x, size.y, {10, 200, 30, 255});
    const auto files = [&](const std::string& colour, const std::string& depth) {
        writeColour(folder / colour, view);
        writeCodes(folder / depth, size.x, size.y, 16, [](int, int) { return kCode; });
    };
    if (kind == "tum") files("rgb/1.png", "depth/1.png");
    if (kind == "7scenes") files("frame-000000.color.png", "frame-000000.depth.png");
    if (kind == "open3d") files("color/0.png", "depth/0.png");
}

struct ReadNoted {
    Result<Bundle> bundle;
    std::string notes;
};
ReadNoted readNoted(const std::filesystem::path& set, const ImageSetOptions& options) {
    Job job;
    ReadNoted out{readImageSet(set, options, job), ""};
    for (const std::string& note : job.takeNotes()) out.notes += note + "\n";
    return out;
}

}  // namespace

/// The usual intrinsics are of 640x480: smaller pictures of that shape have them scaled.
TEST(UsualIntrinsics, AreScaledToThePictures) {
    for (const std::string kind : {"tum", "7scenes", "open3d"})
        for (const int width : {320, 160}) {
            SCOPED_TRACE(kind);
            const TemporaryFolder folder;
            writeBare(folder, kind, {width, width * 3 / 4});
            ImageSetOptions options = optionsOf(kind);
            options.intrinsics[0] = 0;
            const auto read = readNoted(folder.path(), options);
            ASSERT_TRUE(read.bundle) << read.bundle.error().text();
            const Camera& c = read.bundle->views[0].camera;
            EXPECT_NEAR(c.fx, 525 * width / 640.0, 1e-9);
            EXPECT_NEAR(c.cx, width * 0.5, 1e-9);
            EXPECT_NE(read.notes.find(fmt::format("scaled from 640x480 to {}x", width)),
                      std::string::npos)
                << read.notes;
        }
}

TEST(UsualIntrinsics, OfAnotherShapeCannotFit) {
    for (const std::string kind : {"tum", "7scenes", "open3d"}) {
        SCOPED_TRACE(kind);
        const TemporaryFolder folder;
        writeBare(folder, kind, {480, 480});
        ImageSetOptions options = optionsOf(kind);
        options.intrinsics[0] = 0;
        const auto read = readNoted(folder.path(), options);
        ASSERT_TRUE(read.bundle) << read.bundle.error().text();
        EXPECT_NE(read.notes.find("cannot fit 480x480"), std::string::npos) << read.notes;
    }
}

namespace {

/// The camera of a wall whose intrinsics are in a file of that text.
Result<Camera> cameraTold(const std::string& kind, const std::string& text,
                          std::vector<std::string>* notes = nullptr) {
    const TemporaryFolder folder;
    writeWall(folder, kind);
    writeText(folder / (kind == "tum" ? "intrinsics.txt" : "camera.json"), text);
    Job job;
    auto read = readImageSet(folder.path(), optionsOf(kind), job);
    if (notes) *notes = job.takeNotes();
    if (!read) return tl::unexpected(read.error());
    return read->views[0].camera;
}

/// What cannot be told from one of 9 numbers is refused by name.
void expectNoCamera(const std::string& kind, const std::string& text, const char* part) {
    const auto camera = cameraTold(kind, text);
    ASSERT_FALSE(camera) << text;
    EXPECT_EQ(camera.error().code, ErrorCode::invalidInput);
    EXPECT_NE(camera.error().text().find(part), std::string::npos) << camera.error().text();
}

}  // namespace

TEST(Intrinsics, NineNumbersOfTumAreAMatrixOrALens) {
    const auto matrix = cameraTold("tum", "20 0 11.5\n0 21 7.5\n0 0 1\n");
    ASSERT_TRUE(matrix) << matrix.error().text();
    EXPECT_EQ(glm::dvec4(matrix->fx, matrix->fy, matrix->cx, matrix->cy),
              glm::dvec4(20, 21, 12, 8));
    std::vector<std::string> notes;
    const auto lens = cameraTold("tum", "20 21 11.5 7.5 0.1 -0.2 0.01 -0.02 0.3\n", &notes);
    ASSERT_TRUE(lens) << lens.error().text();
    // Two columns are cut off at the left, where a pinhole sees past the picture.
    EXPECT_EQ(glm::dvec4(lens->fx, lens->fy, lens->cx, lens->cy), glm::dvec4(20, 21, 10, 8));
    EXPECT_EQ(lens->width, 22);
    // By the formula of lens.hpp with k1 k2 p1 p2 k3, of all pixels.
    ASSERT_FALSE(notes.empty());
    EXPECT_NE(notes[0].find("lens distortion of up to 1.23 pixels"), std::string::npos) << notes[0];
    const char* no = "9 numbers that are not a camera; 'fx fy cx cy'";
    expectNoCamera("tum", "20 0 0 0 21 0 11.5 7.5 1", no);    // by columns
    expectNoCamera("tum", "20 0.5 11.5 0 21 7.5 0 0 1", no);  // with a skew
    expectNoCamera("tum", "20 0 11.5 1 0 7.5 0 0 1", no);
    expectNoCamera("tum", "20 21 11.5 7.5 0.1", "5 numbers that are not a camera");
}

TEST(Intrinsics, OfOpen3dAreAMatrixByColumnsOfPicturesOfASize) {
    const auto json = [](const std::string& size, const std::string& m) {
        return fmt::format(R"({{{}"intrinsic_matrix":[{}]}})", size, m);
    };
    const std::string columns = "20,0,0,0,21,0,11.5,7.5,1";
    std::vector<std::string> notes;
    const auto own = cameraTold("open3d", json(R"("width":24,"height":16,)", columns), &notes);
    ASSERT_TRUE(own) << own.error().text();
    EXPECT_EQ(glm::dvec4(own->fx, own->fy, own->cx, own->cy), glm::dvec4(20, 21, 12, 8));
    EXPECT_TRUE(notes.empty()) << notes[0];
    const auto scaled = cameraTold("open3d", json(R"("width":48,"height":32,)", columns), &notes);
    ASSERT_TRUE(scaled) << scaled.error().text();
    EXPECT_EQ(glm::dvec4(scaled->fx, scaled->fy, scaled->cx, scaled->cy),
              glm::dvec4(10, 10.5, 6, 4));
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("scaled from 48x32 to the pictures' 24x16 (fx 10, fy 10.5, cx 5.5, cy "
                            "3.5)"),
              std::string::npos)
        << notes[0];
    expectNoCamera("open3d", json(R"("width":24,"height":24,)", columns), "24x24");
    expectNoCamera("open3d", json(R"("width":24,)", columns), "'height' is missing");
    expectNoCamera("open3d", json("", "20,0,11.5,0,21,7.5,0,0,1"), "a matrix by columns");
    expectNoCamera("open3d", json("", "20,0,0,0,21,0,11.5,7.5"), "9 finite numbers");
    expectNoCamera("open3d", json("", "20,0,0,0,0,0,11.5,7.5,1"), "20 and 0");
}

/// Open3D writes the steps of depth in one metre beside the intrinsics.
TEST(DepthUnits, OfOpen3dAreBesideTheIntrinsics) {
    const TemporaryFolder folder;
    writeWall(folder, "open3d");
    const auto write = [&](const char* scale) {
        writeText(
            folder / "camera.json",
            fmt::format(R"({{"depth_scale":{},"intrinsic_matrix":[20,0,0,0,20,0,11.5,7.5,1]}})",
                        scale));
    };
    write("4000.0");
    ImageSetOptions options = optionsOf("open3d");
    for (const bool own : {false, true}) {
        if (own) options.intrinsics[0] = options.intrinsics[1] = 20;
        const auto read = readNoted(folder.path(), options);
        ASSERT_TRUE(read.bundle) << read.bundle.error().text();
        EXPECT_NEAR(read.bundle->views[0].depth.at(9, 9), kCode / 4000.0, 1e-5);
        EXPECT_NE(read.notes.find("steps of 0.00025 scene units"), std::string::npos) << read.notes;
    }
    options.depthUnit = 0.002;
    const auto given = readSet(folder.path(), options);
    ASSERT_TRUE(given) << given.error().text();
    EXPECT_NEAR(given->views[0].depth.at(9, 9), kCode * 0.002, 1e-4);
    options.depthUnit = 0;
    write("0");
    expectError(readSet(folder.path(), options), {"camera.json", "'depth_scale' is 0"});
    write("1000");
    const auto usual = readNoted(folder.path(), options);
    ASSERT_TRUE(usual.bundle) << usual.bundle.error().text();
    EXPECT_EQ(usual.notes.find("depth_scale"), std::string::npos) << usual.notes;
}

/// Pictures to look at are no steps of a sensor's usual unit.
TEST(DepthUnits, Of8BitsAreNotTheUsualOnesOfRecordings) {
    for (const std::string kind : {"tum", "7scenes", "open3d"}) {
        SCOPED_TRACE(kind);
        const TemporaryFolder folder;
        writeWall(folder, kind);
        const std::string depth = kind == "tum"       ? "depth/1.png"
                                  : kind == "7scenes" ? "frame-000000.depth.png"
                                                      : "depth/0.png";
        writeCodes(folder / depth, 24, 16, 8, [](int, int) { return 200; });
        ImageSetOptions options = optionsOf(kind);
        expectError(readSet(folder.path(), options),
                    {depth.c_str(), "the depth has 8 bits", "--depth-unit"});
        options.depthUnit = 0.01;
        const auto read = readSet(folder.path(), options);
        EXPECT_TRUE(read) << read.error().text();
    }
}

/// nerfstudio multiplies depth by depth_unit_scale_factor, arrays of floats too, and by the scale
/// that was applied to the poses before.
TEST(DepthUnits, OfNerfstudioAreOfArraysAndScaledAsThePosesAre) {
    const TemporaryFolder folder;
    writeWall(folder, "transforms");
    writeBytes(folder / "d.npy",
               encodeNumpy(plane(24, 16, [](int x, int) { return x == 3 ? 1e10 : kCode; })));
    const auto distance = [&](const std::string& keys, const std::string& depth,
                              const char* noted) {
        SCOPED_TRACE(keys + " " + depth);
        writeText(folder / "transforms.json",
                  "{" + keys + "\"w\":24,\"h\":16,\"fl_x\":20,\"frames\":[" +
                      transformsFrame(glm::dmat4(1), ",\"depth_file_path\":\"" + depth + "\"") +
                      "]}");
        const auto read = readNoted(folder.path(), optionsOf("transforms"));
        EXPECT_TRUE(read.bundle) << read.bundle.error().text();
        if (!read.bundle) return 0.0;
        EXPECT_EQ(read.notes.find("is taken times") != std::string::npos ||
                      read.notes.find("are taken times") != std::string::npos,
                  *noted != 0)
            << read.notes;
        EXPECT_NE(read.notes.find(noted), std::string::npos) << read.notes;
        EXPECT_EQ(hasPoint(read.bundle->views[0].depth.at(3, 9)), depth == "d.png");
        return static_cast<double>(read.bundle->views[0].depth.at(9, 9));
    };
    const std::string applied = "\"applied_scale\":0.25,",
                      factor = "\"depth_unit_scale_factor\":0.002,";
    EXPECT_NEAR(distance("", "d.png", ""), 2, 1e-4);
    EXPECT_NEAR(distance(applied, "d.png", "times 0.25, its applied_scale"), 0.5, 1e-4);
    EXPECT_NEAR(distance(factor, "d.png", ""), 4, 1e-4);
    EXPECT_NEAR(distance(factor + applied, "d.png", "times 0.25"), 1, 1e-4);
    EXPECT_NEAR(distance("\"integer_depth_scale\":0.001," + applied, "d.png", ""), 2, 1e-4);
    EXPECT_NEAR(distance(applied, "d.npy", ""), kCode, 1);
    EXPECT_NEAR(distance(factor, "d.npy", "times 0.002"), 4, 1e-4);
    EXPECT_NEAR(distance(factor + applied, "d.npy", "times 0.0005"), 1, 1e-4);
}

TEST(Intrinsics, OnesThatCannotBeACamerasAreTold) {
    for (const std::string kind : {"tum", "7scenes", "open3d"}) {
        SCOPED_TRACE(kind);
        const TemporaryFolder folder;
        writeWall(folder, kind);
        ImageSetOptions options = optionsOf(kind);
        const auto give = [&](glm::dvec4 k) { std::copy(&k.x, &k.x + 4, options.intrinsics); };
        give({20, 0, 11.5, 7.5});
        const auto zero = readSet(folder.path(), options);
        expectError(zero, {"--intrinsics", "focal lengths", "20 and 0"});
        EXPECT_EQ(zero.error().code, ErrorCode::usage);
        give({20, 20, 9999, 7.5});
        EXPECT_NE(readNoted(folder.path(), options).notes.find("outside"), std::string::npos);
        give({20, 20, 11.5, 7.5});
        EXPECT_EQ(readNoted(folder.path(), options).notes.find("outside"), std::string::npos);
    }
}

// A folder with a picture and its depth is not a panorama's because something is missing there.
TEST(SetOptions, WhatASetLacksIsSaidBeforeItsOptions) {
    const TemporaryFolder folder;
    writeWall(folder, "7scenes");
    std::filesystem::remove(folder / "frame-000000.pose.txt");
    ImageSetOptions options = optionsOf("7scenes");
    options.from.clear();
    const auto read = readSet(folder.path(), options);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::invalidInput) << read.error().text();
    EXPECT_NE(read.error().text().find("24x16; a panorama is twice as wide"), std::string::npos)
        << read.error().text();
}
