// Sets whose views are read when they are asked for: the same views, notes and reports as those of
// a set that is in memory.

#include <algorithm>
#include <chrono>

#include "formats/imagesets/export.hpp"
#include "formats/imagesets/set_views.hpp"
#include "lib/model/same_pictures.hpp"
#include "lib/refine/refine_needed.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

constexpr std::uint64_t kNoneHeld = 0, kAllHeld = std::uint64_t{1} << 40;

/// What reading a set says beside its views.
struct Said {
    std::vector<std::string> notes;
    std::string refined;
    int reports = 0;
};

Result<std::unique_ptr<ViewTable>> openKept(const std::filesystem::path& set,
                                            ImageSetOptions options, std::uint64_t held, Job& job,
                                            Said& said) {
    options.refined = [&said](const RefineReport& report) {
        said.refined = report.text();
        ++said.reports;
    };
    return openSetViews(set, options, job, held);
}

void expectPointsOf(const ReferenceView& view, const std::vector<ColourPoint>& points) {
    const auto expected = colourPointsOf(view);
    EXPECT_GT(expected.size(), 20u);
    ASSERT_EQ(points.size(), expected.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
        EXPECT_EQ(points[k].world, expected[k].world) << k;
        EXPECT_EQ(points[k].normal, expected[k].normal) << k;
        EXPECT_EQ(points[k].colour, expected[k].colour) << k;
    }
}

/// Views one by one are those of the set in memory, and the same is said.
/// `keeps`: points at which colours are compared are kept of the first look.
void expectSameOnDemand(const std::filesystem::path& set, const ImageSetOptions& options,
                        const char* noted = nullptr, bool keeps = true) {
    Job job;
    Said whole, each;
    const auto held = openKept(set, options, kAllHeld, job, whole);
    ASSERT_TRUE(held) << held.error().text();
    ASSERT_TRUE((*held)->whole());
    whole.notes = job.takeNotes();
    const auto table = openKept(set, options, kNoneHeld, job, each);
    ASSERT_TRUE(table) << table.error().text();
    ASSERT_FALSE((*table)->whole());
    EXPECT_EQ((*table)->bytesHeld(), 0u);
    const Bundle &a = std::as_const(**held).about(), &b = std::as_const(**table).about();
    EXPECT_EQ(a.title, b.title);
    EXPECT_EQ(a.origin, b.origin);
    ASSERT_TRUE(a.bounds && b.bounds);
    EXPECT_EQ(a.bounds->min, b.bounds->min);
    EXPECT_EQ(a.bounds->max, b.bounds->max);
    ASSERT_EQ(a.views.size(), b.views.size());
    EXPECT_EQ((*held)->kinds(), (*table)->kinds());
    const auto* looked = dynamic_cast<const ViewsLookedAt*>(table->get());
    ASSERT_TRUE(looked);
    ASSERT_EQ(looked->colourPoints() != nullptr, keeps);
    // In another order than they are in the set, and the first again.
    for (std::size_t k = 0; k <= a.views.size(); ++k) {
        const std::size_t i = (2 * a.views.size() - 1 - k) % a.views.size();
        // What is read differently from the look at it is an error.
        const auto view = (*table)->view(i, job);
        ASSERT_TRUE(view) << view.error().text();
        EXPECT_EQ((*view)->name, a.views[i].name);
        EXPECT_EQ((*view)->camera, a.views[i].camera);
        EXPECT_EQ((*view)->nearPlane, a.views[i].nearPlane);
        EXPECT_EQ((*view)->farPlane, a.views[i].farPlane);
        EXPECT_EQ((*view)->noDepth, a.views[i].noDepth);
        EXPECT_TRUE(samePictures(**view, a.views[i])) << i;
        if (keeps) expectPointsOf(**view, (*looked->colourPoints())[i]);
    }
    each.notes = job.takeNotes();
    EXPECT_EQ(whole.notes, each.notes);
    EXPECT_EQ(whole.refined, each.refined);
    EXPECT_EQ(whole.reports, 1);
    EXPECT_EQ(each.reports, 1);
    if (noted) {
        EXPECT_TRUE(std::ranges::any_of(each.notes, [&](const std::string& note) {
            return note.find(noted) != std::string::npos;
        })) << noted;
    }
}

/// Views of the room, as a transforms.json with depth in millimetres, `first` before the frames;
/// the third disagrees with the others, or all do, as their poses `drift`.
void writeRoom(const TemporaryFolder& folder, const std::string& first, glm::dvec3 away = {},
               double drift = 0) {
    const auto views = roomViews(4);
    std::string frames;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const ReferenceView& v = views[i];
        const float scale = i == 2 && drift == 0 ? 1030.0f : 1000.0f;
        writeColour(folder / fmt::format("c{}.png", i), v);
        writeCodes(folder / fmt::format("d{}.png", i), v.camera.width, v.camera.height, 16,
                   [&](int x, int y) {
                       return hasPoint(v.depth.at(x, y)) ? scale * v.depth.at(x, y) + 0.5f : 0.0f;
                   });
        glm::dmat4 pose = v.camera.worldFromCamera();
        pose = pose * glm::rotate(glm::dmat4(1.0), i % 2 ? drift : -drift, {0.2, 1.0, 0.3});
        pose[3] += glm::dvec4(away, 0.0);
        frames += fmt::format(
            "{}{{\"file_path\":\"c{}.png\",\"depth_file_path\":\"d{}.png\",\"fl_x\":{},\"fl_y\":{},"
            "\"cx\":{},\"cy\":{},\"transform_matrix\":{}}}",
            i > 0 ? "," : "", i, i, v.camera.fx, v.camera.fy, v.camera.cx, v.camera.cy,
            rowsOf(pose));
    }
    writeText(folder / "transforms.json",
              "{\"w\":96,\"h\":64," + first + "\"frames\":[" + frames + "]}");
}

TEST(SetViewsOnDemand, AreThoseOfACaptureInMemory) {
    const TemporaryFolder folder;
    writeRoom(folder, "");
    expectSameOnDemand(folder.path(), {}, "disagree");
}

TEST(SetViewsOnDemand, AreThoseOfALensThatIsUndone) {
    const TemporaryFolder folder;
    writeRoom(folder, "\"camera_model\":\"OPENCV\",\"k1\":0.05,");
    ImageSetOptions options;
    options.depthBits = 8;
    expectSameOnDemand(folder.path(), options, "lens distortion");
}

TEST(SetViewsOnDemand, AreThoseOfASetThatIsFarAway) {
    const TemporaryFolder folder;
    writeRoom(folder, "", {4e6, -2e6, 1e5});
    expectSameOnDemand(folder.path(), {}, "is subtracted", false);
}

TEST(SetViewsOnDemand, AreThoseWhosePosesAreAligned) {
    for (const glm::dvec3 away : {glm::dvec3(0), glm::dvec3(4e6, -2e6, 1e5)}) {
        const TemporaryFolder folder;
        writeRoom(folder, "", away, glm::radians(0.5));
        expectSameOnDemand(folder.path(), {}, "poses refined", false);
        ImageSetOptions asked;
        asked.refine.set(RefineStep::poses, true);
        expectSameOnDemand(folder.path(), asked, "poses refined", false);
        // Each knows how its camera moved.
        Job job;
        const auto aligned = readImageSet(folder.path(), {}, job);
        ImageSetOptions without;
        without.refine.set(RefineStep::poses, false);
        const auto given = readImageSet(folder.path(), without, job);
        ASSERT_TRUE(aligned && given);
        for (std::size_t i = 0; i < given->views.size(); ++i) {
            const Camera& now = aligned->views[i].camera;
            const auto& move = aligned->views[i].refined.moved;
            ASSERT_TRUE(move);
            EXPECT_LT(glm::length(now.position - move->shift - given->views[i].camera.position),
                      1e-9);
            EXPECT_GT(glm::length(now.orientation - given->views[i].camera.orientation), 1e-3);
        }
    }
}

TEST(SetViewsOnDemand, AreAllLinearWhereOneIs) {
    const TemporaryFolder folder;
    writeRoom(folder, "");
    std::vector<std::uint16_t> deep(96 * 64 * 3);
    for (std::size_t i = 0; i < deep.size(); ++i) deep[i] = static_cast<std::uint16_t>(i * 7919);
    const auto png = encodePng(96, 64, 3, 16, deep.data(), true);
    ASSERT_TRUE(png);
    writeBytes(folder / "c1.png", *png);
    ImageSetOptions options;
    options.deepColour = true;
    expectSameOnDemand(folder.path(), options, nullptr, false);
}

TEST(SetViewsOnDemand, AreThoseOfOurExportsAndColmaps) {
    Bundle bundle;
    bundle.views = roomViews(3);
    for (std::size_t i = 0; i < 3; ++i) bundle.views[i].name = fmt::format("v{}", i);
    for (const auto kind : {ExportOptions::Kind::transforms, ExportOptions::Kind::colmap}) {
        const TemporaryFolder folder;
        Job job;
        ExportOptions write;
        write.kind = kind;
        const auto done = exportViews(*viewsOf(bundle), folder / "set", write, job);
        ASSERT_TRUE(done) << done.error().text();
        expectSameOnDemand(folder / "set", {});
    }
}

TEST(SetViewsOnDemand, AreLeftOutWhereFilesAreMissing) {
    const TemporaryFolder folder;
    writeRoom(folder, "");
    std::filesystem::remove(folder / "d0.png");
    expectSameOnDemand(folder.path(), {}, "1 of 4 views is left out");
}

TEST(SetViewsOnDemand, AreInMemoryWhereTheyTakeLittle) {
    const TemporaryFolder folder;
    writeRoom(folder, "");
    Job job;
    const auto table = openSetViews(folder.path(), {}, job, heldWhole(job.limits));
    ASSERT_TRUE(table) << table.error().text();
    EXPECT_TRUE((*table)->whole());
}

TEST(SetViewsOnDemand, AreNotReadFromAFileThatHasChanged) {
    const TemporaryFolder folder;
    writeRoom(folder, "");
    Job job;
    const auto table = openSetViews(folder.path(), {}, job, kNoneHeld);
    ASSERT_TRUE(table) << table.error().text();
    // The same picture at another time may be another one in parts.
    const auto file = folder / "d1.png";
    std::filesystem::last_write_time(
        file, std::filesystem::last_write_time(file) + std::chrono::seconds(2));
    EXPECT_TRUE((*table)->view(0, job));
    const auto changed = (*table)->view(1, job);
    ASSERT_FALSE(changed);
    EXPECT_EQ(changed.error().code, ErrorCode::invalidInput);
    EXPECT_NE(changed.error().text().find("d1.png' was changed while it was read"),
              std::string::npos)
        << changed.error().text();
    std::filesystem::remove(folder / "c2.png");
    const auto gone = (*table)->view(2, job);
    ASSERT_FALSE(gone);
    EXPECT_EQ(gone.error().code, ErrorCode::invalidInput);
}

TEST(SetViewsOnDemand, AreRefusedBeforeTheyAreReadWhereOneDoesNotFit) {
    const TemporaryFolder folder;
    writeRoom(folder, "");
    // It is not read, or this would be the error.
    writeText(folder / "c0.png", "no picture");
    Job job;
    job.limits.maxMemoryBytes = 96 * 64 * 12;
    const auto table = openSetViews(folder.path(), {}, job, kNoneHeld);
    ASSERT_FALSE(table);
    EXPECT_EQ(table.error().code, ErrorCode::invalidInput);
    EXPECT_NE(table.error().text().find("more than the memory limit"), std::string::npos)
        << table.error().text();
}

TEST(SetViewsOnDemand, ThatCannotBeReadAreErrorsAtOnce) {
    const TemporaryFolder folder;
    writeRoom(folder, "");
    writeText(folder / "c3.png", "no picture");
    Job job;
    const auto each = openSetViews(folder.path(), {}, job, kNoneHeld);
    const auto whole = readImageSet(folder.path(), {}, job);
    ASSERT_FALSE(each);
    ASSERT_FALSE(whole);
    EXPECT_EQ(each.error().code, whole.error().code);
    EXPECT_EQ(each.error().text(), whole.error().text());
}

}  // namespace
