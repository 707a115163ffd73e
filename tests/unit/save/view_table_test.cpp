// Views that are read when they are asked for: the same as those that are read at once, and damage
// that shows at the view that has it.
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <thread>

#include "formats/any/open.hpp"
#include "formats/any/save.hpp"
#include "formats/files/file_spool.hpp"
#include "formats/imagesets/export.hpp"
#include "lib/base/parallel.hpp"
#include "lib/model/same_pictures.hpp"
#include "lib/surface/normals.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/torus_bundle.hpp"
#include "tests/unit/mpeg4/mapping_fixtures.hpp"

namespace stx {
namespace {

/// Three views: one whose principal point is off the centre, one whose depth may be unknown.
Bundle threeViews(bool vectors) {
    Bundle bundle;
    bundle.title = "three";
    bundle.origin = {1000, 2000, 3000};
    for (int i = 1; i <= 3; ++i)
        bundle.views.push_back(mpeg4::makeView(40 + 4 * i, 24, i == 2 ? 8 : 16, i));
    bundle.views[0].camera.cx += 3;
    bundle.views[2].noDepth = NoDepth::unknown;
    if (vectors)
        for (ReferenceView& view : bundle.views) mpeg4::addVectors(view);
    return bundle;
}

Bytes bytesOf(const std::filesystem::path& path) {
    return readFile(path, Limits()).value();
}

TEST(ViewTable, GivesTheViewsThatAreReadAtOnce) {
    const TemporaryFolder folder;
    for (const bool vectors : {false, true}) {
        for (const char* name : {"a.exr", "a.mp4", "a.bt"}) {
            SCOPED_TRACE(name);
            Job job;
            ASSERT_TRUE(saveBundle(threeViews(vectors), folder / name, {}, job));
            const auto whole = openBundle(folder / name, {}, job);
            ASSERT_TRUE(whole) << whole.error().text();
            const auto table = openViews(folder / name, {}, job);
            ASSERT_TRUE(table) << table.error().text();
            EXPECT_FALSE((*table)->whole());
            EXPECT_EQ((*table)->bytesHeld(), 0u);
            EXPECT_EQ((*table)->about().title, "three");
            EXPECT_EQ((*table)->about().origin, whole->origin);
            EXPECT_EQ((*table)->about().bounds, whole->bounds);
            ASSERT_EQ((*table)->count(), whole->views.size());
            // In any order, and twice.
            for (const std::size_t i : {2u, 0u, 1u, 2u}) {
                const auto view = (*table)->view(i, job);
                ASSERT_TRUE(view) << view.error().text();
                const ReferenceView& expected = whole->views[i];
                EXPECT_EQ((*view)->name, expected.name);
                EXPECT_EQ((*view)->camera, expected.camera);
                EXPECT_EQ((*view)->nearPlane, expected.nearPlane);
                EXPECT_EQ((*view)->farPlane, expected.farPlane);
                EXPECT_EQ((*view)->depthBits, expected.depthBits);
                EXPECT_TRUE(samePictures(**view, expected));
            }
        }
    }
}

TEST(ViewTable, IsWrittenAsItsBundleIs) {
    const TemporaryFolder folder;
    for (const bool bounded : {false, true}) {
        Bundle bundle = threeViews(true);
        if (bounded) bundle.bounds = Bounds{glm::dvec3(-9), glm::dvec3(9)};
        Job job;
        for (const char* from : {"from.exr", "from.mp4"}) {
            ASSERT_TRUE(saveBundle(bundle, folder / from, {}, job));
            for (const char* to : {"a.exr", "a.mp4", "a.xmt"}) {
                SCOPED_TRACE(std::string(from) + " to " + to);
                const auto whole = openBundle(folder / from, {}, job);
                ASSERT_TRUE(whole);
                ASSERT_TRUE(saveBundle(*whole, folder / to, {}, job));
                const Bytes expected = bytesOf(folder / to);
                const auto table = openViews(folder / from, {}, job);
                ASSERT_TRUE(table);
                const auto saved = saveViews(**table, folder / to, {}, job);
                ASSERT_TRUE(saved) << saved.error().text();
                EXPECT_TRUE(bytesOf(folder / to) == expected);
            }
        }
    }
}

TEST(ViewTable, WithoutAnyPointIsWrittenWithoutBounds) {
    const TemporaryFolder folder;
    Bundle bundle = threeViews(false);
    for (ReferenceView& view : bundle.views) std::ranges::fill(view.depth.pixels(), kNoDepth);
    Job job;
    ASSERT_TRUE(saveBundle(bundle, folder / "a.exr", {}, job));
    const auto back = openBundle(folder / "a.exr", {}, job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_FALSE(back->bounds);
}

TEST(ViewTable, TellsThatItsFileChanged) {
    const TemporaryFolder folder;
    for (const char* name : {"a.exr", "a.mp4"}) {
        SCOPED_TRACE(name);
        for (const bool shorter : {false, true}) {
            Job job;
            ASSERT_TRUE(saveBundle(threeViews(false), folder / name, {}, job));
            const auto table = openViews(folder / name, {}, job);
            ASSERT_TRUE(table);
            EXPECT_TRUE((*table)->view(0, job));
            if (shorter) {
                std::filesystem::resize_file(folder / name,
                                             std::filesystem::file_size(folder / name) / 2);
            } else {
                // As large, at another time.
                std::filesystem::last_write_time(
                    folder / name,
                    std::filesystem::file_time_type::clock::now() + std::chrono::seconds(5));
            }
            const auto view = (*table)->view(1, job);
            ASSERT_FALSE(view);
            EXPECT_EQ(view.error().code, ErrorCode::invalidInput);
            EXPECT_NE(view.error().text().find("was changed while it was read"), std::string::npos)
                << view.error().text();
            const auto saved = saveViews(**table, folder / "out.exr", {}, job);
            ASSERT_FALSE(saved);
            EXPECT_EQ(saved.error().code, ErrorCode::invalidInput);
            EXPECT_FALSE(std::filesystem::exists(folder / "out.exr"));
        }
    }
}

/// A table that says less than is there, and counts who asks at a time.
class MadeViews : public ViewTable {
  public:
    MadeViews(const Bundle& bundle, Bundle headers)
        : ViewTable(std::move(headers), std::vector<ViewImageKinds>(bundle.views.size())),
          bundle_(bundle) {}

    mutable std::atomic<int> now = 0, most = 0;

  protected:
    Result<std::shared_ptr<const ReferenceView>> make(std::size_t index, Job&) const override {
        const int asked = ++now;
        for (int was = most; asked > was && !most.compare_exchange_weak(was, asked);) {
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        --now;
        return std::make_shared<ReferenceView>(bundle_.views[index]);
    }

  private:
    const Bundle& bundle_;
};

TEST(ViewTable, ThatLiesIsDamage) {
    const Bundle bundle = threeViews(false);
    const TemporaryFolder folder;
    for (const int lie : {0, 1, 2}) {
        Bundle headers = headersOf(bundle);
        if (lie == 0) headers.views[1].camera.width += 1;
        if (lie == 1) headers.views[1].farPlane += 1;
        if (lie == 2) headers.views[1].depthBits = 16;
        const MadeViews table(bundle, headers);
        Job job;
        EXPECT_TRUE(table.view(0, job));
        const auto view = table.view(1, job);
        ASSERT_FALSE(view);
        EXPECT_EQ(view.error().code, ErrorCode::invalidInput);
        EXPECT_NE(view.error().text().find("view 1: "), std::string::npos) << view.error().text();
        for (const char* name : {"out.exr", "out.mp4"}) {
            EXPECT_FALSE(saveViews(table, folder / name, {}, job));
            EXPECT_FALSE(std::filesystem::exists(folder / name));
        }
    }
}

TEST(ViewTable, HoldsAsManyViewsAsThereAreThreadsAndRoom) {
    Bundle bundle;
    for (int i = 0; i < 12; ++i) bundle.views.push_back(mpeg4::makeView(40, 24, 16, i));
    const ThreadLimit threads(3);
    const auto mostOf = [&](std::uint64_t memory, std::uint64_t perPixel) {
        const MadeViews table(bundle, headersOf(bundle));
        Job job;
        job.limits.maxMemoryBytes = memory;
        std::vector<std::size_t> order;
        const auto done = forEachView(
            table, {"looking", perPixel}, job,
            [](std::size_t, std::shared_ptr<const ReferenceView>) { return Result<void>(); },
            [&](std::size_t i) -> Result<void> {
                order.push_back(i);
                return {};
            });
        if (!done) {
            EXPECT_EQ(done.error().code, ErrorCode::invalidInput);
            EXPECT_NE(done.error().message.find("looking with views of 960 pixels needs 1 MiB"),
                      std::string::npos)
                << done.error().message;
            return 0;
        }
        EXPECT_EQ(order.size(), 12u);
        EXPECT_TRUE(std::ranges::is_sorted(order));
        return table.most.load();
    };
    const std::uint64_t view = 40 * 24 * 8;
    EXPECT_LE(mostOf(100 * view, 0), 3);
    EXPECT_EQ(mostOf(view, 0), 1);
    EXPECT_EQ(mostOf(2 * view, 8), 1);
    // Before the first is read.
    EXPECT_EQ(mostOf(view, 8), 0);
}

TEST(ViewTable, IsReadUntilThatIsEnough) {
    Bundle bundle;
    for (int i = 0; i < 12; ++i) bundle.views.push_back(mpeg4::makeView(40, 24, 16, i));
    const ThreadLimit threads(3);
    const MadeViews table(bundle, headersOf(bundle));
    Job job;
    std::atomic<int> looked = 0;
    ASSERT_TRUE(forEachView(
        table, {"looking", 0}, job,
        [&](std::size_t, std::shared_ptr<const ReferenceView>) -> Result<void> {
            ++looked;
            return {};
        },
        {}, [&] { return looked >= 4; }));
    EXPECT_EQ(looked, 6) << "a round is not broken off";
}

TEST(ViewTable, OfASpoolIsWrittenAsItsBundleIs) {
    const TemporaryFolder folder;
    const Bundle bundle = threeViews(true);
    Job job;
    ASSERT_TRUE(saveBundle(bundle, folder / "a.exr", {}, job));
    std::unique_ptr<ViewTable> table;
    {
        const auto read = openViews(folder / "a.exr", {}, job);
        ASSERT_TRUE(read);
        auto spool = FileSpool::create(folder.path(), 0);
        ASSERT_TRUE(spool);
        auto inSpool = wholeBundle(**read, **spool, job);
        ASSERT_TRUE(inSpool) << inSpool.error().text();
        table = tableOf(*std::move(inSpool), *std::move(spool), 1000);
    }
    EXPECT_FALSE(table->whole());
    EXPECT_EQ(table->bytesHeld(), 1000u);
    EXPECT_EQ(std::as_const(*table).about().title, "three");
    ASSERT_TRUE(saveViews(*table, folder / "b.exr", {}, job));
    EXPECT_EQ(bytesOf(folder / "b.exr"), bytesOf(folder / "a.exr"));
    // What is in memory is a copy, which outlives the spool.
    const auto expected = openBundle(folder / "a.exr", {}, job);
    ASSERT_TRUE(expected);
    const auto whole = wholeBundle(std::move(table), job);
    ASSERT_TRUE(whole) << whole.error().text();
    for (std::size_t i = 0; i < bundle.views.size(); ++i)
        EXPECT_TRUE(samePictures(whole->views[i], expected->views[i])) << i;
}

TEST(ViewTable, MemoryFromASpoolIsThatOfAsManyAsThereIsRoomFor) {
    Bundle bundle;
    for (int i = 0; i < 12; ++i) bundle.views.push_back(mpeg4::makeView(40, 24, 16, i));
    const ThreadLimit threads(3);
    const MadeViews table(bundle, headersOf(bundle));
    constexpr std::uint64_t kPixels = 40 * 24;
    const PeakMemory work{"looking", 24};
    Limits limits;
    for (const std::uint64_t views : {1u, 2u, 3u, 9u}) {
        // A little more than so many views and the spool.
        limits.maxMemoryBytes = 34 * (views * 32 * kPixels) / 32;
        EXPECT_EQ(
            memoryFromSpool(table, work, limits),
            limits.maxMemoryBytes / kSpoolPart + std::min<std::uint64_t>(views, 3) * 32 * kPixels)
            << views;
    }
    limits.maxMemoryBytes = 32 * kPixels;
    EXPECT_GT(memoryFromSpool(table, work, limits), limits.maxMemoryBytes) << "one is too large";
}

TEST(ViewTable, IsBakedAndExportedAsItsBundleIs) {
    const TemporaryFolder folder;
    const Bundle bundle = torusViews(48);
    Job job;
    ASSERT_TRUE(saveBundle(bundle, folder / "a.exr", {}, job));
    Bundle baked = bundle;
    ASSERT_TRUE(bake(baked, {}, job));
    auto table = openViews(folder / "a.exr", {}, job);
    ASSERT_TRUE(table);
    const auto change = bakeOfViews({});
    ASSERT_TRUE(change);
    const auto changed = changedViews(std::move(*table), *change);
    for (std::size_t i = 0; i < bundle.views.size(); ++i) {
        const auto view = changed->view(i, job);
        ASSERT_TRUE(view) << view.error().text();
        EXPECT_TRUE(samePictures(**view, baked.views[i]));
    }
    for (const auto kind :
         {ExportOptions::Kind::transforms, ExportOptions::Kind::miv, ExportOptions::Kind::colmap}) {
        ExportOptions options;
        options.kind = kind;
        ASSERT_TRUE(exportViews(*viewsOf(baked), folder / "whole", options, job));
        const auto exported = exportViews(*changed, folder / "table", options, job);
        ASSERT_TRUE(exported) << exported.error().text();
        std::size_t files = 0;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "whole")) {
            if (!entry.is_regular_file()) continue;
            ++files;
            EXPECT_TRUE(bytesOf(entry.path()) ==
                        bytesOf(folder / "table" /
                                std::filesystem::relative(entry.path(), folder / "whole")))
                << entry.path();
        }
        EXPECT_GT(files, bundle.views.size());
        std::filesystem::remove_all(folder / "whole");
        std::filesystem::remove_all(folder / "table");
    }
}

TEST(ViewTable, OfAMeshLeavesOutViewsThatSeeNothing) {
    Mesh mesh;
    mesh.materials.emplace_back();
    mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.triangleMaterial = {0};
    mesh.materials[0].doubleSided = true;
    std::vector<Camera> cameras;
    for (int i = 0; i < 5; ++i) {
        // The third looks away.
        const double turn = i == 2 ? 3.14159265 : 0.1 * i;
        cameras.push_back(Camera::fromFieldOfView({0, 0, 4}, quatFromAxisAngle({0, 1, 0, turn}),
                                                  {0.8, 0.8}, false, 32, 32));
    }
    Job job, streamed;
    const auto whole = captureBundle(mesh, cameras, {}, job);
    ASSERT_TRUE(whole) << whole.error().text();
    ASSERT_EQ(whole->views.size(), 4u);
    const TemporaryFolder folder;
    ASSERT_TRUE(saveBundle(*whole, folder / "whole.exr", {}, job));
    int calls = 0;
    const auto done =
        withCapturedViews(mesh, cameras, {}, streamed,
                          [&](std::unique_ptr<ViewTable> table, Job& part) -> Result<void> {
                              ++calls;
                              part.note("said once");
                              return saveViews(*table, folder / "table.exr", {}, part);
                          });
    ASSERT_TRUE(done) << done.error().text();
    EXPECT_EQ(calls, 2);
    EXPECT_TRUE(bytesOf(folder / "whole.exr") == bytesOf(folder / "table.exr"));
    const auto notes = streamed.takeNotes();
    EXPECT_EQ(notes, (std::vector<std::string>{"view 2 sees nothing of the model and was left out",
                                               "said once"}));
    const auto blind = withCapturedViews(
        mesh, {cameras[2]}, {}, streamed, [&](std::unique_ptr<ViewTable> table, Job& part) {
            return saveViews(*table, folder / "none.exr", {}, part);
        });
    ASSERT_FALSE(blind);
    EXPECT_EQ(blind.error().message, captureBundle(mesh, {cameras[2]}, {}, job).error().message);
    EXPECT_FALSE(std::filesystem::exists(folder / "none.exr"));
}

}  // namespace
}  // namespace stx
