#include "tests/unit/imagesets/set_writer.hpp"

// Older Middlebury sets: where the cameras are for views of any numbers, and what is added to
// disparities.

namespace {

using namespace stx;
using namespace sets;

/// A set of flat pictures `views` and of disparities `codes` of 20 pixels, for a focal length of 90
/// and a baseline of 0.2.
Result<Bundle> readOlder(const std::vector<int>& views, const std::vector<int>& codes,
                         std::optional<double> offset = {}, const char* dmin = nullptr) {
    TemporaryFolder folder;
    ReferenceView plain;
    plain.texture = Rgba8Image(96, 64, {10, 200, 30, 255});
    for (const int i : views) writeColour(folder / fmt::format("view{}.png", i), plain);
    for (const int i : codes)
        writeCodes(folder / fmt::format("disp{}.png", i), 96, 64, 8, [](int, int) { return 20; });
    if (dmin) writeText(folder / "dmin.txt", dmin);
    ImageSetOptions options;
    options.focal = 90;
    options.baseline = 0.2;
    options.disparityOffset = offset;
    options.refine = RefineSettings::none();
    return readSet(folder.path(), options);
}

TEST(OlderMiddlebury, TheBaselineIsBetweenTheViewsThatHaveDisparities) {
    struct Row {
        std::vector<int> views, codes;
        std::vector<double> x;  // in baselines
    };
    for (const Row& row : std::vector<Row>{
             {{1, 5}, {1, 5}, {0, 1}},  // as published: 1 and 5, 2 and 6
             {{2, 6}, {2, 6}, {0, 1}},
             {{0, 1, 2, 3, 4, 5, 6}, {1, 5}, {0, 1}},
             {{0, 1, 2, 3, 4, 5, 6}, {1}, {0}},
             {{0, 1, 2, 3, 4, 5, 6}, {5}, {1}},
             {{1, 5}, {1}, {0}},
             {{1, 2}, {1, 2}, {0, 1}},  // others
             {{0, 1}, {0, 1}, {0, 1}},
             {{0, 5}, {0, 5}, {0, 1}},
             {{0, 5}, {5}, {1}},
             {{0, 2, 6}, {0, 2, 6}, {0, 1 / 3.0, 1}},
             {{1, 2}, {1}, {0}},
         }) {
        const auto read = readOlder(row.views, row.codes, 30.0);
        ASSERT_TRUE(read) << read.error().text();
        ASSERT_EQ(read->views.size(), row.x.size());
        for (std::size_t i = 0; i < row.x.size(); ++i) {
            const Camera& c = read->views[i].camera;
            EXPECT_NEAR(c.position.x, 0.2 * row.x[i], 1e-12) << row.codes.front() << " view " << i;
            EXPECT_NEAR(c.cx, 48 + 30 * row.x[i], 1e-12) << row.codes.front() << " view " << i;
        }
    }
}

TEST(OlderMiddlebury, AnOffsetOfZeroIsUsedInsteadOfDmin) {
    const auto depthOf = [](const Result<Bundle>& read) {
        return read ? read->views[0].depth.at(7, 7) : NAN;
    };
    EXPECT_NEAR(depthOf(readOlder({1, 5}, {1, 5})), 0.2 * 90 / 20, 1e-6);
    EXPECT_NEAR(depthOf(readOlder({1, 5}, {1, 5}, {}, "5\n")), 0.2 * 90 / 25, 1e-6);
    EXPECT_NEAR(depthOf(readOlder({1, 5}, {1, 5}, 2.0, "5\n")), 0.2 * 90 / 22, 1e-6);
    EXPECT_NEAR(depthOf(readOlder({1, 5}, {1, 5}, 0.0, "5\n")), 0.2 * 90 / 20, 1e-6);
}

}  // namespace
