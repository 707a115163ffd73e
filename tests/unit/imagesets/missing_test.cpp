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

TEST(MissingFiles, OfRecordingsLeaveTheirViewOut) {
    const auto views = roomViews(3);
    TemporaryFolder tum, scenes;
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

}  // namespace
