#include <gtest/gtest.h>

#include "formats/files/files.hpp"
#include "formats/files/shown_name.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// Messages name what a person asked for, not where it is until it is whole.
TEST(ShownName, TemporaryPathsAreShownAsTheirTargets) {
    const TemporaryFolder folder;
    std::filesystem::path left;
    {
        auto file = OutputFile::create(folder / "a.txt");
        ASSERT_TRUE(file);
        left = *file->temporaryPath();
        EXPECT_EQ(shownName(left), folder / "a.txt");
        auto set = OutputFolder::create(folder / "set", {});
        ASSERT_TRUE(set);
        EXPECT_EQ(shownName(set->temporaryPath() / "images/b.png"), folder / "set/images/b.png");
        auto inside = OutputFile::create(set->temporaryPath() / "c.png");
        ASSERT_TRUE(inside);
        EXPECT_EQ(shownName(*inside->temporaryPath()), folder / "set/c.png");
    }
    EXPECT_EQ(shownName(left), left);
    EXPECT_EQ(shownName("other.png"), "other.png");
}

}  // namespace
}  // namespace stx
