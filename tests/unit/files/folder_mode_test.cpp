#include "formats/files/folder_mode.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "formats/files/files.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

struct stat factsOf(const std::filesystem::path& path) {
    struct stat info = {};
    EXPECT_EQ(::stat(path.c_str(), &info), 0) << path;
    return info;
}

/// Writes "set" with one file in it, in place of the one that is there.
void replaceSet(const TemporaryFolder& folder) {
    auto set = OutputFolder::create(folder / "set", {});
    ASSERT_TRUE(set) << set.error().text();
    std::ofstream(set->temporaryPath() / "view_1.png") << "new";
    const auto committed = set->commit();
    ASSERT_TRUE(committed) << committed.error().text();
}

TEST(OutputFolder, KeepsTheModeOfTheFolderThatItReplaces) {
    const TemporaryFolder folder;
    replaceSet(folder);
    for (const mode_t mode : {0700U, 0770U, 0555U, 0750U}) {
        ASSERT_EQ(::chmod((folder / "set").c_str(), mode), 0);
        replaceSet(folder);
        EXPECT_EQ(factsOf(folder / "set").st_mode & 07777U, mode);
    }
}

TEST(OutputFolder, KeepsTheGroupOfTheFolderThatItReplaces) {
    constexpr gid_t kGroup = 65534;  // of nobody
    const TemporaryFolder folder;
    replaceSet(folder);
    if (::chown((folder / "set").c_str(), static_cast<uid_t>(-1), kGroup) != 0)
        GTEST_SKIP() << "cannot give a folder to another group here";
    ASSERT_EQ(::chmod((folder / "set").c_str(), 02770), 0);
    replaceSet(folder);
    EXPECT_EQ(factsOf(folder / "set").st_gid, kGroup);
    EXPECT_EQ(factsOf(folder / "set").st_mode & 07777U, 02770U);
    // As files that are made in it have it.
    EXPECT_EQ(factsOf(folder / "set/view_1.png").st_gid, kGroup);
}

TEST(FolderMode, IsOfFoldersOnly) {
    const TemporaryFolder folder;
    std::ofstream(folder / "file") << "x";
    EXPECT_FALSE(modeOfFolder(folder / "file"));
    EXPECT_FALSE(modeOfFolder(folder / "none"));
    EXPECT_TRUE(modeOfFolder(folder.path()));
}

}  // namespace
}  // namespace stx
