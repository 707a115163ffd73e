#include "formats/viewer/viewer_page.hpp"

#include <regex>

#include <gtest/gtest.h>

#include "formats/viewer/page_scene.hpp"
#include "formats/viewer/page_text.hpp"
#include "lib/packing/packing.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/torus_bundle.hpp"
#include "tests/unit/viewer/read_page.hpp"

namespace {

using namespace stx;
using namespace stx::pages;

TEST(ViewerPage, IsHardlyLargerThanItsImages) {
    const TemporaryFolder folder;
    Job job;
    const auto report = write(torusViews(256), folder.path() / "a.html", job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_EQ(report->bytes, std::filesystem::file_size(folder.path() / "a.html"));
    // What the page is beside its images does not grow with them.
    EXPECT_LT(
        static_cast<double>(report->bytes) - 32.0 / 31.0 * static_cast<double>(report->imageBytes),
        33000.0);
}

TEST(ViewerPage, BytesOfAnyLengthComeBackFromText) {
    for (std::size_t size = 0; size < 40; ++size) {
        Bytes bytes(size);
        for (std::size_t i = 0; i < size; ++i) bytes[i] = std::byte((i * i * 31 + size) % 256);
        const std::string text = pageText(bytes);
        EXPECT_LE(static_cast<double>(text.size()), 32.0 / 31.0 * static_cast<double>(size) + 8);
        EXPECT_EQ(bytesOfPageText(unitsOf(text)), bytes) << size;
    }
}

TEST(ViewerPage, ProgramsKeepWhatComputersRead) {
    EXPECT_EQ(withoutComments("// a\n  const  a = b + 1;  // c\n\n    f( a, - b );\n"),
              "const a=b+1;\nf(a,-b);\n");
    // Signs that would become another one, and what only looks like a comment or an end.
    EXPECT_EQ(withoutComments("a = b + +c - -d;\n"), "a=b+ +c- -d;\n");
    EXPECT_EQ(withoutComments("a(\"x // y\\\"\", 'b  c', `d ${ e }`);\n"),
              "a(\"x // y\\\"\",'b  c',`d ${ e }`);\n");
    EXPECT_EQ(withoutComments("a.replace(/' [/] \"/g, b / 2 / c)  // d\n"),
              "a.replace(/' [/] \"/g,b/2/c)\n");
    EXPECT_EQ(withoutComments("#define A (b)  // c\n#if A == 2\nd = 1;\n"),
              "#define A (b)\n#if A == 2\nd=1;\n");
}

TEST(ViewerPage, HoldsTheTexturesOfATightAtlas) {
    const TemporaryFolder folder;
    Job job;
    const Bundle bundle = smallBundle(5, 16, false, false);
    const auto report = write(bundle, folder.path() / "a.html", job);
    ASSERT_TRUE(report) << report.error().text();
    EXPECT_EQ(report->views, 5u);
    EXPECT_EQ(report->points, bundle.pointCount());
    const ReadPage page = readPage(folder.path() / "a.html");
    const Json scene = page.json("scene0");
    EXPECT_EQ(page.count("image"), 2);
    const auto colour = page.image(scene["pages"][0]["colour"]);
    const auto depth = page.image(scene["pages"][0]["depth"]);
    ASSERT_EQ(colour.channels, 4);
    ASSERT_EQ(depth.bits(), 16);
    // Every point is there, with its colour and the code of its distance.
    const auto& rgba = std::get<std::vector<std::uint8_t>>(colour.values);
    const auto& codes = std::get<std::vector<std::uint16_t>>(depth.values);
    std::int64_t found = 0;
    for (const Json& r : scene["rectangles"]) {
        const ReferenceView& view = bundle.views[r[0].get<std::size_t>()];
        const int width = r[6], height = r[7];
        const bool turned = r[8] == 1;
        for (int j = 0; j < height; ++j) {
            for (int i = 0; i < width; ++i) {
                const int x = r[2].get<int>() + (turned ? j : i);
                const int y = r[3].get<int>() + (turned ? width - 1 - i : j);
                const std::size_t texel =
                    static_cast<std::size_t>(r[5].get<int>() + j) * colour.width +
                    static_cast<std::size_t>(r[4].get<int>() + i);
                EXPECT_EQ(codes[texel], view.depthCode().encode(view.depth.at(x, y)));
                if (!hasPoint(view.depth.at(x, y))) continue;
                ++found;
                const glm::u8vec4 c = view.texture.rgba8()->at(x, y);
                EXPECT_EQ(rgba[4 * texel], c.r);
                EXPECT_EQ(rgba[4 * texel + 3], c.a);
            }
        }
    }
    EXPECT_EQ(found, bundle.pointCount());
}

TEST(ViewerPage, HoldsNormalsAndSplatsInFourTextures) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(write(smallBundle(3, 8, true, false), folder.path() / "a.html", job));
    const ReadPage page = readPage(folder.path() / "a.html");
    const Json images = page.json("scene0")["pages"][0];
    EXPECT_EQ(images.size(), 4u);
    EXPECT_EQ(page.image(images["depth"]).bits(), 8);
    EXPECT_EQ(page.image(images["normal"]).channels, 3);
    EXPECT_EQ(page.image(images["splat"]).bits(), 8);
}

TEST(ViewerPage, SaysWhatItRounds) {
    const TemporaryFolder folder;
    Job job;
    ASSERT_TRUE(write(smallBundle(2, 32, false, true), folder.path() / "a.html", job));
    const auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("8-bit sRGB in the page; values above 1 are clipped"),
              std::string::npos);
    EXPECT_NE(notes[1].find("becomes 16"), std::string::npos);
}

TEST(ViewerPage, TitlesAndNamesCannotLeaveTheirPlace) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = smallBundle(1, 16, false, false);
    bundle.title = "</title><script>alert(1)</script>@DATA@ & \"\xff";
    bundle.views[0].name = "</script><script>alert(2)</script>";
    ASSERT_TRUE(write(bundle, folder.path() / "a.html", job, {"</script>.mp4", {}, {}}));
    const ReadPage page = readPage(folder.path() / "a.html");
    EXPECT_EQ(page.text.find("<script>alert"), std::string::npos);
    EXPECT_NE(page.text.find("&lt;script&gt;alert(1)"), std::string::npos);
    EXPECT_LT(page.text.find("</title>\n"), page.text.find("id=\"image0\""));
    EXPECT_EQ(page.json("data")["input"], "</script>.mp4");
    EXPECT_EQ(page.json("data")["cameras"][0]["name"], bundle.views[0].name);
    EXPECT_EQ(page.count("image"), 2);
}

/// Two frames of which one view's pictures stay.
class HalfStill : public Sequence {
  public:
    HalfStill() { timeline_ = steadyTimeline(3, 10); }
    Result<Bundle> frame(std::size_t index, Job&) override {
        Bundle bundle = smallBundle(2, 16, false, false);
        bundle.views[1].background = true;
        if (index == 2) bundle.views[0].texture.rgba8()->at(5, 5) = {1, 2, 3, 255};
        bundle.time = timeline_.times[index];
        return bundle;
    }
};

TEST(ViewerPage, WritesWhatStaysOfAFilmOnce) {
    const TemporaryFolder folder;
    Job job;
    HalfStill film;
    const auto report =
        writeViewerPage(film, folder.path() / "a.html", {"film.mp4", {}, {}, {}}, job);
    ASSERT_TRUE(report) << report.error().text();
    const ReadPage page = readPage(folder.path() / "a.html");
    EXPECT_EQ(page.json("data")["frames"], Json::parse("[[0,1],[0,1],[2,1]]"));
    // Colour and depth of both, and the colour that changed.
    EXPECT_EQ(page.count("image"), 5);
    EXPECT_EQ(page.json("data")["times"].size(), 3u);
}

/// A film of two views of which some frames have no point.
class Gaps : public Sequence {
  public:
    explicit Gaps(std::vector<bool> points) : points_(std::move(points)) {
        timeline_ = steadyTimeline(static_cast<int>(points_.size()), 10);
    }
    Result<Bundle> frame(std::size_t index, Job&) override {
        Bundle bundle = smallBundle(2, 16, false, false);
        bundle.time = timeline_.times[index];
        if (points_[index]) return bundle;
        for (ReferenceView& view : bundle.views) {
            view.depth = Image<float>(view.camera.width, view.camera.height, kNoDepth);
            view.texture = Rgba8Image(view.camera.width, view.camera.height);
        }
        return bundle;
    }

  private:
    std::vector<bool> points_;
};

TEST(ViewerPage, FramesWithoutPointsShowTheBackground) {
    const TemporaryFolder folder;
    Job job;
    const auto of = [&](std::vector<bool> points) {
        Gaps film(std::move(points));
        const auto report =
            writeViewerPage(film, folder.path() / "a.html", {"film.mp4", {}, {}, {}}, job);
        EXPECT_TRUE(report) << report.error().text();
        return readPage(folder.path() / "a.html").json("data");
    };
    Json whole = of({true, true, true}), middle = of({true, false, true}),
         start = of({false, true, true});
    EXPECT_EQ(middle["frames"], Json::parse("[[0],[],[0]]"));
    EXPECT_EQ(start["frames"], Json::parse("[[],[0],[0]]"));
    // Where the page begins, and what it says of its points, is of a frame that has some.
    for (Json* data : {&whole, &middle, &start}) data->erase("frames");
    EXPECT_EQ(middle, whole);
    EXPECT_EQ(start, whole);
    Gaps none({false, false});
    const auto refused =
        writeViewerPage(none, folder.path() / "b.html", {"film.mp4", {}, {}, {}}, job);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().text(), "none of the views has a point");
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "b.html"));
}

/// Three cameras, each with a new picture every frame, every second and every third one.
class ThreeRates : public Sequence {
  public:
    ThreeRates() { timeline_ = steadyTimeline(4, 10); }
    Result<Bundle> frame(std::size_t index, Job&) override {
        Bundle bundle = smallBundle(3, 16, false, false);
        for (std::size_t k = 0; k < 3; ++k)
            bundle.views[k].texture.rgba8()->at(5, 5) = {index / (k + 1), 2, 3, 255};
        bundle.time = timeline_.times[index];
        return bundle;
    }
};

TEST(ViewerPage, WritesEachPictureOfAFilmOnce) {
    const TemporaryFolder folder;
    Job job;
    ThreeRates film;
    ASSERT_TRUE(writeViewerPage(film, folder.path() / "a.html", {"film.mp4", {}, {}, {}}, job));
    const ReadPage page = readPage(folder.path() / "a.html");
    // 4, 2 and 2 colours and the depths.
    EXPECT_EQ(page.count("image"), 4 + 2 + 2 + 3);
    const Json scene = page.json("scene3");
    ASSERT_EQ(scene["pages"].size(), 3u);
    ASSERT_EQ(scene["views"].size(), 3u);
    for (const Json& r : scene["rectangles"]) EXPECT_EQ(r[0], r[1]) << "each has its own page";
}

TEST(ViewerPage, TakesAnAtlasAsItIs) {
    const TemporaryFolder folder;
    Job job;
    const Bundle bundle = torusViews(64);
    const auto atlas = pack(bundle, {}, job);
    ASSERT_TRUE(atlas);
    ASSERT_TRUE(writeViewerPage(*atlas, folder.path() / "a.html", {"atlas", {}, {}, {}}, job));
    const ReadPage page = readPage(folder.path() / "a.html");
    const auto colour = page.image(page.json("scene0")["pages"][0]["colour"]);
    EXPECT_EQ(colour.width, atlas->width());
    EXPECT_EQ(colour.height, atlas->height());
}

/// Views whose colours come from JPEG pictures that are larger than they are.
Bundle fromJpeg() {
    Bundle bundle = smallBundle(3, 16, false, false);
    for (ReferenceView& view : bundle.views) {
        Rgba8Image& colour = *view.texture.rgba8();
        const int width = colour.width() + 5, height = colour.height() + 4;
        std::vector<glm::u8vec3> rgb(static_cast<std::size_t>(width * height));
        for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] = {i * 37, i * i, i / 3};
        auto jpeg = encodeJpeg(width, height, 3, &rgb[0].r, 60);
        EXPECT_TRUE(jpeg);
        view.colourFile = {std::make_shared<const Bytes>(std::move(*jpeg)), 3, 2};
        const auto picture = decodeRgba8(*view.colourFile.jpeg, "", Limits());
        EXPECT_TRUE(picture);
        for (int y = 0; y < colour.height(); ++y)
            for (int x = 0; x < colour.width(); ++x)
                colour.at(x, y) = {glm::u8vec3(picture->at(x + 3, y + 2)), colour.at(x, y).a};
    }
    return bundle;
}

TEST(ViewerPage, CopiesTheJpegFilesOfViews) {
    const TemporaryFolder folder;
    Job job;
    const Bundle bundle = fromJpeg();
    ASSERT_TRUE(write(bundle, folder.path() / "a.html", job, {"a.mp4", {}, {.copies = true}, {}}));
    const ReadPage page = readPage(folder.path() / "a.html");
    const Json scene = page.json("scene0");
    ASSERT_EQ(scene["views"].size(), 3u);
    for (std::size_t k = 0; k < 3; ++k) {
        const int number = scene["pages"][0]["view" + std::to_string(k)];
        EXPECT_EQ(bytesOfPageText(page.scripts.at(fmt::format("image{}", number))),
                  *bundle.views[k].colourFile.jpeg);
        EXPECT_EQ(scene["views"][k]["colourAt"], Json::parse("[3,2]"));
    }
    EXPECT_FALSE(scene["pages"][0].contains("colour"));
    EXPECT_TRUE(scene["pages"][0].contains("alpha"));
}

TEST(ViewerPage, CopiesNoJpegFileOfOtherColours) {
    const TemporaryFolder folder;
    Job job;
    const auto copied = [&](const Bundle& bundle, bool copies) {
        const auto path = folder.path() / "a.html";
        EXPECT_TRUE(write(bundle, path, job, {"a.mp4", {}, {.copies = copies}, {}}));
        return !readPage(path).json("scene0")["pages"][0].contains("colour");
    };
    EXPECT_TRUE(copied(fromJpeg(), true));
    EXPECT_FALSE(copied(fromJpeg(), false)) << "nobody asked for it";
    Bundle changed = fromJpeg();
    changed.views[1].texture.rgba8()->at(4, 4).g ^= 1;
    EXPECT_FALSE(copied(changed, true));
    Bundle moved = fromJpeg();
    moved.views[2].colourFile.x += 40;
    EXPECT_FALSE(copied(moved, true));
    // Browsers turn a picture as Exif says, which may be anything.
    Bundle turned = fromJpeg();
    Bytes bytes = *turned.views[0].colourFile.jpeg;
    const unsigned char exif[] = {0xff, 0xe1, 0, 10, 'E', 'x', 'i', 'f', 0, 0, 0, 0};
    const auto segment = std::as_bytes(std::span(exif));
    bytes.insert(bytes.begin() + 2, segment.begin(), segment.end());
    turned.views[0].colourFile.jpeg = std::make_shared<const Bytes>(std::move(bytes));
    EXPECT_FALSE(copied(turned, true));
}

/// A view of planes at 2 and 4, and 7 in a corner, from a place with a turn.
Bundle oneView() {
    ReferenceView v;
    v.name = "photo";
    v.camera = Camera::fromFieldOfView({1, 2, 3}, quatFromAxisAngle({0, 0, 1, 0.5}), {0.8, 0.6},
                                       false, 20, 15);
    v.nearPlane = 1;
    v.farPlane = 8;
    v.depth = Image<float>(20, 15, 4.0f);
    for (int x = 0; x < 20; ++x)
        for (int y = 0; y < 5; ++y) v.depth.at(x, y) = x < 10 ? 2.0f : 7.0f;
    v.texture = Texture(Rgba8Image(20, 15, glm::u8vec4(90, 80, 70, 255)));
    Bundle bundle;
    bundle.views.push_back(std::move(v));
    bundle.bounds = bundle.computeBounds();
    return bundle;
}

void expectOwnPose(const Json& start, const Camera& camera) {
    const auto vec = [](const Json& j) { return glm::dvec3(j[0], j[1], j[2]); };
    EXPECT_EQ(vec(start["eye"]), camera.position);
    EXPECT_LT(glm::length(vec(start["target"]) - camera.position - 4.0 * camera.forward()), 1e-3);
    EXPECT_LT(glm::length(vec(start["up"]) - camera.orientation * glm::dvec3(0, 1, 0)), 1e-12);
    EXPECT_NEAR(start["fov"], glm::degrees(0.6), 1e-9);
    EXPECT_NEAR(start["turn"], std::atan(0.08), 1e-12);
}

TEST(ViewerPage, OfOneViewBeginsAtItsPoseAndTurnsALittle) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = oneView();
    const Camera camera = bundle.views[0].camera;
    const auto atlas = pack(bundle, {}, job);
    ASSERT_TRUE(atlas);
    ASSERT_TRUE(write(bundle, folder.path() / "a.html", job));
    expectOwnPose(readPage(folder.path() / "a.html").json("data")["start"], camera);
    ASSERT_TRUE(writeViewerPage(*atlas, folder.path() / "b.html", {"atlas", {}, {}, {}}, job));
    expectOwnPose(readPage(folder.path() / "b.html").json("data")["start"], camera);
    // What is behind it does not count as a second view.
    bundle.views.push_back(bundle.views[0]);
    bundle.views[1].name = "behind";
    bundle.views[1].background = true;
    ASSERT_TRUE(write(bundle, folder.path() / "c.html", job));
    expectOwnPose(readPage(folder.path() / "c.html").json("data")["start"], camera);
    bundle.views[1].background = false;
    ASSERT_TRUE(write(bundle, folder.path() / "d.html", job));
    EXPECT_FALSE(readPage(folder.path() / "d.html").json("data")["start"].contains("turn"));
}

TEST(ViewerPage, SaysThatItLeavesTheEnvironmentOut) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = smallBundle(2, 16, false, false);
    Environment sky;
    sky.skyColours = {glm::vec3(0.5f)};
    bundle.environment = std::make_shared<const Environment>(sky);
    auto atlas = pack(bundle, {}, job);
    ASSERT_TRUE(atlas);
    atlas->environment = bundle.environment;
    (void)job.takeNotes();
    ASSERT_TRUE(write(std::move(bundle), folder.path() / "a.html", job));
    auto notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("environment"), std::string::npos) << notes[0];
    ASSERT_TRUE(writeViewerPage(*atlas, folder.path() / "b.html", {"atlas", {}, {}, {}}, job));
    notes = job.takeNotes();
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("environment"), std::string::npos) << notes[0];
}

TEST(ViewerPage, SaysThatItLeavesMaterialsOut) {
    const TemporaryFolder folder;
    Job job;
    Bundle bundle = smallBundle(2, 16, false, false);
    for (ReferenceView& view : bundle.views)
        view.emissive = Image<glm::vec3>(view.camera.width, view.camera.height, glm::vec3(0));
    const auto atlas = pack(bundle, {}, job);
    ASSERT_TRUE(atlas);
    (void)job.takeNotes();
    ASSERT_TRUE(write(std::move(bundle), folder.path() / "a.html", job));
    const auto ofViews = job.takeNotes();
    ASSERT_EQ(ofViews.size(), 1u);
    EXPECT_NE(ofViews[0].find("emissive"), std::string::npos) << ofViews[0];
    ASSERT_TRUE(writeViewerPage(*atlas, folder.path() / "b.html", {"atlas", {}, {}, {}}, job));
    EXPECT_EQ(job.takeNotes(), ofViews);
}

TEST(ViewerPage, LeavesNothingWhenItFails) {
    const TemporaryFolder folder;
    Job job;
    job.cancelled = true;
    EXPECT_FALSE(write(smallBundle(2, 16, false, false), folder.path() / "a.html", job));
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
