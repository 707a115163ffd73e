#include <algorithm>

#include "lib/model/view_table.hpp"
#include "lib/packing/packing.hpp"
#include "lib/render/bench/analytic_scene.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/viewer/read_page.hpp"

/// Which views and points a page holds, and where memory does not hold all.
namespace {

using namespace stx;
using namespace stx::pages;

/// Views that are read when they are asked for.
class OnDemand : public Sequence {
  public:
    explicit OnDemand(Bundle bundle) : bundle_(std::move(bundle)) {}
    Result<Bundle> frame(std::size_t, Job&) override { return bundle_; }
    Result<std::unique_ptr<ViewTable>> views(std::size_t, Job&) override {
        class Table : public ViewTable {
          public:
            explicit Table(const Bundle& all)
                : ViewTable(headersOf(all),
                            std::vector(all.views.size(), ViewImageKinds::of(all.views[0]))),
                  all_(all) {}
            Result<std::shared_ptr<const ReferenceView>> make(std::size_t index,
                                                              Job&) const override {
                return std::make_shared<const ReferenceView>(all_.views[index]);
            }
            const Bundle& all_;
        };
        return std::make_unique<Table>(bundle_);
    }

  private:
    Bundle bundle_;
};

TEST(ViewerPage, HoldsAsManyViewsAsThereIsMemoryFor) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = smallBundle(7, 16, false, false);
    bundle.views[3].background = true;
    OnDemand views(bundle);
    const PageOptions options{"a.exr", {}, {}, {}};
    const auto whole = writeViewerPage(views, folder.path() / "whole.html", options, job);
    // At 44 bytes a pixel the views take from 17 to 85 kB: four of the six, and the other two.
    job.limits.maxMemoryBytes = 160'000;
    const auto parts = writeViewerPage(views, folder.path() / "parts.html", options, job);
    ASSERT_TRUE(whole && parts) << parts.error().text();
    EXPECT_EQ(parts->points, whole->points);
    EXPECT_EQ(parts->views, 7u);
    const ReadPage one = readPage(folder.path() / "whole.html"),
                   two = readPage(folder.path() / "parts.html");
    Json of = two.json("data");
    EXPECT_EQ(of["without"], "coarse");
    of.erase("without");
    EXPECT_EQ(one.json("data"), of);
    EXPECT_EQ(one.json("scene0")["views"], two.json("scene0")["views"]);
    EXPECT_EQ(one.json("scene0")["pages"].size(), 1u);
    EXPECT_EQ(two.json("scene0")["pages"].size(), 2u);
    for (const Json& r : two.json("scene0")["rectangles"]) EXPECT_EQ(r[0].get<int>() / 4, r[1]);
    EXPECT_EQ(one.json("scene1")["views"], two.json("scene1")["views"]) << "behind them";
    job.limits.maxMemoryBytes = 60'000;
    const auto none = writeViewerPage(views, folder.path() / "none.html", options, job);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::invalidInput);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "none.html"));
}

/// A wall that two views see, who lack the depth of a part of it.
Bundle wallWithoutSomeDepth() {
    Bundle bundle = smallBundle(2, 16, false, false);
    for (ReferenceView& view : bundle.views) {
        view.noDepth = NoDepth::unknown;
        const int width = view.camera.width, height = view.camera.height;
        view.camera.orthographic = false;
        view.texture = Rgba8Image(width, height, glm::u8vec4(90, 120, 150, 255));
        view.depth =
            Image<float>(width, height, static_cast<float>(0.5 * (view.nearPlane + view.farPlane)));
        for (int y = 8; y < 15; ++y)
            for (int x = 8; x < 15; ++x) view.depth.at(x, y) = kNoDepth;
    }
    return bundle;
}

TEST(ViewerPage, HoldsColoursWithoutDepthBehindAllElse) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = wallWithoutSomeDepth();
    ASSERT_TRUE(write(bundle, folder.path() / "a.html", job));
    const ReadPage page = readPage(folder.path() / "a.html");
    ASSERT_EQ(page.json("data")["frames"][0].size(), 2u);
    EXPECT_FALSE(page.json("data").contains("without"));
    const int behind = page.json("data")["frames"][0][1];
    const Json scene = page.json(fmt::format("scene{}", behind));
    ASSERT_GE(scene["views"].size(), 2u);
    for (const Json& view : scene["views"]) EXPECT_EQ(view["noDepth"], "unknown");
    // An atlas of the same holds them, too.
    const auto atlas = pack(bundle, {}, job);
    ASSERT_TRUE(atlas);
    ASSERT_TRUE(writeViewerPage(*atlas, folder.path() / "b.html", {"atlas", {}, {}, {}}, job));
    EXPECT_EQ(readPage(folder.path() / "b.html").json("data")["frames"][0].size(), 2u);
    // Where nothing is there is nothing to hold.
    for (ReferenceView& view : bundle.views) view.noDepth = NoDepth::empty;
    ASSERT_TRUE(write(bundle, folder.path() / "c.html", job));
    EXPECT_EQ(readPage(folder.path() / "c.html").json("data")["frames"][0].size(), 1u);
}

TEST(ViewerPage, SaysThatColoursWithoutDepthHaveNoRoom) {
    const TemporaryFolder folder;
    Job job;
    OnDemand views(wallWithoutSomeDepth());
    // The page needs 44 to 55 bytes for each of 963 pixels, with what is behind 60.
    job.limits.maxMemoryBytes = 54'000;
    const auto report =
        writeViewerPage(views, folder.path() / "a.html", {"a.exr", {}, {}, {}}, job);
    ASSERT_TRUE(report) << report.error().text();
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("colours without depth are not on the page"), std::string::npos);
    const Json data = readPage(folder.path() / "a.html").json("data");
    EXPECT_EQ(data["frames"][0].size(), 1u);
    EXPECT_EQ(data["without"], "unmeasured") << "the command draws what the page shows";
}

/// Their splats stick out beyond the outlines that finer views know.
TEST(ViewerPage, LeavesOutPointsThatOthersShowMoreFinely) {
    const TemporaryFolder folder;
    Bundle mixed;
    const auto viewOf = [](double number, int side) {
        return viewOfAnalyticScene(
            AnalyticScene::object,
            analyticCamera(AnalyticScene::object, number, 8).resized(side, side), 2);
    };
    for (int i = 0; i < 8; ++i) mixed.views.push_back(viewOf(i, 96));
    const Bundle fine = mixed;
    mixed.views.push_back(viewOf(2.2, 12));
    const std::int64_t points = fine.pointCount();
    ASSERT_GT(mixed.pointCount(), points);
    for (const bool memory : {true, false}) {
        Job job;
        OnDemand views(mixed);
        // A view at a time has room.
        if (!memory) job.limits.maxMemoryBytes = 1'000'000;
        const auto page =
            writeViewerPage(views, folder.path() / "page.html", {"a.exr", {}, {}, {}}, job);
        ASSERT_TRUE(page) << page.error().text();
        EXPECT_EQ(page->points, memory ? points : mixed.pointCount());
        EXPECT_EQ(page->views, 9u);
        // Where the object is not, says a view that is drawn from: such a coarse one may not.
        const ReadPage read = readPage(folder.path() / "page.html");
        EXPECT_EQ(read.json("scene0")["views"].size(), memory ? 8u : 9u);
        EXPECT_EQ(read.json("data")["cameras"].size(), 9u);
        EXPECT_EQ(read.json("data").value("without", ""), memory ? "" : "coarse");
        const auto notes = job.takeNotes();
        EXPECT_EQ(std::ranges::count_if(notes,
                                        [](const std::string& note) {
                                            return note.find("twice as finely") !=
                                                   std::string::npos;
                                        }),
                  memory ? 0 : 1);
    }
    Job job;
    const auto atlas = pack(mixed, {}, job);
    ASSERT_TRUE(atlas);
    const auto page =
        writeViewerPage(*atlas, folder.path() / "atlas.html", {"a.exr", {}, {}, {}}, job);
    ASSERT_TRUE(page) << page.error().text();
    EXPECT_EQ(page->points, points);
}

}  // namespace
