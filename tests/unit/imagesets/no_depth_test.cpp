// What pixels without depth are: nothing, or a surface whose distance is not known.

#include <cmath>
#include <functional>

#include "lib/render/factory.hpp"
#include "tests/naive_warp.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

constexpr int kWidth = 96, kHeight = 64;

/// Holes of a sensor: a border of two pixels, and a part of the picture, another one in each view.
bool missed(std::size_t view, int x, int y) {
    const int top = 4 + 14 * static_cast<int>(view);
    return x < 2 || y < 2 || x >= kWidth - 2 || y >= kHeight - 2 ||
           (x > 10 && x < 60 && y > top && y < top + 12);
}

/// The views as a nerfstudio set of 16-bit depth; `alpha` of each pixel, where there is one.
void writeSet(const std::filesystem::path& folder, const std::vector<ReferenceView>& views,
              int (*alpha)(int, int) = nullptr, const std::string& more = "") {
    std::string frames;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const ReferenceView& view = views[i];
        std::vector<std::uint8_t> pixels;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                for (int k = 0; k < 3; ++k)
                    pixels.push_back(
                        static_cast<std::uint8_t>(view.texture.at(x, y)[k] * 255.0f + 0.5f));
                if (alpha) pixels.push_back(static_cast<std::uint8_t>(alpha(x, y)));
            }
        const auto png = encodePng(kWidth, kHeight, alpha ? 4 : 3, 8, pixels.data(), true);
        ASSERT_TRUE(png);
        writeBytes(folder / fmt::format("c{}.png", i), *png);
        writeCodes(folder / fmt::format("d{}.png", i), kWidth, kHeight, 16, [&](int x, int y) {
            return missed(i, x, y) ? 0 : std::lround(view.depth.at(x, y) * 10000);
        });
        const Camera& c = view.camera;
        frames += fmt::format(
            "{}{{\"file_path\":\"c{}.png\",\"depth_file_path\":\"d{}.png\",\"transform_matrix\":{},"
            "\"fl_x\":{},\"fl_y\":{},\"cx\":{},\"cy\":{}{}}}",
            i ? "," : "", i, i, rowsOf(c.worldFromCamera()), c.fx, c.fy, c.cx, c.cy, more);
    }
    writeText(folder / "transforms.json",
              fmt::format("{{\"integer_depth_scale\":0.0001,\"w\":{},\"h\":{},\"frames\":[{}]}}",
                          kWidth, kHeight, frames));
}

/// Whether all pixels without depth have that alpha.
void expectAlpha(const ReferenceView& view, float alpha) {
    int checked = 0;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
            if (hasPoint(view.depth.at(x, y))) continue;
            ++checked;
            ASSERT_EQ(view.texture.at(x, y).a, alpha) << x << "," << y;
        }
    EXPECT_GT(checked, 100);
}

TEST(NoDepth, OfAPhotographIsUnknown) {
    const TemporaryFolder folder;
    writeSet(folder.path(), roomViews());
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->views[0].noDepth, NoDepth::unknown);
    expectAlpha(read->views[0], 1.0f);

    ImageSetOptions options;
    options.noDepth = NoDepth::empty;
    const auto empty = readSet(folder.path(), options);
    ASSERT_TRUE(empty);
    EXPECT_EQ(empty->views[0].noDepth, NoDepth::empty);
    expectAlpha(empty->views[0], 0.0f);
}

TEST(NoDepth, OfAPictureWithTransparentPixelsIsNothing) {
    const TemporaryFolder folder;
    // All that is opaque has depth.
    writeSet(folder.path(), roomViews(),
             [](int x, int y) { return x >= 60 && x < 80 && y >= 2 && y < kHeight - 2 ? 255 : 0; });
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->views[0].noDepth, NoDepth::empty);
    expectAlpha(read->views[0], 0.0f);
}

/// A hole in a cut-out object was "nothing is there", which took away what other views show there.
TEST(NoDepth, InsideACutOutIsUnknown) {
    const TemporaryFolder folder;
    writeSet(folder.path(), roomViews(), [](int x, int) { return x < 80 ? 255 : 0; });
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->views[0].noDepth, NoDepth::unknown);
    EXPECT_EQ(read->views[0].texture.at(15, 10).a, 1.0f) << "the sensor missed it";
    EXPECT_EQ(read->views[0].texture.at(85, 10).a, 0.0f)
        << "the picture says that nothing is there";

    ImageSetOptions options;
    options.noDepth = NoDepth::empty;
    const auto empty = readSet(folder.path(), options);
    ASSERT_TRUE(empty);
    EXPECT_EQ(empty->views[0].noDepth, NoDepth::empty);
    expectAlpha(empty->views[0], 0.0f);
}

/// Outlines inside pixels of coarse depth are no holes, one that is opaque all over is.
TEST(NoDepth, OfDepthThatIsCoarserThanItsCutOutIsJudgedByWholePixels) {
    const auto view = roomViews(1)[0];
    const Camera& c = view.camera;
    for (const bool hole : {false, true}) {
        std::vector<std::uint8_t> pixels(std::size_t{4} * kWidth * kHeight, 255);
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < 21; ++x)
                pixels[static_cast<std::size_t>(4 * (y * kWidth + x) + 3)] = 0;
        const TemporaryFolder folder;
        const auto png = encodePng(kWidth, kHeight, 4, 8, pixels.data(), true);
        ASSERT_TRUE(png);
        writeBytes(folder / "a.png", *png);
        // Columns 20 and 21 of the picture are one of the depth.
        writeCodes(folder / "d.png", kWidth / 2, kHeight / 2, 16,
                   [&](int x, int y) { return x < 11 || (hole && x == 30 && y == 9) ? 0 : 2000; });
        writeText(
            folder / "transforms.json",
            fmt::format("{{\"w\":96,\"h\":64,\"fl_x\":{},\"fl_y\":{},\"cx\":{},\"cy\":{},"
                        "\"frames\":[{}]}}",
                        c.fx, c.fy, c.cx, c.cy,
                        transformsFrame(c.worldFromCamera(), ",\"depth_file_path\":\"d.png\"")));
        const auto read = readSet(folder.path());
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ(read->views[0].noDepth, hole ? NoDepth::unknown : NoDepth::empty);
    }
}

TEST(NoDepth, AlphaThatIsFullEverywhereSaysNothing) {
    const TemporaryFolder folder;
    writeSet(folder.path(), roomViews(), [](int, int) { return 255; });
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->views[0].noDepth, NoDepth::unknown);
}

/// As Blender writes depth: 1e10 is nothing; then 0 is something else.
TEST(NoDepth, DepthThatHoldsInfinityTellsBoth) {
    const auto view = roomViews(1)[0];
    const Camera& c = view.camera;
    for (const float nothing : {1e10f, std::numeric_limits<float>::infinity()}) {
        auto depth = view.depth;
        for (int x = 10; x < 20; ++x) depth.at(x, 5) = nothing;
        depth.at(30, 5) = 0;
        depth.at(31, 5) = NAN;
        const TemporaryFolder folder;
        writeColour(folder / "a.png", view);
        writeExr(folder / "d.exr", {{"Z", depth}});
        writeText(folder / "transforms.json",
                  fmt::format("{{\"w\":96,\"h\":64,\"fl_x\":{},\"fl_y\":{},\"cx\":{},\"cy\":{},"
                              "\"frames\":[{}]}}",
                              c.fx, c.fy, c.cx, c.cy,
                              transformsFrame(c.worldFromCamera(), ",\"depth_file_path\":\"d\"")));
        const auto read = readSet(folder.path());
        ASSERT_TRUE(read) << read.error().text();
        const ReferenceView& back = read->views[0];
        EXPECT_EQ(back.noDepth, NoDepth::unknown);
        for (const auto& [x, alpha] : {std::pair(12, 0.0f), {30, 1.0f}, {31, 1.0f}, {50, 1.0f}})
            EXPECT_EQ(back.texture.at(x, 5).a, alpha) << x;
        for (const int x : {12, 30, 31}) EXPECT_FALSE(hasPoint(back.depth.at(x, 5))) << x;
    }
}

// The alpha of a picture is finer than its depth: half a statue's outline was lost.
TEST(NoDepth, PixelsThatAreCoveredInPartKeepTheirAlpha) {
    const auto view = roomViews(1)[0];
    const Camera& c = view.camera;
    auto depth = view.depth;
    std::vector<std::uint8_t> pixels(std::size_t{4} * kWidth * kHeight, 255);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x <= 20; ++x) {
            depth.at(x, y) = 1e10f;
            pixels[static_cast<std::size_t>(4 * (y * kWidth + x) + 3)] = x < 20 ? 0 : 100;
        }
    }
    const TemporaryFolder folder;
    const auto png = encodePng(kWidth, kHeight, 4, 8, pixels.data(), true);
    ASSERT_TRUE(png);
    writeBytes(folder / "a.png", *png);
    writeExr(folder / "d.exr", {{"Z", depth}});
    writeText(folder / "transforms.json",
              fmt::format("{{\"w\":96,\"h\":64,\"fl_x\":{},\"fl_y\":{},\"cx\":{},\"cy\":{},"
                          "\"frames\":[{}]}}",
                          c.fx, c.fy, c.cx, c.cy,
                          transformsFrame(c.worldFromCamera(), ",\"depth_file_path\":\"d\"")));
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_NEAR(read->views[0].texture.at(20, 30).a, 100 / 255.0, 1e-6);
    EXPECT_EQ(read->views[0].texture.at(10, 30).a, 0.0f);
}

TEST(NoDepth, MasksOfTheSetAreRead) {
    const TemporaryFolder folder;
    writeSet(folder.path(), roomViews(), nullptr, ",\"mask_path\":\"masks/m.png\"");
    std::filesystem::create_directories(folder / "masks");
    writeCodes(folder / "masks/m.png", kWidth, kHeight, 8,
               [](int x, int) { return x >= 60 ? 255 : 0; });
    const auto read = readSet(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    const ReferenceView& view = read->views[0];
    EXPECT_EQ(view.noDepth, NoDepth::unknown) << "the sensor missed the border";
    EXPECT_FALSE(hasPoint(view.depth.at(55, 30)));
    EXPECT_EQ(view.texture.at(55, 30).a, 0.0f);
    EXPECT_TRUE(hasPoint(view.depth.at(65, 30)));

    // White everywhere, and cut out by alpha.
    std::vector<std::uint8_t> white(std::size_t{4} * kWidth * kHeight, 255);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < 60; ++x) white[std::size_t{4} * (y * kWidth + x) + 3] = 0;
    const auto png = encodePng(kWidth, kHeight, 4, 8, white.data(), true);
    ASSERT_TRUE(png);
    writeBytes(folder / "masks/m.png", *png);
    const auto cut = readSet(folder.path());
    ASSERT_TRUE(cut) << cut.error().text();
    EXPECT_TRUE(cut->views[0].depth == view.depth);
    EXPECT_EQ(cut->views[0].texture.at(55, 30).a, 0.0f);

    // One that is named and not there is a missing file like others.
    std::filesystem::remove(folder / "masks/m.png");
    ImageSetOptions strict;
    strict.strict = true;
    expectError(readSet(folder.path(), strict), {"masks/m.png"});
}

TEST(NoDepth, MasksOfOneValueBesideZeroAreWhiteThere) {
    const TemporaryFolder folder;
    writeSet(folder.path(), roomViews(), nullptr, ",\"mask_path\":\"m.png\"");
    int bits = 8;
    const auto alphaWith = [&](const std::function<int(int, int)>& mask) {
        writeCodes(folder / "m.png", kWidth, kHeight, bits, mask);
        const auto read = readSet(folder.path());
        EXPECT_TRUE(read) << read.error().text();
        return read ? read->views[0].texture.at(65, 30).a : -1.0f;
    };
    for (const auto& [bit, value] :
         {std::pair{8, 1}, {8, 15}, {8, 255}, {16, 1}, {16, 15}, {16, 65535}}) {
        SCOPED_TRACE(value);
        bits = bit;
        EXPECT_EQ(alphaWith([&, v = value](int x, int) { return x >= 60 ? v : 0; }), 1.0f);
        EXPECT_EQ(alphaWith([&, v = value](int x, int) { return x < 60 ? v : 0; }), 0.0f);
        EXPECT_EQ(alphaWith([&, v = value](int, int) { return v; }), 1.0f);
    }
    bits = 8;
    // Of several values each is a share.
    EXPECT_NEAR(alphaWith([](int x, int) { return x > 65 ? 255 : x == 65 ? 51 : 0; }), 0.2f, 1e-6f);
}

/// COLMAP appends .png to the picture's name; others replace its ending.
TEST(NoDepth, ColmapsMasksAreRead) {
    for (const char* name : {"masks/a.exr.png", "masks/a.png"}) {
        const TemporaryFolder folder;
        writeText(folder / "sparse/cameras.txt", "1 PINHOLE 96 64 100 100 48 32\n");
        writeText(folder / "sparse/images.txt", "1 1 0 0 0 0 0 0 1 a.exr\n\n");
        writePositions(folder / "images/a.exr", kWidth, kHeight);
        std::string depth = "96&64&1&";
        for (int i = 0; i < kWidth * kHeight; ++i) depth += floatBytes(2.0f);
        writeText(folder / "stereo/depth_maps/a.exr.geometric.bin", depth);
        std::filesystem::create_directories(folder / "masks");
        writeCodes(folder / name, kWidth, kHeight, 8, [](int x, int) { return x < 60 ? 255 : 0; });
        const auto read = readSet(folder.path());
        ASSERT_TRUE(read) << read.error().text();
        EXPECT_EQ(read->views[0].pointCount(), 60 * kHeight) << name;
        EXPECT_EQ(read->views[0].noDepth, NoDepth::empty);
    }
}

/// Pixels that are open in a picture though the points of two views or more fall there.
int openPixels(const Bundle& bundle, const Camera& camera, RenderMode mode,
               const Image<std::uint8_t>& seen) {
    Job job;
    RenderSettings settings;
    settings.mode = mode;
    settings.fill = Fill::none;
    const auto renderer = makeRenderer(Backend::cpu, bundle, settings, -1, job);
    if (!renderer) return -1;
    const auto frame = (*renderer)->render(camera);
    if (!frame) return -1;
    int open = 0;
    for (std::size_t i = 0; i < seen.count(); ++i)
        open += seen.data()[i] >= 2 && frame->colour.data()[i].a < 0.5f ? 1 : 0;
    return open;
}

/// Views side by side whose sensors missed other parts each, and all their borders.
TEST(NoDepth, HolesOfOneViewTakeNothingFromAnother) {
    std::vector<ReferenceView> views;
    for (int i = 0; i < 4; ++i) {
        const Camera camera = analyticCamera(AnalyticScene::room, i, 4).resized(kWidth, kHeight);
        views.push_back(viewOfAnalyticScene(AnalyticScene::room, camera, 1));
    }
    const Camera between = analyticCamera(AnalyticScene::room, 1.5, 4).resized(kWidth, kHeight);
    const TemporaryFolder folder;
    writeSet(folder.path(), views);
    ImageSetOptions options;
    const auto unknown = readSet(folder.path(), options);
    options.noDepth = NoDepth::empty;
    const auto empty = readSet(folder.path(), options);
    ASSERT_TRUE(unknown && empty);
    Image<std::uint8_t> seen(kWidth, kHeight, 0);
    for (const ReferenceView& view : unknown->views) {
        const NaiveWarp warp = naiveWarp(view, between);
        for (std::size_t i = 0; i < seen.count(); ++i)
            seen.data()[i] += warp.covered.data()[i] / 255;
    }
    EXPECT_LE(openPixels(*unknown, between, RenderMode::splat, seen), 4);
    EXPECT_GE(openPixels(*empty, between, RenderMode::splat, seen), 30) << "of no use";
}

}  // namespace
