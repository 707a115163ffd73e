// Depth in a grey picture beside a photo: what its codes are, and options that do not go together.

#include <algorithm>

#include "formats/images/codec_module.hpp"
#include "formats/images/exif.hpp"
#include "formats/imagesets/kinds.hpp"
#include "formats/imagesets/summary.hpp"
#include "formats/photos/photo.hpp"
#include "tests/made_photos.hpp"
#include "tests/unit/imagesets/set_writer.hpp"

using namespace stx;
using namespace sets;

namespace {

/// A photo with depth beside it, whose codes are 100 on the left, 150 and 200 on the right.
struct GreyBeside {
    TemporaryFolder folder;
    ImageSetOptions options;

    explicit GreyBeside(int bits) {
        ReferenceView view;
        view.texture = Rgba8Image(96, 64, {10, 200, 30, 255});
        writeColour(folder / "a.png", view);
        const int unit = bits == 16 ? 50 : 1;
        writeCodes(folder / "a_depth.png", 96, 64, bits, [unit](int x, int) {
            return unit * (x < 32 ? 100 : x < 64 ? 150 : 200);
        });
        options.from = "photo";
        options.photo.nearIs = NearIs::black;
        options.refine = *RefineSettings::from("off");
    }
    [[nodiscard]] Result<Bundle> read() const { return readSet(folder / "a.png", options); }
};

/// Codes of 200 in the upper left quarter, 100 elsewhere.
std::vector<std::uint8_t> quarterCodes(glm::ivec2 size) {
    std::vector<std::uint8_t> codes;
    for (int y = 0; y < size.y; ++y)
        for (int x = 0; x < size.x; ++x)
            codes.push_back(x < size.x / 2 && y < size.y / 2 ? 200 : 100);
    return codes;
}

/// A photo of 96x64 that EXIF turns, with depth beside it.
struct TurnedBeside {
    static constexpr int kWidth = 96, kHeight = 64;
    TemporaryFolder folder;
    ImageSetOptions options;
    std::vector<std::string> notes;

    explicit TurnedBeside(int orientation) {
        writeBytes(folder / "a.jpg", made::withSegments(made::colourJpeg(kWidth, kHeight),
                                                        {made::exifSegment(orientation, 28)}));
        options.from = "photo";
        options.photo.nearIs = NearIs::white;
        options.depthMin = 2;
        options.depthMax = 4;
        options.depthBits = 32;
        options.refine = *RefineSettings::from("off");
    }
    [[nodiscard]] Result<ReferenceView> read() {
        Job job;
        auto bundle = readImageSet(folder / "a.jpg", options, job);
        if (!bundle) return tl::unexpected(bundle.error());
        notes = job.takeNotes();
        return std::move(bundle->views[0]);
    }
    [[nodiscard]] bool notesSay(std::string_view text) const {
        return std::ranges::any_of(
            notes, [&](const std::string& note) { return note.find(text) != std::string::npos; });
    }
    /// The size of the depth that stx info shows.
    [[nodiscard]] glm::ivec2 depthOfInfo() const {
        Job job;
        const auto summary = summariseImageSet(folder / "a.jpg", job);
        return summary && summary->photo ? summary->photo->uprightSize(summary->photo->depth)
                                         : glm::ivec2(0);
    }
};

/// A photo of 96x64 in any file, with depth of one distance beside it.
struct FlatBeside {
    TemporaryFolder folder;
    ImageSetOptions options;
    std::string notes;

    FlatBeside() {
        writeExr(folder / "a_depth.exr", {{"Z", plane(96, 64, [](int, int) { return 3; })}});
        options.from = "photo";
        options.refine = *RefineSettings::from("off");
    }
    [[nodiscard]] Result<ReferenceView> read(const std::string& name) {
        Job job;
        auto bundle = readImageSet(folder / name, options, job);
        if (!bundle) return tl::unexpected(bundle.error());
        notes.clear();
        for (const std::string& note : job.takeNotes()) notes += note + "\n";
        return std::move(bundle->views[0]);
    }
};

/// Whether the upper left quarter is near, and no other.
void expectUpright(const Image<float>& depth) {
    const int w = depth.width(), h = depth.height();
    EXPECT_NEAR(depth.at(w / 4, h / 4), 2, 0.05);
    EXPECT_NEAR(depth.at(3 * w / 4, h / 4), 4, 0.05);
    EXPECT_NEAR(depth.at(w / 4, 3 * h / 4), 4, 0.05);
    EXPECT_NEAR(depth.at(3 * w / 4, 3 * h / 4), 4, 0.05);
}

}  // namespace

/// The range is that of the codes which the picture has, not of all that its bits could hold.
TEST(PhotoDepth, ARangeIsOfTheNearestAndTheFarthestCode) {
    for (const int bits : {8, 16}) {
        GreyBeside photo(bits);
        for (const bool blackIsNear : {true, false}) {
            photo.options.photo.nearIs = blackIsNear ? NearIs::black : NearIs::white;
            const int nearest = blackIsNear ? 5 : 90, farthest = blackIsNear ? 90 : 5;
            for (const double far : {10.0, 1000.0}) {
                photo.options.depthMin = 2;
                photo.options.depthMax = far;
                const auto given = photo.read();
                ASSERT_TRUE(given) << given.error().text();
                const auto& z = given->views[0].depth;
                EXPECT_NEAR(z.at(nearest, 30), 2, 1e-5);
                EXPECT_NEAR(z.at(farthest, 30), far, 1e-5 * far);
                EXPECT_NEAR(1 / z.at(48, 30), (0.5 + 1 / far) / 2, 1e-5);
            }
            photo.options.depthMin = photo.options.depthMax = 0;
            const auto assumed = photo.read();
            ASSERT_TRUE(assumed) << assumed.error().text();
            const auto& z = assumed->views[0].depth;
            EXPECT_NEAR(z.at(48, 30), 1, 1e-5);
            EXPECT_NEAR(z.at(farthest, 30) / z.at(nearest, 30), 4, 1e-4);
        }
    }
}

/// All codes alike: none is nearest, so the range is of all that the bits hold.
TEST(PhotoDepth, OneCodeIsSomewhereInTheRange) {
    GreyBeside photo(8);
    writeCodes(photo.folder / "a_depth.png", 96, 64, 8, [](int, int) { return 100; });
    photo.options.depthMin = 2;
    photo.options.depthMax = 10;
    const auto read = photo.read();
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_GT(read->views[0].depth.at(5, 5), 2);
    EXPECT_LT(read->views[0].depth.at(5, 5), 10);
}

TEST(PhotoDepth, FocalLengthsThatAreNotInPixelsAreNotUsed) {
    const struct {
        glm::dvec2 focal;
        std::string_view said;
    } kCases[] = {{{60, 60}, ""},
                  {{0.9, 1.2}, "look normalised, and pixels are expected"},
                  {{0.9, 0.9}, "look normalised, and pixels are expected"},
                  {{40, 60}, "differ by more than 2 %"}};
    for (const auto& [focal, said] : kCases) {
        const TemporaryFolder folder;
        writeBytes(folder / "a.jpg", made::dynamicPhoto("Meters", focal));
        ImageSetOptions options;
        options.refine = *RefineSettings::from("off");
        Job job;
        const auto read = readImageSet(folder / "a.jpg", options, job);
        ASSERT_TRUE(read) << read.error().text();
        std::string notes;
        for (const std::string& note : job.takeNotes()) notes += note + "\n";
        EXPECT_EQ(notes.find("its intrinsic matrix is not used") == std::string::npos, said.empty())
            << notes;
        EXPECT_NE(notes.find(said), std::string::npos) << notes;
    }
}

TEST(PhotoDepth, OptionsThatDoNotGoTogetherAreRefused) {
    GreyBeside photo(16);
    photo.options.depthUnit = 0.001;
    expectError(photo.read(), {"--depth-near", "--depth-unit"});
    photo.options.photo.nearIs = NearIs::unknown;
    EXPECT_TRUE(photo.read());
    photo.options.depthMin = 1;
    photo.options.depthMax = 2;
    expectError(photo.read(), {"--depth-range", "--depth-unit"});
    EXPECT_EQ(photo.read().error().code, ErrorCode::usage);
    // Floats are distances already.
    std::filesystem::remove(photo.folder / "a_depth.png");
    writeExr(photo.folder / "a_depth.exr", {{"Z", plane(96, 64, [](int, int) { return 3; })}});
    photo.options.depthUnit = 0;
    expectError(photo.read(), {"a_depth.exr", "floats", "--depth-range"});
    EXPECT_EQ(photo.read().error().code, ErrorCode::usage);
    photo.options.depthMin = photo.options.depthMax = 0;
    photo.options.depthUnit = 0.001;
    expectError(photo.read(), {"a_depth.exr", "floats", "--depth-unit"});
    photo.options.depthUnit = 0;
    photo.options.photo.nearIs = NearIs::white;
    expectError(photo.read(), {"a_depth.exr", "floats", "--depth-near"});
    photo.options.photo.nearIs = NearIs::unknown;
    EXPECT_TRUE(photo.read());
    photo.options.photo.fovRad = 1;
    EXPECT_TRUE(photo.read());
    photo.options.intrinsics[0] = photo.options.intrinsics[1] = 80;
    expectError(photo.read(), {"a.png", "--intrinsics", "--fov"});
}

TEST(PhotoDepth, OptionsOfDepthBesideAreRefusedWhereTheFileHasIt) {
    const TemporaryFolder folder;
    ASSERT_TRUE(writeFile(folder / "a.jpg", made::gdepthPhoto()));
    EXPECT_TRUE(readSet(folder / "a.jpg"));
    ImageSetOptions options;
    options.depthUnit = 0.5;
    expectError(readSet(folder / "a.jpg", options), {"a.jpg", "--depth-unit", "in the file"});
    options.depthUnit = 0;
    options.photo.nearIs = NearIs::white;
    expectError(readSet(folder / "a.jpg", options), {"a.jpg", "--depth-near", "in the file"});
}

/// It was decoded for its code; the first who loads the view takes what that gave.
TEST(PhotoDepth, IsReadOnce) {
    GreyBeside photo(16);
    Job job;
    const auto set = imagesets::describeSet(photo.folder / "a.png", photo.options, job);
    ASSERT_TRUE(set) << set.error().text();
    std::filesystem::remove(photo.folder / "a_depth.png");
    const imagesets::SetView& view = set->views.at(0);
    const auto first = view.load(view, job);
    ASSERT_TRUE(first) << first.error().text();
    EXPECT_EQ(first->depth.at(40, 3), 50 * 150);
    EXPECT_EQ(first->largest, 65535);
    const auto again = view.load(view, job);
    ASSERT_FALSE(again);
    EXPECT_EQ(again.error().code, ErrorCode::io);
}

/// Phones and programs that write pairs may give both files the orientation.
TEST(PhotoDepth, DepthWithAnOrientationOfItsOwnIsTurnedByIt) {
    for (const int orientation : {1, 3, 6, 8}) {
        SCOPED_TRACE(orientation);
        const int back = orientation == 6 ? 8 : orientation == 8 ? 6 : orientation;
        TurnedBeside photo(orientation);
        const bool sideways = orientation >= 5;
        Image<std::uint8_t> codes(sideways ? 64 : 96, sideways ? 96 : 64);
        std::ranges::copy(quarterCodes(codes.size()), codes.data());
        codes = turnedUpright(std::move(codes), back);
        const auto jpeg = encodeJpeg(codes.width(), codes.height(), 1, codes.data(), 95);
        ASSERT_TRUE(jpeg);
        writeBytes(photo.folder / "a_depth.jpg",
                   made::withSegments(*jpeg, {made::exifSegment(orientation, 28)}));
        const auto view = photo.read();
        ASSERT_TRUE(view) << view.error().text();
        EXPECT_EQ(view->depth.width(), view->texture.width());
        expectUpright(view->depth);
        EXPECT_FALSE(photo.notesSay("upright"));
    }
}

/// Without an orientation of its own the depth's size tells how it lies, where it can.
TEST(PhotoDepth, DepthThatLiesAsTheSensorSawItIsTurnedAsItsPicture) {
    for (const int orientation : {6, 8}) {
        for (const bool asStored : {true, false}) {
            for (const int part : {1, 2}) {
                SCOPED_TRACE(fmt::format("{} {} {}", orientation, asStored, part));
                TurnedBeside photo(orientation);
                Image<std::uint8_t> codes(64 / part, 96 / part);
                std::ranges::copy(quarterCodes(codes.size()), codes.data());
                if (asStored) codes = turnedUpright(std::move(codes), orientation == 6 ? 8 : 6);
                writeCodes(photo.folder / "a_depth.png", codes.width(), codes.height(), 8,
                           [&](int x, int y) { return codes.at(x, y); });
                const auto view = photo.read();
                ASSERT_TRUE(view) << view.error().text();
                expectUpright(view->depth);
                EXPECT_EQ(photo.notesSay("turned as the picture is"), asStored);
            }
        }
    }
}

TEST(PhotoDepth, InfoShowsTheSizeThatTheDepthHasUpright) {
    for (const glm::ivec2 size : {glm::ivec2(96, 64), glm::ivec2(64, 96)}) {
        TurnedBeside photo(6);
        writeExr(photo.folder / "a_depth.exr",
                 {{"Z", plane(size.x, size.y, [](int, int) { return 3; })}});
        EXPECT_EQ(photo.depthOfInfo(), glm::ivec2(64, 96));
    }
}

TEST(PhotoDepth, DepthWhoseSizeDoesNotTellIsTakenAsUpright) {
    for (const int orientation : {1, 3}) {
        TurnedBeside photo(orientation);
        const auto codes = quarterCodes({96, 64});
        writeCodes(photo.folder / "a_depth.png", 96, 64, 8,
                   [&](int x, int y) { return codes[static_cast<std::size_t>(96 * y + x)]; });
        const auto view = photo.read();
        ASSERT_TRUE(view) << view.error().text();
        expectUpright(view->depth);
        EXPECT_EQ(photo.notesSay("is taken as upright"), orientation == 3);
    }
}

/// What a picture cuts out is not there.
TEST(PhotoDepth, AlphaOfThePictureIsItsCoverage) {
    for (const int bits : {8, 16}) {
        for (const bool cut : {true, false}) {
            SCOPED_TRACE(fmt::format("{} bits, {}", bits, cut ? "cut out" : "opaque"));
            FlatBeside photo;
            std::vector<std::uint8_t> bytes;
            std::vector<std::uint16_t> words;
            for (int y = 0; y < 64; ++y)
                for (int x = 0; x < 96; ++x)
                    for (const int v : {200, 100, 50, cut && x < 48 ? 0 : 255}) {
                        bytes.push_back(static_cast<std::uint8_t>(v));
                        words.push_back(static_cast<std::uint16_t>(257 * v));
                    }
            const auto png = encodePng(96, 64, 4, bits,
                                       bits == 8 ? static_cast<const void*>(bytes.data())
                                                 : static_cast<const void*>(words.data()),
                                       true);
            ASSERT_TRUE(png);
            writeBytes(photo.folder / "a.png", *png);
            const auto view = photo.read("a.png");
            ASSERT_TRUE(view) << view.error().text();
            EXPECT_NEAR(view->texture.at(20, 30).a, cut ? 0 : 1, 1e-6);
            EXPECT_EQ(hasPoint(view->depth.at(20, 30)), !cut);
            EXPECT_NEAR(view->texture.at(70, 30).a, 1, 1e-6);
            EXPECT_TRUE(hasPoint(view->depth.at(70, 30)));
        }
    }
}

TEST(PhotoDepth, ColourOfMoreThan8BitsIsKeptOrNoted) {
    FlatBeside photo;
    const std::vector<std::uint16_t> words(std::size_t{96} * 64 * 3, 25700 + 100);
    const auto png = encodePng(96, 64, 3, 16, words.data(), true);
    ASSERT_TRUE(png);
    writeBytes(photo.folder / "a.png", *png);
    const auto rounded = photo.read("a.png");
    ASSERT_TRUE(rounded) << rounded.error().text();
    EXPECT_FALSE(rounded->texture.isLinear());
    EXPECT_NE(photo.notes.find("colour of 16 bits is rounded to 8"), std::string::npos)
        << photo.notes;
    photo.options.deepColour = true;
    const auto deep = photo.read("a.png");
    ASSERT_TRUE(deep) << deep.error().text();
    ASSERT_TRUE(deep->texture.isLinear());
    EXPECT_NEAR(65535 * srgbFromLinear(deep->texture.at(5, 5).r), 25800, 0.5);
    EXPECT_EQ(photo.notes.find("rounded"), std::string::npos) << photo.notes;

    // Light beyond white.
    photo.options.deepColour = false;
    const auto bright = plane(96, 64, [](int x, int) { return x < 48 ? 4 : 1; });
    writeExr(photo.folder / "a.exr", {{"R", bright}, {"G", bright}, {"B", bright}});
    const auto light = photo.read("a.exr");
    ASSERT_TRUE(light) << light.error().text();
    ASSERT_TRUE(light->texture.isLinear());
    EXPECT_EQ(light->texture.at(5, 5).g, 4.0f);
}

/// Whose size only decoding shows.
TEST(PhotoDepth, AWebpThatExifTurnsHasItsDepth) {
    for (const int orientation : {5, 6, 8}) {
        SCOPED_TRACE(orientation);
        TurnedBeside photo(orientation);
        photo.options.photo.nearIs = NearIs::unknown;
        photo.options.depthMin = photo.options.depthMax = 0;
        std::filesystem::remove(photo.folder / "a.jpg");
        // Its first column is red.
        std::vector<std::uint8_t> rgb;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 96; ++x)
                for (const int v : {x == 0 ? 255 : 0, 80, 40})
                    rgb.push_back(static_cast<std::uint8_t>(v));
        const std::string file = (photo.folder / "a.webp").string();
        const auto table = loadCodecs();
        ASSERT_TRUE(table) << table.error().text();
        codecs::EncodeRequest request;
        request.path = file.c_str();
        request.format = "webp";
        request.width = 96;
        request.height = 64;
        request.channels = 3;
        request.values = rgb.data();
        codecs::Failure failure;
        ASSERT_TRUE((*table)->encode(request, failure)) << failure.message;
        auto bytes = readFile(file, Limits());
        ASSERT_TRUE(bytes);
        // What follows the marker and the length of a JPEG's segment.
        const Bytes segment = made::exifSegment(orientation, 28);
        made::append(*bytes, "EXIF");
        made::appendLittle(*bytes, static_cast<std::uint32_t>(segment.size() - 4));
        made::append(*bytes, ByteSpan(segment).subspan(4));
        if (segment.size() % 2 == 1) bytes->push_back(std::byte{0});
        writeBytes(file, *bytes);
        writeExr(photo.folder / "a_depth.exr",
                 {{"Z", plane(64, 96, [](int, int y) { return y < 48 ? 2 : 4; })}});
        Job job;
        const auto read = readImageSet(file, photo.options, job);
        ASSERT_TRUE(read) << read.error().text();
        const ReferenceView& view = read->views[0];
        ASSERT_EQ(glm::ivec2(view.texture.width(), view.texture.height()), glm::ivec2(64, 96));
        ASSERT_EQ(view.depth.size(), glm::ivec2(64, 96));
        EXPECT_NEAR(view.texture.at(30, orientation == 8 ? 95 : 0).r, 1, 1e-6);
        EXPECT_EQ(view.depth.at(30, 10), 2.0f);
    }
}

/// The ending alone says what such a file is.
TEST(PhotoDepth, ATgaIsAPhotoToo) {
    FlatBeside photo;
    std::string tga(18, '\0');
    tga[2] = 2;  // colours
    tga[12] = 96;
    tga[14] = 64;
    tga[16] = 24;  // bits
    tga[17] = 32;  // from the top
    for (int i = 0; i < 96 * 64; ++i) tga += {10, 20, 30};
    writeText(photo.folder / "a.tga", tga);
    const auto view = photo.read("a.tga");
    ASSERT_TRUE(view) << view.error().text();
    EXPECT_EQ(glm::round(view->texture.at(40, 30) * 255.0f), glm::vec4(30, 20, 10, 255));
    EXPECT_EQ(view->depth.at(40, 30), 3.0f);
}
