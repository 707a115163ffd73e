// What is done to depth on its way in, and what is said about it.

#include <cmath>

#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

TEST(Depth, LossOf8BitsIsToldInSceneUnits) {
    TemporaryFolder folder;
    const auto view = roomViews(1)[0];
    const Camera& c = view.camera;
    writeColour(folder / "a.png", view);
    writeCodes(folder / "d.png", 96, 64, 16,
               [&](int x, int y) { return std::lround(view.depth.at(x, y) * 1000); });
    writeText(folder / "transforms.json",
              fmt::format("{{\"w\":96,\"h\":64,\"fl_x\":{},\"frames\":[{}]}}", c.fx,
                          transformsFrame(c.worldFromCamera(), ",\"depth_file_path\":\"d.png\"")));
    ImageSetOptions options;
    options.depthBits = 8;
    Job job;
    const auto read = readImageSet(folder.path(), options, job);
    ASSERT_TRUE(read) << read.error().text();
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    const auto& v = read->views[0];
    const double half = (v.farPlane - v.nearPlane) / 254 / 2;
    EXPECT_NE(notes[0].find(fmt::format("8 bits is exact to {:.3g} scene units", half)),
              std::string::npos)
        << notes[0];
    const auto exact = readSet(folder.path());
    ASSERT_TRUE(exact);
    double worst = 0;
    for (std::size_t i = 0; i < v.depth.count(); ++i) {
        ASSERT_EQ(hasPoint(v.depth.data()[i]), hasPoint(exact->views[0].depth.data()[i]));
        worst = std::max(worst, std::abs(static_cast<double>(v.depth.data()[i]) -
                                         exact->views[0].depth.data()[i]));
    }
    EXPECT_LE(worst, half * 1.0001);
    EXPECT_GT(worst, half * 0.9);
}

TEST(Depth, FlyingPointsOfSensorsAreDroppedUnlessKept) {
    TemporaryFolder folder;
    ReferenceView plain;
    plain.texture = Rgba8Image(96, 64, {10, 200, 30, 255});
    writeColour(folder / "frame-000000.color.png", plain);
    // A box before a wall, and between them what a sensor makes of an edge.
    writeCodes(folder / "frame-000000.depth.png", 96, 64, 16, [](int x, int) {
        return x < 40 ? 1000 : x == 40 ? 1700 : 2500;
    });
    writeText(folder / "frame-000000.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    ImageSetOptions options;
    const double k[4] = {80, 80, 47.5, 31.5};
    std::copy(k, k + 4, options.intrinsics);
    Job job;
    const auto dropped = readImageSet(folder.path(), options, job);
    ASSERT_TRUE(dropped) << dropped.error().text();
    EXPECT_EQ(dropped->views[0].pointCount(), 95 * 64);
    EXPECT_FALSE(hasPoint(dropped->views[0].depth.at(40, 30)));
    std::string notes;
    for (const auto& note : job.takeNotes()) notes += note + "\n";
    EXPECT_NE(notes.find("64 mixed pixels"), std::string::npos) << notes;
    options.refine.set(RefineStep::mixed, false);
    const auto kept = readImageSet(folder.path(), options, job);
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->views[0].pointCount(), 96 * 64);
    EXPECT_NEAR(kept->views[0].depth.at(40, 30), 1.7, 1e-4);
}

/// 8-bit depth is smoothed within half a step by default and left alone on demand.
TEST(Depth, StairsOf8BitsAreSmoothedWithinHalfAStep) {
    TemporaryFolder folder;
    ReferenceView plain;
    plain.texture = Rgba8Image(96, 64, {10, 200, 30, 255});
    writeColour(folder / "a_texture.png", plain);
    const auto code = [](int x, int y) { return 40 + 0.11 * x + 0.04 * y; };
    writeCodes(folder / "a_depth.png", 96, 64, 8,
               [&](int x, int y) { return std::lround(code(x, y)); });
    writeText(folder / "list.json", mivJson(96, 64, "[1,20]"));
    double error[2] = {0, 0};
    for (const bool smooth : {false, true}) {
        ImageSetOptions options;
        options.depthBits = 32;
        if (!smooth) options.refine.set(RefineStep::steps, false);
        Job job;
        const auto read = readImageSet(folder.path(), options, job);
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ(job.takeNotes().size(), smooth ? 1u : 0u);
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 96; ++x) {
                const double s = (20 / static_cast<double>(read->views[0].depth.at(x, y)) - 1) / 19;
                ASSERT_EQ(std::lround(s * 255), std::lround(code(x, y)));
                error[smooth] += std::pow(s * 255 - code(x, y), 2);
            }
    }
    EXPECT_LT(error[1], error[0] / 9);  // rms a third
}

/// Finer codes are smoothed where a step is more than 0.3 % of the distance: here 0.6 and 0.15 %.
TEST(Depth, StairsOf10BitsAreSmoothedWhereTheyAreCoarse) {
    for (const int least : {100, 600}) {
        const TemporaryFolder folder;
        const auto code = [&](int x, int y) { return least + 0.11 * x + 0.04 * y; };
        std::string texture(96 * 64 * 3 / 2, char(100)), depth;
        const auto add = [&](long value) {
            depth += static_cast<char>(value & 255);
            depth += static_cast<char>(value >> 8);
        };
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 96; ++x) add(std::lround(code(x, y)));
        for (int i = 0; i < 96 * 64 / 2; ++i) add(512);
        writeText(folder / "a_texture_96x64_yuv420p.yuv", texture);
        writeText(folder / "a_depth_96x64_yuv420p10le.yuv", depth);
        writeText(folder / "list.json", mivJson(96, 64, "[1,20]"));
        ImageSetOptions options;
        options.depthBits = 32;
        Job job;
        const auto read = readImageSet(folder.path(), options, job);
        ASSERT_TRUE(read) << read.error().text();
        double error = 0;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 96; ++x) {
                const double s = (20 / static_cast<double>(read->views[0].depth.at(x, y)) - 1) / 19;
                error += std::pow(s * 1023 - code(x, y), 2) / (96 * 64);
            }
        // Rounding to whole codes is off by a twelfth.
        if (least == 100)
            EXPECT_LT(error, 1.0 / 12 / 9);
        else
            EXPECT_NEAR(error, 1.0 / 12, 0.01);
    }
}

}  // namespace
