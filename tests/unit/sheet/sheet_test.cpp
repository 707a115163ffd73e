#include "lib/sheet/sheet.hpp"

#include <algorithm>
#include <cstdlib>

#include <gtest/gtest.h>

#include "lib/metrics/compare.hpp"
#include "lib/packing/packing.hpp"
#include "lib/sheet/false_colour.hpp"
#include "lib/sheet/tiles.hpp"
#include "tests/small_bundle.hpp"

namespace stx {
namespace {

bool dark(glm::u8vec3 c) {
    return c.r < 128 && c.g < 128 && c.b < 128;
}

/// Whether a line of text stands somewhere in a picture, as the font draws it.
bool holdsText(const Rgb8Image& picture, const std::string& text) {
    const int width = static_cast<int>(text.size()) * Canvas::kGlyphWidth;
    Canvas drawn(width, Canvas::kLineHeight, {255, 255, 255});
    drawn.text({0, 0}, text, {0, 0, 0}, width);
    const Rgb8Image& wanted = drawn.image();
    for (int y = 0; y + wanted.height() <= picture.height(); ++y) {
        for (int x = 0; x + width <= picture.width(); ++x) {
            bool same = true;
            for (int j = 0; same && j < wanted.height(); ++j) {
                for (int i = 0; same && i < width; ++i)
                    same = dark(picture.at(x + i, y + j)) == dark(wanted.at(i, j));
            }
            if (same) return true;
        }
    }
    return false;
}

/// Views of one size.
Bundle evenBundle(int views, int side) {
    Bundle bundle;
    for (int i = 0; i < views; ++i) {
        ReferenceView v;
        v.name = "v" + std::to_string(i);
        v.camera =
            Camera::fromFieldOfView({0, 0, 3.0 + i}, {1, 0, 0, 0}, {0.5, 0.5}, false, side, side);
        v.nearPlane = 1;
        v.farPlane = 9;
        v.texture = Rgba8Image(side, side, {200, 40, 10, 255});
        v.depth = Image<float>(side, side, 2.0f);
        for (int y = 0; y < side; ++y) v.depth.at(side - 1, y) = 7.5f;
        bundle.views.push_back(std::move(v));
    }
    return bundle;
}

std::vector<SheetPair> onePair(Rgba8Image a, Rgba8Image b) {
    std::vector<SheetPair> pairs(1);
    pairs[0].title = "a | b";
    pairs[0].a = std::move(a);
    pairs[0].b = std::move(b);
    return pairs;
}

TEST(Sheet, WritesNamesCamerasAndTheRangeOfDepth) {
    Job job;
    SheetSettings settings;
    settings.title = "the title";
    const auto sheet = sheetOf(*viewsOf(evenBundle(2, 150)), settings, job);
    ASSERT_TRUE(sheet) << sheet.error().text();
    EXPECT_EQ(sheet->shown, 2);
    for (const char* text : {"the title", "0 v0", "1 v1", "at 0 0 4", "towards 0 0 -1",
                             "depth 2 to 7.5", "28.6 x 28.6 degrees"})
        EXPECT_TRUE(holdsText(sheet->picture, text)) << text;
    EXPECT_FALSE(holdsText(sheet->picture, "2 v2"));
}

TEST(Sheet, IsNoLargerThanAskedFor) {
    const Bundle bundle = smallBundle(7, 16, true, false);
    for (const glm::ivec2 most : {glm::ivec2(400, 300), glm::ivec2(500, 5000),
                                  glm::ivec2(3000, 320), glm::ivec2(2600, 2600)}) {
        Job job;
        SheetSettings settings;
        settings.mostSize = most;
        const auto sheet = sheetOf(*viewsOf(bundle), settings, job);
        ASSERT_TRUE(sheet) << most.x << "x" << most.y << ": " << sheet.error().text();
        EXPECT_LE(sheet->picture.width(), most.x);
        EXPECT_LE(sheet->picture.height(), most.y);
        EXPECT_GE(sheet->shown, 1);
        EXPECT_EQ(sheet->count, 7);
    }
}

TEST(Sheet, ItsMemoryIsKnownBefore) {
    Job job;
    for (const int views : {1, 7, 100}) {
        const Bundle bundle = evenBundle(views, 24);
        const auto table = viewsOf(bundle);
        const auto sheet = sheetOf(*table, {}, job);
        ASSERT_TRUE(sheet) << sheet.error().text();
        EXPECT_EQ(memoryOfSheet(*table, 1), sheet->picture.count() * 6);
        EXPECT_NE(memoryOfSheet(*table, 9), memoryOfSheet(*table, 1));
    }
}

TEST(Sheet, ShowsAsManyViewsAsFitAndSaysSo) {
    Job job;
    SheetSettings settings;
    settings.mostSize = {500, 500};
    const auto sheet = sheetOf(*viewsOf(evenBundle(60, 64)), settings, job);
    ASSERT_TRUE(sheet) << sheet.error().text();
    EXPECT_LT(sheet->shown, 60);
    EXPECT_TRUE(holdsText(sheet->picture, std::to_string(sheet->shown) + " of 60 views are shown"));
}

TEST(Sheet, ThatIsTooSmallIsAnErrorThatNamesASizeThatWillDo) {
    Job job;
    SheetSettings settings;
    settings.mostSize = {100, 50};
    const auto small = sheetOf(*viewsOf(evenBundle(3, 64)), settings, job);
    ASSERT_FALSE(small);
    EXPECT_EQ(small.error().code, ErrorCode::usage);
    const std::string text = small.error().message;
    const auto at = text.find("; ");
    ASSERT_NE(at, std::string::npos) << text;
    settings.mostSize.x = std::atoi(text.c_str() + at + 2);
    settings.mostSize.y = std::atoi(text.c_str() + text.find('x', at) + 1);
    EXPECT_TRUE(sheetOf(*viewsOf(evenBundle(3, 64)), settings, job)) << text;
}

TEST(Sheet, TakesNoMoreMemoryThanTheLimit) {
    Job job;
    job.limits.maxMemoryBytes = 1 << 20;
    const auto sheet = sheetOf(*viewsOf(evenBundle(4, 300)), {}, job);
    ASSERT_FALSE(sheet);
    EXPECT_NE(sheet.error().message.find("the sheet"), std::string::npos);
}

TEST(Sheet, OfAnAtlasHasItsTexturesAndRectangles) {
    Job job;
    const auto atlas = pack(evenBundle(4, 100), {}, job);
    ASSERT_TRUE(atlas);
    const auto sheet = sheetOf(*atlas, {}, job);
    ASSERT_TRUE(sheet) << sheet.error().text();
    EXPECT_EQ(sheet->count, 2);
    EXPECT_TRUE(holdsText(sheet->picture, "4 rectangles"));
    int outline = 0;
    for (const auto& c : sheet->picture.pixels()) outline += c == glm::u8vec3(255, 64, 64);
    // Views 0 and 2, on colour and on depth: two sides of about 100 pixels and more each.
    EXPECT_GT(outline, 4 * 300);
}

TEST(Sheet, OfASequenceSpreadsItsMoments) {
    Job job;
    class Film : public Sequence {
      public:
        Film() { timeline_ = steadyTimeline(11, 10); }
        Result<Bundle> frame(std::size_t index, Job&) override {
            Bundle b = evenBundle(1, 120);
            for (auto& d : b.views[0].depth.pixels()) d += 0.1f * static_cast<float>(index);
            b.time = timeline_.times[index];
            return b;
        }
    } film;
    SheetSettings settings;
    settings.columns = 3;
    const auto sheet = sheetOf(film, settings, job);
    ASSERT_TRUE(sheet) << sheet.error().text();
    EXPECT_EQ(sheet->shown, 3);
    for (const char* text :
         {"0.000 s, frame 0", "0.500 s, frame 5", "1.000 s, frame 10", "depth 2 to 8.5"})
        EXPECT_TRUE(holdsText(sheet->picture, text)) << text;
}

TEST(Sheet, OfASequenceShowsBackgroundThatStandsStillOnce) {
    class Film : public Sequence {
      public:
        bool flickers = false;
        Film() { timeline_ = steadyTimeline(11, 10); }
        Result<Bundle> frame(std::size_t index, Job&) override {
            Bundle b = evenBundle(5, 120);
            for (std::size_t i = 1; i < 5; ++i) b.views[i].background = true;
            for (const std::size_t i : {0, 4})
                if (i == 0 || flickers)
                    for (auto& d : b.views[i].depth.pixels()) d += 0.1f * static_cast<float>(index);
            return b;
        }
    } film;
    Job job;
    SheetSettings settings;
    settings.columns = 3;
    const auto sheet = sheetOf(film, settings, job);
    ASSERT_TRUE(sheet) << sheet.error().text();
    EXPECT_EQ(sheet->shown, 3 + 4);
    EXPECT_TRUE(holdsText(sheet->picture, "background that stands still"));
    film.flickers = true;
    EXPECT_EQ(sheetOf(film, settings, job)->shown, 3 + 3 + 3);
}

TEST(Sheet, OfAPairTellsTheSameAsCompare) {
    Rgba8Image a(150, 150, {10, 200, 90, 255}), b = a;
    for (int i = 0; i < 150; ++i) b.at(i, i) = {60, 200, 90, 255};
    Job job;
    const auto found = compare(a, b);
    ASSERT_TRUE(found);
    const auto sheet = sheetOf(onePair(a, b), {}, job);
    ASSERT_TRUE(sheet) << sheet.error().text();
    EXPECT_TRUE(holdsText(sheet->picture, fmt::format("PSNR {:.2f} dB", *found->psnrRgb)));
    const auto same = sheetOf(onePair(a, a), {}, job);
    ASSERT_TRUE(same);
    EXPECT_TRUE(holdsText(same->picture, "PSNR identical"));
    EXPECT_FALSE(sheetOf(onePair(a, Rgba8Image(150, 149)), {}, job));
}

TEST(Sheet, OfAPairShowsAnErrorThatIsFinerThanItsPictures) {
    const Rgba8Image a(150, 150, {10, 200, 90, 255});
    auto pairs = onePair(a, a);
    ColourError& error = pairs[0].error.emplace();
    error.found.psnrRgb = 91.25;
    error.found.worst = {7, 9, 12345};
    error.found.pixels = error.found.differentPixels = 150 * 150;
    error.picture = Rgba8Image(150, 150, {255, 0, 0, 255});
    Job job;
    SheetSettings wide;
    wide.mostSize = {4000, 2000};
    const auto sheet = sheetOf(pairs, wide, job);
    ASSERT_TRUE(sheet) << sheet.error().text();
    EXPECT_TRUE(holdsText(sheet->picture, "PSNR 91.25 dB"));
    EXPECT_TRUE(holdsText(sheet->picture, "worst 12345 at 7 9"));
    EXPECT_FALSE(holdsText(sheet->picture, "identical"));
    int red = 0;
    for (const auto& c : sheet->picture.pixels()) red += c == glm::u8vec3(255, 0, 0);
    EXPECT_EQ(red, 150 * 150);
}

TEST(Sheet, OfAPairShowsDepthThatOnlyOneHas) {
    auto pairs = onePair(Rgba8Image(150, 150), Rgba8Image(150, 150));
    pairs[0].depthA = Image<float>(150, 150, 2.0f);
    pairs[0].depthB = Image<float>(150, 150, 2.25f);
    for (int y = 0; y < 40; ++y) pairs[0].depthB.at(3, y) = kNoDepth;
    Job job;
    SheetSettings wide;
    wide.mostSize = {4000, 2000};
    const auto sheet = sheetOf(pairs, wide, job);
    ASSERT_TRUE(sheet) << sheet.error().text();
    EXPECT_TRUE(holdsText(sheet->picture, "depth 2 to 2.25"));
    int lonely = 0;
    for (const auto& c : sheet->picture.pixels()) lonely += c == glm::u8vec3(255, 0, 255);
    EXPECT_EQ(lonely, 40);
}

// The least under each pixel was shown: an error of one pixel was none.
TEST(Sheet, OfAPairShowsTheLargestErrorOfDepth) {
    const auto bright = [](int errors) {
        auto pairs = onePair(Rgba8Image(800, 800), Rgba8Image(800, 800));
        pairs[0].depthA = pairs[0].depthB = Image<float>(800, 800, 2.0f);
        for (int i = 0; i < errors; ++i)
            pairs[0].depthB.at(15 + i % 20 * 40, 15 + i / 20 * 40) = 5.0f;
        Job job;
        SheetSettings settings;
        settings.mostSize = {1300, 900};
        const auto sheet = sheetOf(pairs, settings, job);
        EXPECT_TRUE(sheet) << sheet.error().text();
        EXPECT_TRUE(!sheet || holdsText(sheet->picture, "to 3 off"));
        return sheet ? std::ranges::count(sheet->picture.pixels(), viridis(1)) : 0;
    };
    EXPECT_EQ(bright(400) - bright(1), 399);
}

TEST(Canvas, CutsTextThatIsTooLongAndWhatLiesOutside) {
    Canvas canvas(70, 20, {255, 255, 255});
    canvas.text({0, 0}, "a very long name", {0, 0, 0}, 70);
    EXPECT_TRUE(holdsText(canvas.image(), "a very l.."));
    canvas.text({-30, -5}, "outside", {0, 0, 0}, 900);
    canvas.text({60, 15}, "outside", {0, 0, 0}, 900);
    canvas.fill({-5, -5}, {500, 500}, {1, 2, 3});
    EXPECT_EQ(canvas.image().at(69, 19), glm::u8vec3(1, 2, 3));
}

TEST(Canvas, DrawsLatinLettersAndABoxForAllElse) {
    const auto drawn = [](const char* text) {
        Canvas canvas(30, 15, {255, 255, 255});
        canvas.text({0, 0}, text, {0, 0, 0}, 30);
        return canvas.image();
    };
    EXPECT_NE(drawn("\xc3\xbc"), drawn("u"));
    EXPECT_NE(drawn("\xc3\xbc"), drawn("\xe4\xb8\x96"));
    EXPECT_EQ(drawn("\xe4\xb8\x96"), drawn("\xd0\xaf"));
    EXPECT_EQ(drawn("\xff"), drawn("\xd0\xaf"));
    EXPECT_EQ(drawn("\xc3"), drawn("\xd0\xaf"));
}

TEST(Viridis, HasMatplotlibsColoursAndGetsEverBrighter) {
    EXPECT_EQ(viridis(0), glm::u8vec3(0x44, 0x01, 0x54));
    EXPECT_EQ(viridis(0.5), glm::u8vec3(0x21, 0x91, 0x8c));
    EXPECT_EQ(viridis(1), glm::u8vec3(0xfd, 0xe7, 0x25));
    EXPECT_EQ(viridis(-3), viridis(0));
    EXPECT_EQ(viridis(std::nan("")), viridis(0));
    double before = -1;
    for (int i = 0; i < 256; ++i) {
        const glm::dvec3 c = viridis(i / 255.0);
        const double luma = 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
        EXPECT_GT(luma, before - 0.5) << i;
        before = luma;
    }
}

TEST(Tiles, KeepTheShapeOfTheirPictures) {
    EXPECT_EQ(sizeInCell({1000, 500}, {200, 200}), glm::ivec2(200, 100));
    EXPECT_EQ(sizeInCell({30, 20}, {100, 100}), glm::ivec2(90, 60));
    EXPECT_EQ(sizeInCell({1, 5000}, {100, 100}), glm::ivec2(1, 100));
}

TEST(Tiles, ShrinkToTheLeastOrTheLargest) {
    Image<float> values(4, 2, 1.0f);
    values.at(0, 1) = 3.0f;
    for (const glm::ivec2 at : {glm::ivec2(2, 0), glm::ivec2(3, 0), glm::ivec2(3, 1)})
        values.at(at.x, at.y) = kNoDepth;
    const auto least = shrunkValues(values, {2, 1}), largest = shrunkLargest(values, {2, 1});
    EXPECT_EQ(least.at(0, 0), 1.0f);
    EXPECT_EQ(largest.at(0, 0), 3.0f);
    EXPECT_FALSE(hasPoint(least.at(1, 0)));
    EXPECT_EQ(largest.at(1, 0), 1.0f);
    EXPECT_FALSE(hasPoint(shrunkLargest(Image<float>(2, 2, kNoDepth), {1, 1}).at(0, 0)));
}

TEST(Tiles, ShrinkColoursInLinearLight) {
    Rgba8Image stripes(64, 64);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            stripes.at(x, y) = x % 2 ? glm::u8vec4(255) : glm::u8vec4(0, 0, 0, 255);
    // Half the light is code 188 (IEC 61966-2-1).
    const auto small = shrunk(Texture(stripes), {8, 8});
    EXPECT_EQ(small.at(3, 3), glm::u8vec3(188));
}

}  // namespace
}  // namespace stx
