// Depth in a grey picture beside a photo: what its codes are, and options that do not go together.

#include <algorithm>

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
