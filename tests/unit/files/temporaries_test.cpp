#include "formats/files/temporaries.hpp"

#include <gtest/gtest.h>

#include <cerrno>

#include "formats/files/files.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

/// As where another run of the same folder ends in between, and takes it away.
TEST(Temporaries, MakeAFolderAgainWhereTheyMay) {
    const TemporaryFolder folder;
    const auto gone = folder / "new/deep";
    const auto refused = createTemporaryFile(gone);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error(), ENOENT);
    EXPECT_FALSE(createTemporaryFolder(gone));
    EXPECT_FALSE(std::filesystem::exists(folder / "new"));
    mayBeMadeAgain(gone);
    ASSERT_TRUE(createTemporaryFile(gone));
    std::filesystem::remove_all(folder / "new");
    ASSERT_TRUE(createTemporaryFolder(gone));
    std::filesystem::remove_all(folder / "new");
    ASSERT_TRUE(writeFile(gone / "a", Bytes(3)));
    EXPECT_EQ(std::filesystem::file_size(gone / "a"), 3U);
}

}  // namespace
}  // namespace stx
