// A recording of a thousand images from which one is missing is still a recording.

#include "formats/imagesets/export.hpp"
#include "formats/imagesets/set_views.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

/// Reads a set of three views one of which lacks a file, with a note; strictly it is an error.
void expectTwoOfThree(const std::filesystem::path& set, const std::string& gone) {
    ImageSetOptions options;
    options.depthBits = 32;
    Job job;
    const auto read = readImageSet(set, options, job);
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->views.size(), 2u);
    std::string notes;
    for (const auto& note : job.takeNotes()) notes += note + "\n";
    EXPECT_NE(notes.find("1 of 3 views is left out, as files are missing; the first: "),
              std::string::npos)
        << notes;
    EXPECT_NE(notes.find(gone), std::string::npos) << notes;
    options.strict = true;
    const auto strict = readImageSet(set, options, job);
    ASSERT_FALSE(strict);
    EXPECT_EQ(strict.error().code, ErrorCode::io);
    EXPECT_NE(strict.error().text().find(gone), std::string::npos) << strict.error().text();
}

/// A set of three views: v0, v1 and v2.
std::filesystem::path writeTransforms(const TemporaryFolder& folder) {
    Bundle bundle;
    bundle.views = roomViews(3);
    Job job;
    auto set = folder / "set";
    EXPECT_TRUE(exportViews(*viewsOf(bundle), set, {}, job));
    return set;
}

TEST(MissingFiles, OfTransformsLeaveTheirViewOut) {
    TemporaryFolder folder;
    const auto set = writeTransforms(folder);
    std::filesystem::remove(set / "images/v1.png");
    expectTwoOfThree(set, "v1.png");
    std::filesystem::remove(set / "images/v0.png");
    std::filesystem::remove(set / "depth/v2.exr");
    expectError(readSet(set), {"frames[0]", "v0.png"});
}

/// Frames that name no depth are left out as those are whose files are missing.
TEST(MissingFiles, FramesOfTransformsWithoutDepthAreLeftOut) {
    TemporaryFolder folder;
    Job job;
    const auto set = writeTransforms(folder);
    const auto bytes = readFile(set / "transforms.json", job.limits);
    ASSERT_TRUE(bytes);
    std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    const auto forget = [&] {
        text.replace(text.find("depth_file_path"), 15, "no_depth_at_all");
        writeText(set / "transforms.json", text);
    };
    forget();
    const auto read = readImageSet(set, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->views.size(), 2u);
    EXPECT_TRUE(std::ranges::any_of(job.takeNotes(), [](const std::string& note) {
        return note.find("1 of 3 views is left out") != std::string::npos &&
               note.find("depth_file_path") != std::string::npos;
    }));
    ImageSetOptions strict;
    strict.strict = true;
    expectError(readSet(set, strict), {"frames[0]", "depth_file_path"});
    forget();
    forget();
    expectError(readSet(set), {"frames[0]", "depth_file_path"});
}

/// A set whose pose of a frame is lost has the others and a note of that; read strictly it is an
/// error.
void expectLost(const std::filesystem::path& set, std::initializer_list<const char*> said,
                std::size_t left = 2) {
    Job job;
    const auto read = readImageSet(set, {}, job);
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->views.size(), left);
    std::string all;
    for (const std::string& note : job.takeNotes()) all += note + "\n";
    for (const char* part : said)
        EXPECT_NE(all.find(part), std::string::npos) << part << " is missing in: " << all;
    ImageSetOptions strict;
    strict.strict = true;
    EXPECT_FALSE(readSet(set, strict));
}

/// The same three views in the layouts of TUM and 7-Scenes.
void writeRecordings(const TemporaryFolder& tum, const TemporaryFolder& scenes) {
    const auto views = roomViews(3);
    std::string rgb, depth, poses;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto& v = views[i];
        const glm::dmat3 r = visionRotation(v.camera);
        const glm::dquat q = glm::quat_cast(r);
        const auto& p = v.camera.position;
        writeColour(tum / fmt::format("{}.png", i), v);
        const auto codes = [&](double scale) {
            return [&v, scale](int x, int y) { return std::lround(v.depth.at(x, y) * scale); };
        };
        writeCodes(tum / fmt::format("d{}.png", i), 96, 64, 16, codes(5000));
        rgb += fmt::format("{}.0 {}.png\n", i, i);
        depth += fmt::format("{}.0 d{}.png\n", i, i);
        poses += fmt::format("{}.0 {} {} {} {} {} {} {}\n", i, p.x, p.y, p.z, q.x, q.y, q.z, q.w);
        const auto stem = fmt::format("frame-00000{}", i);
        writeColour(scenes / (stem + ".color.png"), v);
        writeCodes(scenes / (stem + ".depth.png"), 96, 64, 16, codes(1000));
        std::string pose;
        for (int row = 0; row < 3; ++row)
            pose += fmt::format("{} {} {} {}\n", r[0][row], r[1][row], r[2][row], p[row]);
        writeText(scenes / (stem + ".pose.txt"), pose + "0 0 0 1\n");
    }
    writeText(tum / "rgb.txt", rgb);
    writeText(tum / "depth.txt", depth);
    writeText(tum / "groundtruth.txt", poses);
}

TEST(MissingFiles, OfRecordingsLeaveTheirViewOut) {
    const TemporaryFolder tum, scenes;
    writeRecordings(tum, scenes);
    std::filesystem::remove(tum / "0.png");
    expectTwoOfThree(tum.path(), "0.png");
    std::filesystem::remove(scenes / "frame-000002.depth.png");
    expectTwoOfThree(scenes.path(), "frame-000002.depth.png");
}

/// Writes a set of three views, and takes the depth of all pixels of some away.
std::filesystem::path writeSetWithDarkViews(const TemporaryFolder& folder,
                                            std::initializer_list<int> dark) {
    auto set = writeTransforms(folder);
    for (const int i : dark)
        writeExr(set / fmt::format("depth/v{}.exr", i), {{"Z", Image<float>(96, 64, 0.0f)}});
    return set;
}

TEST(NoDepthAtAll, LeavesTheViewOut) {
    TemporaryFolder folder;
    const auto set = writeSetWithDarkViews(folder, {1});
    const std::string note =
        "1 of 3 views is left out, as no pixel has a usable depth; the first: ";
    ImageSetOptions options;
    Job job;
    const auto read = readImageSet(set, options, job);
    ASSERT_TRUE(read) << read.error().text();
    ASSERT_EQ(read->views.size(), 2u);
    EXPECT_EQ(read->views[1].name, "v2");
    const auto notes = job.takeNotes();
    EXPECT_TRUE(std::ranges::any_of(notes, [&](const std::string& n) {
        return n.starts_with(note) && n.find("v1.exr") != std::string::npos;
    })) << fmt::format("{}", fmt::join(notes, "\n"));

    // As a table whose views are read when they are asked for.
    const auto table = openSetViews(set, options, job, 0);
    ASSERT_TRUE(table) << table.error().text();
    ASSERT_EQ((*table)->count(), 2u);
    EXPECT_EQ((*table)->about().views[1].name, "v2");
    for (std::size_t i = 0; i < 2; ++i) {
        const auto view = (*table)->view(i, job);
        ASSERT_TRUE(view) << view.error().text();
        EXPECT_TRUE((*view)->depth == read->views[i].depth);
    }
    const auto ofTable = job.takeNotes();
    EXPECT_TRUE(
        std::ranges::any_of(ofTable, [&](const std::string& n) { return n.starts_with(note); }));

    options.strict = true;
    expectError(readImageSet(set, options, job), {"v1.exr", "valid depth"});
}

TEST(NoDepthAtAll, OfAllViewsIsAnError) {
    TemporaryFolder folder;
    const auto set = writeSetWithDarkViews(folder, {0, 1, 2});
    Job job;
    expectError(readImageSet(set, {}, job), {"v0.exr", "valid depth"});
}

/// Trackers that lost their way write poses that are no numbers, or quaternions of 0.
TEST(LostTracking, LeavesTheFrameOut) {
    for (const char* lost : {"nan nan nan nan nan nan nan", "1 2 3 0 0 0 0", "0 0 0 -inf 0 0 1"}) {
        SCOPED_TRACE(lost);
        const TemporaryFolder tum, scenes;
        writeRecordings(tum, scenes);
        const auto bytes = readFile(tum / "groundtruth.txt", Job().limits);
        ASSERT_TRUE(bytes);
        std::string poses(reinterpret_cast<const char*>(bytes->data()), bytes->size());
        const auto first = poses.find('\n') + 1, second = poses.find('\n', first);
        poses.replace(first, second - first, std::string("1.0 ") + lost);
        writeText(tum / "groundtruth.txt", poses);
        expectLost(tum.path(), {"groundtruth.txt", "1 of 3 poses"});
    }
    const TemporaryFolder tum, scenes;
    writeRecordings(tum, scenes);
    writeText(scenes / "frame-000001.pose.txt",
              "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n0 0 0 1\n");
    expectLost(scenes.path(), {"1 of 3 views", "frame-000001.pose.txt"});
    writeText(scenes / "frame-000001.pose.txt", "0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 0\n");
    expectLost(scenes.path(), {"1 of 3 views", "frame-000001.pose.txt", "zeros"});
    // Text that is not a number is damage.
    writeText(scenes / "frame-000001.pose.txt", "x 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    expectError(readSet(scenes.path()), {"frame-000001.pose.txt", "line 1", "'x'"});
}

TEST(LostTracking, OfOpen3dLeavesTheFrameOut) {
    const auto views = roomViews(1);
    const TemporaryFolder folder;
    for (const char* name : {"0.png", "1.png"}) {
        writeColour(folder / "color" / name, views[0]);
        writeCodes(folder / "depth" / name, 96, 64, 16, [](int, int) { return 2000; });
    }
    for (const char* lost : {"nan nan nan nan\nnan nan nan nan\nnan nan nan nan\n0 0 0 1\n",
                             "0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 0\n"}) {
        writeText(folder / "trajectory.log",
                  std::string("0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 2\n") + lost);
        expectLost(folder.path(), {"1 of 2 pictures", "trajectory.log"}, 1);
    }
}

TEST(LostTracking, OfPosesByNumberLeavesTheirFrameOut) {
    const auto views = roomViews(3);
    const TemporaryFolder folder;
    for (const int i : {0, 1, 2}) {
        writeColour(folder / fmt::format("color/{}.png", i), views[static_cast<std::size_t>(i)]);
        writeCodes(folder / fmt::format("depth/{}.png", i), 96, 64, 16,
                   [](int, int) { return 9000; });
    }
    writeText(folder / "intrinsics.txt", "60 60 47.5 31.5\n");
    writeText(folder / "pose.txt", "1 0 0 0 0 0 1\n0 0 0 0 0 0 0\n3 0 0 0 0 0 1\n");
    expectLost(folder.path(), {"pose.txt", "1 of 3 poses"});
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read);
    EXPECT_EQ((*read).views[0].camera.position.x, 1);
    EXPECT_EQ((*read).views[1].camera.position.x, 3);
}

/// Lines that begin with the numbers of pictures: a tracker that lost one writes no line for it,
/// and a part of a recording has the poses of all of it. They were counted from the first.
TEST(LostTracking, PosesOfNumbersAreThoseOfTheirPictures) {
    struct Case {
        std::vector<int> pictures, poses;
        int shift;  ///< from a picture's number to its pose's
        std::vector<int> left;
        const char* note;
        bool numbers = true;
    };
    const Case cases[] = {
        {{0, 1, 2, 3}, {0, 1, 3, 4, 5}, 0, {0, 1, 3}, "1 of 4 pictures has no pose of its number"},
        {{3, 4, 5}, {0, 1, 2, 3, 5, 6}, 0, {3, 5}, "1 of 3 pictures has no pose"},
        {{0, 1, 2}, {1, 2, 3}, 1, {0, 1, 2}, ""},
        {{1, 2, 3}, {0, 1, 2}, -1, {1, 2, 3}, ""},
        {{0, 1, 2}, {1, 2}, 0, {1, 2}, "1 of 3 pictures has no pose"},
        {{40, 41}, {0, 1}, -40, {40, 41}, ""},
        {{3, 4}, {0, 1, 2, 3, 4}, -3, {3, 4}, "5 poses for pictures 3 to 4", false}};
    const auto view = roomViews(1)[0];
    for (const Case& c : cases) {
        SCOPED_TRACE(fmt::format("pictures from {}, poses from {}", c.pictures[0], c.poses[0]));
        const TemporaryFolder folder;
        for (const int i : c.pictures) {
            writeColour(folder / fmt::format("color/{}.png", i), view);
            writeCodes(folder / fmt::format("depth/{}.png", i), 96, 64, 16,
                       [](int, int) { return 9000; });
        }
        writeText(folder / "intrinsics.txt", "60 60 47.5 31.5\n");
        std::string lines;
        for (const int i : c.poses)
            lines += fmt::format("{}{} 0 0 0 0 0 1\n", c.numbers ? fmt::format("{} ", i) : "", i);
        writeText(folder / "pose.txt", lines);
        ImageSetOptions options;
        options.refine = *RefineSettings::from("off");
        Job job;
        const auto read = readImageSet(folder.path(), options, job);
        ASSERT_TRUE(read) << read.error().text();
        std::string notes;
        for (const std::string& note : job.takeNotes())
            if (note.find("pose") != std::string::npos) notes += note + "\n";
        EXPECT_NE(notes.find(c.note), std::string::npos) << notes;
        EXPECT_EQ(notes.empty(), *c.note == 0) << notes;
        ASSERT_EQ(read->views.size(), c.left.size());
        for (std::size_t i = 0; i < c.left.size(); ++i) {
            EXPECT_EQ(read->views[i].name, std::to_string(c.left[i]));
            EXPECT_EQ(read->views[i].camera.position.x, c.left[i] + c.shift);
        }
    }
}

TEST(LostTracking, OfAllPosesIsAnError) {
    const TemporaryFolder tum, scenes;
    writeRecordings(tum, scenes);
    writeText(tum / "groundtruth.txt", "0.0 nan nan nan 0 0 0 1\n1.0 0 0 0 0 0 0 0\n");
    expectError(readSet(tum.path()), {"groundtruth.txt", "2 of 2 poses are of lost tracking"});
    for (const int i : {0, 1, 2})
        writeText(scenes / fmt::format("frame-00000{}.pose.txt", i),
                  "nan nan nan NaN\nnan nan nan -nan\nnan nan inf nan\n0 0 0 1\n");
    expectError(readSet(scenes.path()),
                {"frame-000000.pose.txt", "line 1: 'nan'", "tracking was lost"});
}

TEST(LostTracking, AndMissingFilesAreCountedEach) {
    const TemporaryFolder tum, scenes;
    writeRecordings(tum, scenes);
    writeText(scenes / "frame-000001.pose.txt", "inf 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    std::filesystem::remove(scenes / "frame-000002.depth.png");
    expectLost(scenes.path(),
               {"1 of 3 views is left out, as files are missing; the first: ",
                "1 of 3 views is left out, as tracking was lost; the first: "},
               1);
}

}  // namespace
