// A file of one moment that is opened as a film, and is another one when it is read again.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>

#include "formats/any/save.hpp"
#include "formats/any/sequences.hpp"
#include "formats/atlas/atlas_files.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/unit/atlas/small_atlas.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

/// As bundle.exr, and an atlas of the same views as atlas.exr and as a folder.
void writeStills(const TemporaryFolder& folder, unsigned seed) {
    Job job;
    ASSERT_TRUE(saveBundle(smallBundle(2, 16, false, false, seed), folder / "bundle.exr", {}, job));
    const Atlas atlas = smallAtlas(2, 16, false, false, 1, seed);
    for (const char* name : {"atlas.exr", "atlas"}) {
        const auto written = writeAtlas(atlas, folder / name, job);
        ASSERT_TRUE(written) << written.error().text();
    }
}

TEST(StillFile, IsNotReadAgainFromAnotherFileOfItsName) {
    for (const char* name : {"bundle.exr", "atlas.exr", "atlas", "atlas/atlas.json"}) {
        const TemporaryFolder folder, other;
        writeStills(folder, 1);
        writeStills(other, 2);
        Job job;
        const auto film = openSequence(folder / name, {}, job);
        ASSERT_TRUE(film) << film.error().text();
        ASSERT_TRUE((*film)->frame(0, job)) << name;
        // Opened again, of the same file.
        ASSERT_TRUE((*film)->frame(0, job)) << name;

        const bool inFolder = std::string_view(name).starts_with("atlas") &&
                              !std::string_view(name).ends_with(".exr");
        const fs::path moved = inFolder ? "atlas" : name;
        fs::remove_all(folder.path() / moved);
        fs::rename(other.path() / moved, folder.path() / moved);
        // Clocks of files are coarse.
        const fs::path mainFile = inFolder ? folder / "atlas/atlas.json" : folder / name;
        fs::last_write_time(mainFile, fs::last_write_time(mainFile) + std::chrono::seconds(2));
        const auto changed = (*film)->frame(0, job);
        ASSERT_FALSE(changed) << name;
        EXPECT_EQ(changed.error().code, ErrorCode::invalidInput);
        EXPECT_NE(changed.error().text().find("was changed while it was read"), std::string::npos)
            << changed.error().text();
    }
}

}  // namespace
}  // namespace stx
