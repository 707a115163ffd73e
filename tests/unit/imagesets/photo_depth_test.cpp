// Depth in a grey picture beside a photo: what its codes are, and options that do not go together.

#include <algorithm>

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
    EXPECT_TRUE(photo.read());
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
