// Colours of sets that their files say are not sRGB's, or Rec. 709's.

#include <cstring>

#include "tests/unit/images/png_builder.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

constexpr int kWide = 48, kHigh = 32;

/// A PNG with a chunk behind its IHDR.
void addChunk(const std::filesystem::path& file, const std::string& chunk) {
    const auto bytes = readFile(file, Limits());
    ASSERT_TRUE(bytes);
    std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    writeText(file, text.insert(33, chunk));
}

std::string transforms(const char* colour) {
    const auto frame = [&](const char* name) {
        std::string text = transformsFrame(glm::dmat4(1), ",\"depth_file_path\":\"d.png\"");
        text.replace(text.find("a.png"), 5, name);
        return text;
    };
    return "{\"camera_angle_x\":0.8,\"frames\":[" + frame(colour) + "," + frame(colour) + "]}";
}

bool holds(const std::vector<std::string>& notes, const std::string& note) {
    return std::ranges::find(notes, note) != notes.end();
}

TEST(ColourSpaces, OfPicturesBecomeSrgbAndDepthStays) {
    const TemporaryFolder folder;
    ReferenceView view;
    view.texture = Rgba8Image(kWide, kHigh, {120, 90, 60, 255});
    writeColour(folder / "c.png", view);
    const std::string linear = png::chunk("gAMA", png::bigEndian(100000, 4));
    const std::string p3 = png::chunk("cICP", std::string("\x0c\x0d\0\1", 4));
    // A PNG of ours says sRGB; cICP goes before that.
    addChunk(folder / "c.png", p3);
    writeCodes(folder / "d.png", kWide, kHigh, 16, [](int, int) { return 2000; });
    addChunk(folder / "d.png", linear);
    writeText(folder / "transforms.json", transforms("c.png"));
    for (const bool deep : {false, true}) {
        Job job;
        ImageSetOptions options;
        options.deepColour = deep;
        const auto read = readImageSet(folder.path(), options, job);
        ASSERT_TRUE(read) << read.error().text();
        const glm::u8vec4 is = read->views[0].texture.rgba8()->at(20, 10);
        EXPECT_NEAR(is.r, 126, 1);
        EXPECT_NEAR(is.g, 88, 1);
        EXPECT_NEAR(is.b, 55, 1);
        EXPECT_EQ(read->views[0].depth.at(20, 10), readSet(folder.path())->views[1].depth.at(5, 5));
        EXPECT_TRUE(holds(job.takeNotes(),
                          "its colours are made sRGB from its colour profile; what sRGB does not "
                          "have is clipped (2 times)"));
    }
}

TEST(ColourSpaces, OfOpenExrBecomeRec709) {
    const TemporaryFolder folder;
    const auto all = [](double value) {
        return plane(kWide, kHigh, [value](int, int) { return value; });
    };
    writeExr(folder / "c.exr", {{"R", all(0.2)}, {"G", all(0.5)}, {"B", all(0.2)}});
    auto bytes = *readFile(folder / "c.exr", Limits());
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto at = text.find(std::string_view("chromaticities\0chromaticities\0", 30));
    ASSERT_NE(at, text.npos);
    constexpr float kBt2020[] = {0.708f, 0.292f, 0.17f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.329f};
    std::memcpy(bytes.data() + at + 34, kBt2020, sizeof(kBt2020));
    writeBytes(folder / "c.exr", bytes);
    writeCodes(folder / "d.png", kWide, kHigh, 16, [](int, int) { return 2000; });
    writeText(folder / "transforms.json", transforms("c.exr"));
    Job job;
    const auto read = readImageSet(folder.path(), {}, job);
    ASSERT_TRUE(read) << read.error().text();
    const glm::vec4 is = read->views[0].texture.at(20, 10);
    EXPECT_NEAR(is.r, 0.02371, 1e-4);
    EXPECT_NEAR(is.g, 0.53987, 1e-4);
    EXPECT_NEAR(is.b, 0.16981, 1e-4);
    EXPECT_TRUE(holds(job.takeNotes(),
                      "its chromaticities are not those of Rec. 709: colours are converted to "
                      "these (2 times)"));
}

}  // namespace
