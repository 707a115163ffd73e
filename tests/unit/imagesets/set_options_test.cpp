// Options of image sets that only some kinds take.

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
