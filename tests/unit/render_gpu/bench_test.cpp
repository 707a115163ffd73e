#include "lib/render/bench/bench.hpp"
#include "lib/render/factory.hpp"

#include "tests/unit/render_gpu/gpu_fixture.hpp"

namespace stx {
namespace {

TEST(Bench, HasThePapersPointCounts) {
    // Lee & Park: 45,012, 83,521 and 167,980 points from 256x256 views, about 15 % of them object.
    for (const auto& [references, papers] : {std::pair{4, 45012}, {9, 83521}, {16, 167980}}) {
        const auto points = analyticBundle(AnalyticScene::object, references).pointCount();
        EXPECT_GT(points, papers * 0.8) << references;
        EXPECT_LT(points, papers * 1.25) << references;
    }
    EXPECT_EQ(analyticBundle(AnalyticScene::room, 1).pointCount(), 786432);
}

TEST(Bench, MeasuresThePathsAskedFor) {
    BenchSettings settings;
    settings.table2 = false;
    settings.repeats = 1;
    settings.paths = {"software", "points"};
    Job job;
    const auto report = runBench(settings, job);
    ASSERT_TRUE(report) << report.error().text();
    ASSERT_EQ(report->rows.size(), 6u);
    for (const auto& row : report->rows) {
        EXPECT_EQ(row.table, 1);
        EXPECT_GT(row.fps, 0);
        EXPECT_NEAR(row.mpps, row.fps * static_cast<double>(row.points) * 1e-6, row.mpps * 1e-6);
    }
    EXPECT_EQ(report->rows[5].references, 16);
    EXPECT_EQ(report->rows[5].path, "points");
}

TEST(GpuBench, LeavesSurfacesOnSoftwareDriversToThoseWhoAsk) {
    REQUIRE_GPU();
    Job devices;
    if (!listDevices(devices)[0].software) GTEST_SKIP() << "a hardware GPU is here";
    BenchSettings settings;
    settings.table2 = false;
    settings.repeats = 1;
    settings.paths = {"surface-gpu"};
    Job job;
    const auto named = runBench(settings, job);
    ASSERT_TRUE(named) << named.error().text();
    EXPECT_EQ(named->rows.size(), 3u);
    settings.paths.clear();
    const auto all = runBench(settings, job);
    ASSERT_TRUE(all) << all.error().text();
    for (const auto& row : all->rows) EXPECT_NE(row.path, "surface-gpu");
    bool said = false;
    for (const auto& note : job.takeNotes())
        said = said || note.find("surface-gpu") != std::string::npos;
    EXPECT_TRUE(said);
}

TEST(Bench, RefusesUnknownPaths) {
    BenchSettings settings;
    settings.paths = {"magic"};
    Job job;
    const auto report = runBench(settings, job);
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::usage);
    EXPECT_NE(report.error().message.find("magic"), std::string::npos);
}

TEST(Bench, WritesTheTwoTables) {
    BenchReport report;
    report.device = "A GPU";
    report.processor = "CPU";
    report.threads = 2;
    report.rows = {{1, 4, 45000, "shader", "data", 100.5, 4.5225},
                   {2, 1, 786432, "gl", "paper", 2, 1.572864}};
    const std::string text = benchText(report);
    EXPECT_EQ(text.find("GPU: A GPU\nCPU: CPU, 2 threads\n"), 0u) << text;
    EXPECT_NE(text.find("Table 1: an object, views of 256x256"), std::string::npos) << text;
    EXPECT_NE(text.find("Table 2: a full scene, views of 1024x768"), std::string::npos) << text;
    EXPECT_NE(text.find("100.50"), std::string::npos) << text;
}

}  // namespace
}  // namespace stx
