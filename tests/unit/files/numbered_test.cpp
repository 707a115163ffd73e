#include "formats/files/numbered.hpp"

#include <gtest/gtest.h>

#include "formats/files/files.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

TEST(NumberedNames, TheNumberIsInTheNameOfTheFile) {
    EXPECT_EQ(frameName("a_%04d.png", 7), "a_0007.png");
    EXPECT_EQ(frameName("50%/a_%d.png", 7), "50%/a_7.png");
    EXPECT_EQ(frameName("a%db/c_%d.png", 7), "a%db/c_7.png");
    EXPECT_EQ(frameName("a%db/c.png", 7), std::nullopt);
    EXPECT_EQ(frameName("50%/c.png", 7), std::nullopt);
    // Of folders, as those of atlases are, the last.
    EXPECT_EQ(frameName("50%/a_%d", 7), "50%/a_7");
    EXPECT_EQ(frameName("50%/a_%d/", 7), "50%/a_7/");
}

TEST(NumberedNames, OtherPercentSignsAreThemselves) {
    EXPECT_EQ(frameName("y50%_%d.exr", 7), "y50%_7.exr");
    EXPECT_EQ(frameName("50%%d.exr", 7), "50%7.exr");
    EXPECT_EQ(frameName("%d_50%.exr", 7), "7_50%.exr");
    EXPECT_EQ(frameName("50%.exr", 7), std::nullopt);
    EXPECT_EQ(frameName("50%4", 7), std::nullopt);
}

TEST(NumberedNames, OneNumberIsPossible) {
    EXPECT_TRUE(checkPattern("a%db/50%_%d.png"));
    EXPECT_FALSE(checkPattern("b/a_%d_%d.png"));
    EXPECT_FALSE(checkPattern("b/a_%d_5%_%d.png"));
}

TEST(NumberedNames, FilesAreFoundByTheSameRule) {
    const TemporaryFolder folder;
    const auto inside = folder / "50%_a%db";
    std::filesystem::create_directories(inside / "set_2");
    for (const char* name : {"y50%_1.png", "y50%_12.png", "y50%_x.png"})
        ASSERT_TRUE(writeFile(inside / name, Bytes(1)));
    const auto files = numberedFiles((inside / "y50%_%d.png").string());
    ASSERT_TRUE(files) << files.error().text();
    ASSERT_EQ(files->size(), 2U);
    EXPECT_EQ(files->at(1).path, inside / "y50%_12.png");
    EXPECT_FALSE(numberedFiles((inside / "y.png").string()));
    const auto folders = numberedFiles((inside / "set_%d/").string());
    ASSERT_TRUE(folders) << folders.error().text();
    EXPECT_EQ(folders->at(0).path, inside / "set_2");
}

}  // namespace
}  // namespace stx
