// Colour of 16 bits, from a picture of a set through a bundle and back into a picture.

#include <algorithm>

#include "formats/exr/bundle_exr.hpp"
#include "formats/imagesets/export.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

constexpr int kSide = 256;

/// Every code of 16 bits once in each channel; alpha of all kinds, with full and none.
std::vector<glm::u16vec4> everyCode() {
    std::vector<glm::u16vec4> out(kSide * kSide);
    for (std::uint32_t i = 0; i < out.size(); ++i) {
        const std::uint32_t alpha = i % 4 == 0 ? 65535 : i % 997 == 1 ? 0 : i * 40503u;
        out[i] = {i, i ^ 0x5555u, i * 25173u + 13849u, alpha};
    }
    return out;
}

void writeSet(const TemporaryFolder& folder, const std::vector<glm::u16vec4>& codes) {
    const auto png = encodePng(kSide, kSide, 4, 16, codes.data(), true);
    ASSERT_TRUE(png);
    writeBytes(folder / "a.png", *png);
    writeCodes(folder / "d.png", kSide, kSide, 16, [](int, int) { return 2000; });
    writeText(folder / "transforms.json",
              "{\"camera_angle_x\":0.8,\"frames\":[" +
                  transformsFrame(glm::dmat4(1), ",\"depth_file_path\":\"d.png\"") + "]}");
}

std::vector<glm::u16vec4> codesOf(const std::filesystem::path& file) {
    const auto bytes = readFile(file, Limits());
    EXPECT_TRUE(bytes) << file;
    const auto image = decodeImage(*bytes, "a.png", Limits());
    EXPECT_TRUE(image);
    const auto& values = std::get<std::vector<std::uint16_t>>(image->values);
    EXPECT_EQ(image->channels, 4);
    std::vector<glm::u16vec4> out(values.size() / 4);
    for (std::size_t i = 0; i < values.size(); ++i) out[i / 4][static_cast<int>(i % 4)] = values[i];
    return out;
}

TEST(DeepColour, ComesBackToTheBitThroughOpenExr) {
    const auto codes = everyCode();
    const TemporaryFolder folder;
    writeSet(folder, codes);
    Job job;
    ImageSetOptions options;
    options.deepColour = true;
    const auto bundle = readImageSet(folder.path(), options, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ASSERT_TRUE(writeExrViews(*viewsOf(*bundle), folder / "b.exr", job));
    const auto back = readExrBundle(folder / "b.exr", job);
    ASSERT_TRUE(back) << back.error().text();
    ExportOptions write;
    write.linearAsPng = true;
    ASSERT_TRUE(exportViews(*viewsOf(*back), folder / "out", write, job));
    for (const std::string& note : job.takeNotes())
        EXPECT_EQ(note.find("colour"), std::string::npos) << note;
    const auto found = codesOf(folder / "out/images/a.png");
    ASSERT_EQ(found.size(), codes.size());
    for (std::size_t i = 0; i < codes.size(); ++i) {
        ASSERT_EQ(found[i].a, codes[i].a) << i;
        // Colours under no coverage are those beside them.
        if (codes[i].a > 0) {
            ASSERT_EQ(found[i], codes[i]) << i;
        }
    }
}

TEST(DeepColour, IsRoundedWithANoteWhereNobodyAsksForIt) {
    const TemporaryFolder folder;
    writeSet(folder, everyCode());
    Job job;
    const auto bundle = readImageSet(folder.path(), {}, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    EXPECT_FALSE(bundle->views[0].texture.isLinear());
    const auto notes = job.takeNotes();
    EXPECT_TRUE(std::ranges::any_of(notes, [](const std::string& note) {
        return note.find("colour of 16 bits is rounded to 8") != std::string::npos;
    }));
}

TEST(DeepColour, PicturesOfEightBitsBesideItComeBackToo) {
    const TemporaryFolder folder;
    writeSet(folder, everyCode());
    std::vector<glm::u8vec4> bytes(kSide * kSide);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = {i, i / 256, i * 7, 255};
    const auto png = encodePng(kSide, kSide, 4, 8, bytes.data(), true);
    ASSERT_TRUE(png);
    writeBytes(folder / "b.png", *png);
    const std::string frame = transformsFrame(glm::dmat4(1), ",\"depth_file_path\":\"d.png\"");
    std::string other = frame;
    other.replace(other.find("a.png"), 5, "b.png");
    writeText(folder / "transforms.json",
              "{\"camera_angle_x\":0.8,\"frames\":[" + frame + "," + other + "]}");
    Job job;
    ImageSetOptions options;
    options.deepColour = true;
    const auto bundle = readImageSet(folder.path(), options, job);
    ASSERT_TRUE(bundle) << bundle.error().text();
    ExportOptions write;
    write.linearAsPng = true;
    ASSERT_TRUE(exportViews(*viewsOf(*bundle), folder / "out", write, job));
    const auto found = codesOf(folder / "out/images/b.png");
    ASSERT_EQ(found.size(), bytes.size());
    for (std::size_t i = 0; i < bytes.size(); ++i)
        ASSERT_EQ(found[i], glm::u16vec4(bytes[i]) * std::uint16_t{257}) << i;
}

TEST(DeepColour, SaysWhatPngCannotHold) {
    const TemporaryFolder folder;
    Bundle bundle;
    bundle.views = roomViews(1);
    RgbaFloatImage linear(bundle.views[0].texture.width(), bundle.views[0].texture.height(),
                          glm::vec4(0.123456f, 0.5f, 0.25f, 1.0f));
    bundle.views[0].texture = Texture(linear);
    bundle.bounds = bundle.computeBounds();
    ExportOptions write;
    write.linearAsPng = true;
    Job job;
    ASSERT_TRUE(exportViews(*viewsOf(bundle), folder / "a", write, job));
    EXPECT_EQ(job.takeNotes().back(), "linear colour becomes 16-bit sRGB");
    linear.at(3, 3).g = 1.5f;
    bundle.views[0].texture = Texture(linear);
    ASSERT_TRUE(exportViews(*viewsOf(bundle), folder / "b", write, job));
    EXPECT_EQ(job.takeNotes().back(),
              "linear colour becomes 16-bit sRGB; values above 1 are clipped");
}

}  // namespace
