#include <gtest/gtest.h>

#include "formats/atlas/atlas_files.hpp"
#include "formats/exr/bundle_exr.hpp"
#include "lib/packing/packing.hpp"
#include "tests/small_bundle.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// Random bundles of every kind, some of them with fewer depth bits in a view.
Bundle randomBundle(unsigned seed) {
    const int bits[] = {8, 16, 32};
    Bundle bundle =
        smallBundle(1 + static_cast<int>(seed % 4), bits[seed % 3], seed % 2, seed % 5 == 0, seed);
    if (seed % 7 == 0) bundle.bounds.reset();
    if (seed % 4 == 1) bundle.title = "quotes \" and \\ back";
    return bundle;
}

class Seeds : public testing::TestWithParam<unsigned> {};

TEST_P(Seeds, ReadExrOfWriteExrIsIdentity) {
    const TemporaryFolder folder;
    Bundle bundle = randomBundle(GetParam());
    Job job;
    const auto written = writeExrViews(*viewsOf(bundle), folder / "a.exr", job);
    ASSERT_TRUE(written) << written.error().text();
    const auto back = readExrBundle(folder / "a.exr", job);
    ASSERT_TRUE(back) << back.error().text();
    // The file always tells the bounds.
    bundle.bounds = bundle.computeBounds();
    EXPECT_EQ(differenceOf(bundle, *back), "");
}

TEST_P(Seeds, ReadAtlasOfWriteAtlasIsIdentityBehindPacking) {
    const TemporaryFolder folder;
    const Bundle bundle = randomBundle(GetParam());
    PackSettings settings;
    settings.layout = GetParam() % 2 ? PackSettings::Layout::grid : PackSettings::Layout::tight;
    Job job;
    const auto atlas = pack(bundle, settings, job);
    ASSERT_TRUE(atlas) << atlas.error().text();
    const auto written = writeAtlas(*atlas, folder / "set", job);
    ASSERT_TRUE(written) << written.error().text();
    const auto back = readAtlas(folder / "set", job);
    ASSERT_TRUE(back) << back.error().text();
    EXPECT_TRUE(job.takeNotes().empty());
    EXPECT_EQ(back->rectangles, atlas->rectangles);
    ASSERT_EQ(back->pages.size(), atlas->pages.size());
    for (std::size_t i = 0; i < atlas->pages.size(); ++i) {
        EXPECT_EQ(back->pages[i].depth, atlas->pages[i].depth);
        if (!atlas->pages[i].texture.isLinear()) {
            EXPECT_EQ(back->pages[i].texture, atlas->pages[i].texture);
        }
    }
    // And what is written again has the same bytes.
    ASSERT_TRUE(writeAtlas(*back, folder / "again", job));
    for (const auto& entry : std::filesystem::directory_iterator(folder / "set")) {
        const auto a = readFile(entry.path(), Limits());
        const auto b = readFile(folder / "again" / entry.path().filename().string(), Limits());
        EXPECT_EQ(*a, *b) << entry.path();
    }
}

INSTANTIATE_TEST_SUITE_P(All, Seeds, testing::Range(1u, 25u));

}  // namespace
}  // namespace stx
