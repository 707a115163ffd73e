#include "formats/files/files.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <set>

#include "formats/files/named_files.hpp"
#include "formats/files/temporaries.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

namespace fs = std::filesystem;

void put(const fs::path& path, std::string_view text) {
    fs::create_directories(path.parent_path());
    std::ofstream(path) << text;
}

std::string get(const fs::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

ByteSpan bytesOf(std::string_view text) {
    return std::as_bytes(std::span(text));
}

std::set<std::string> namesIn(const fs::path& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
    return names;
}

TEST(ReadFile, GivesTheBytes) {
    const TemporaryFolder folder;
    const std::string text(100000, 'x');
    put(folder / "a", text);
    const auto bytes = readFile(folder / "a", Limits());
    ASSERT_TRUE(bytes);
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()), text);
    put(folder / "empty", "");
    EXPECT_EQ(readFile(folder / "empty", Limits())->size(), 0u);
    // Announces 0 bytes.
    EXPECT_GT(readFile("/proc/self/status", Limits())->size(), 0u);
}

TEST(ReadFile, SaysWhatIsWrong) {
    const TemporaryFolder folder;
    const auto missing = readFile(folder / "none", Limits());
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::io);
    EXPECT_EQ(missing.error().message,
              "cannot open '" + (folder / "none").string() + "': No such file or directory");
    EXPECT_EQ(readFile(folder.path(), Limits()).error().code, ErrorCode::io);
    // Nobody writes to this FIFO: reading it would hang.
    ASSERT_EQ(::mkfifo((folder / "fifo").c_str(), 0600), 0);
    EXPECT_EQ(readFile(folder / "fifo", Limits()).error().code, ErrorCode::io);
    EXPECT_EQ(readFile("/dev/zero", Limits()).error().code, ErrorCode::io);
    put(folder / "big", "12345");
    Limits limits;
    limits.maxMemoryBytes = 4;
    const auto big = readFile(folder / "big", limits);
    ASSERT_FALSE(big);
    EXPECT_EQ(big.error().code, ErrorCode::invalidInput);
}

TEST(OutputFile, AppearsAtCommitOnly) {
    const TemporaryFolder folder;
    put(folder / "a", "old");
    auto file = OutputFile::create(folder / "a");
    ASSERT_TRUE(file) << file.error().text();
    ASSERT_TRUE(file->write("new "));
    ASSERT_TRUE(file->write(bytesOf("bytes")));
    EXPECT_EQ(get(folder / "a"), "old");
    EXPECT_EQ(file->temporaryPath()->parent_path(), folder.path());
    EXPECT_TRUE(file->temporaryPath()->filename().string().starts_with(".stx-tmp-"));
    ASSERT_TRUE(file->commit());
    EXPECT_EQ(get(folder / "a"), "new bytes");
    EXPECT_EQ(namesIn(folder.path()), (std::set<std::string>{"a"}));
}

TEST(OutputFile, LeavesNothingWithoutCommit) {
    const TemporaryFolder folder;
    {
        auto file = OutputFile::create(folder / "a");
        ASSERT_TRUE(file);
        ASSERT_TRUE(file->write("half"));
    }
    EXPECT_TRUE(namesIn(folder.path()).empty());
}

TEST(OutputFile, NoClobberHoldsAtBothEnds) {
    const TemporaryFolder folder;
    put(folder / "a", "old");
    const auto early = OutputFile::create(folder / "a", {.noClobber = true});
    ASSERT_FALSE(early);
    EXPECT_EQ(early.error().code, ErrorCode::io);
    auto late = OutputFile::create(folder / "b", {.noClobber = true});
    ASSERT_TRUE(late);
    ASSERT_TRUE(late->write("mine"));
    put(folder / "b", "theirs");
    EXPECT_FALSE(late->commit());
    EXPECT_EQ(get(folder / "b"), "theirs");
    auto good = OutputFile::create(folder / "c", {.noClobber = true});
    ASSERT_TRUE(good->write("c"));
    EXPECT_TRUE(good->commit());
    EXPECT_EQ(get(folder / "c"), "c");
}

TEST(OutputFile, WritesThroughLinksAndKeepsTheMode) {
    const TemporaryFolder folder;
    put(folder / "real", "old");
    ::chmod((folder / "real").c_str(), 0640);
    fs::create_symlink("real", folder / "link");
    ASSERT_TRUE(writeFile(folder / "link", bytesOf("new")));
    EXPECT_TRUE(fs::is_symlink(folder / "link"));
    EXPECT_EQ(get(folder / "real"), "new");
    EXPECT_EQ(fs::status(folder / "real").permissions(), fs::perms(0640));
}

TEST(OutputFiles, AppearTogetherOrNotAtAll) {
    const TemporaryFolder folder;
    const auto count = [&] {
        const auto all = std::filesystem::directory_iterator(folder.path());
        return std::distance(begin(all), end(all));
    };
    ASSERT_TRUE(writeFile(folder / "b", Bytes(1)));
    for (const bool commits : {false, true}) {
        OutputFiles files;
        for (const char* name : {"a", "b", "c"})
            ASSERT_TRUE(writeFile(folder / name, Bytes(2), {.together = &files}));
        EXPECT_FALSE(std::filesystem::exists(folder / "a"));
        EXPECT_EQ(std::filesystem::file_size(folder / "b"), 1U);
        if (commits) {
            ASSERT_TRUE(files.commit());
            EXPECT_EQ(std::filesystem::file_size(folder / "a"), 2U);
            EXPECT_EQ(std::filesystem::file_size(folder / "b"), 2U);
        }
    }
    EXPECT_EQ(count(), 3);
}

/// A folder with one file of that text.
Result<void> writeFolder(const fs::path& target, const std::string& text,
                         OutputFile::Options options) {
    STX_TRY(auto out, OutputFolder::create(target, options, {}));
    put(out.temporaryPath() / "colour.png", text);
    return out.commit();
}

TEST(OutputFiles, OfThousandsKeepNoneOpen) {
    const TemporaryFolder folder;
    OutputFiles files;
    for (int i = 0; i < 3000; ++i)
        ASSERT_TRUE(writeFile(folder / std::to_string(i), Bytes(1), {.together = &files})) << i;
    for (int i = 3000; i < 5000; ++i)
        ASSERT_TRUE(writeFolder(folder / std::to_string(i), "", {.together = &files})) << i;
    ASSERT_TRUE(files.commit());
    EXPECT_TRUE(std::filesystem::exists(folder / "2999"));
    EXPECT_TRUE(std::filesystem::exists(folder / "4999/colour.png"));
}

TEST(OutputFiles, HoldFoldersThatAppearTogetherOrNotAtAll) {
    const TemporaryFolder folder;
    put(folder / "a/colour.png", "old");
    for (const bool commits : {false, true}) {
        OutputFiles files;
        for (const char* name : {"a", "b"})
            ASSERT_TRUE(writeFolder(folder / name, "new", {.together = &files}));
        EXPECT_EQ(get(folder / "a/colour.png"), "old");
        EXPECT_FALSE(fs::exists(folder / "b"));
        if (commits) {
            ASSERT_TRUE(files.commit());
            EXPECT_EQ(get(folder / "a/colour.png"), "new");
            EXPECT_EQ(get(folder / "b/colour.png"), "new");
        }
    }
    EXPECT_EQ(namesIn(folder.path()), (std::set<std::string>{"a", "b"}));
}

TEST(OutputFiles, RefuseAFolderThatMustStayBeforeOthersAreReplaced) {
    const TemporaryFolder folder;
    put(folder / "a/colour.png", "old");
    put(folder / "b/thesis.tex", "precious");
    {
        OutputFiles files;
        ASSERT_TRUE(writeFolder(folder / "a", "new", {.together = &files}));
        const auto refused = writeFolder(folder / "b", "new", {.together = &files});
        ASSERT_FALSE(refused);
        EXPECT_NE(refused.error().message.find("'thesis.tex'"), std::string::npos);
    }
    EXPECT_EQ(get(folder / "a/colour.png"), "old");
    EXPECT_EQ(namesIn(folder.path()), (std::set<std::string>{"a", "b"}));
}

TEST(OutputFiles, KeepWhatIsOfAFilmThatIsOpen) {
    const TemporaryFolder folder;
    ASSERT_TRUE(writeFile(folder / "a", Bytes(1)));
    {
        const FilesOfFilm film({folder / "a"});
        const FilesOfFilm again({folder / "a"});
        const auto refused = writeFile(folder / "a", Bytes(2));
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().text(),
                  fmt::format("'{}' is a file of a film that is open, which would be lost; give "
                              "the output another name",
                              (folder / "a").string()));
    }
    EXPECT_TRUE(writeFile(folder / "a", Bytes(2)));
}

TEST(OutputFile, ErrorsNameTheTarget) {
    const TemporaryFolder folder;
    const auto missing = OutputFile::create(folder / "no/such/a");
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::io);
    EXPECT_NE(missing.error().message.find("no/such/a"), std::string::npos);
    EXPECT_NE(missing.error().message.find("No such file or directory"), std::string::npos);
    EXPECT_FALSE(OutputFile::create(folder.path()));
    EXPECT_FALSE(OutputFile::create(""));
}

TEST(OutputFile, DevicesAreWrittenStraight) {
    auto null = OutputFile::create("/dev/null");
    ASSERT_TRUE(null) << null.error().text();
    ASSERT_TRUE(null->write("gone"));
    EXPECT_TRUE(null->commit());
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
    auto full = OutputFile::create("/dev/full");
    ASSERT_TRUE(full);
    const auto written = full->write("x");
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().message.find("No space left on device"), std::string::npos);
}

/// Runs `work` in a process of its own and gives its exit status.
template <class Work>
int inChild(const Work& work) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(work());
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST(OutputFile, ReadOnlyFolderIsAnError) {
    const TemporaryFolder folder;
    ::chmod(folder.path().c_str(), 0555);
    // Root may write anywhere, so the attempt is made as nobody.
    const int status = inChild([&] {
        if (::geteuid() == 0 && ::setresuid(65534, 65534, 65534) != 0) return 77;
        const auto file = OutputFile::create(folder / "a");
        if (file || file.error().code != ErrorCode::io) return 1;
        return file.error().message.find("Permission denied") == std::string::npos ? 2 : 0;
    });
    ::chmod(folder.path().c_str(), 0755);
    if (status == 77) GTEST_SKIP() << "cannot become another user here";
    EXPECT_EQ(status, 0);
}

TEST(OutputFile, KilledRunsAreCleanedUpAndLivingOnesAreNot) {
    const TemporaryFolder folder;
    const int status = inChild([&] {
        auto file = OutputFile::create(folder / "a");
        auto set = OutputFolder::create(folder / "set", {});
        if (!file || !set || !file->write("half")) return 1;
        put(set->temporaryPath() / "colour.png", "half");
        ::kill(::getpid(), SIGKILL);
        return 0;
    });
    ASSERT_EQ(status, -SIGKILL);
    EXPECT_EQ(namesIn(folder.path()).size(), 2u);

    auto living = OutputFile::create(folder / "b");
    ASSERT_TRUE(living);
    put(folder / ".stx-tmp-not-ours/x", "");
    // Another process looks: the folder above is stale (nobody holds it), ours is not.
    EXPECT_EQ(inChild([&] {
                  removeStaleTemporariesNow(folder.path());
                  return 0;
              }),
              0);
    EXPECT_EQ(namesIn(folder.path()),
              (std::set<std::string>{living->temporaryPath()->filename().string()}));
    ASSERT_TRUE(living->write("b"));
    ASSERT_TRUE(living->commit());
    EXPECT_EQ(namesIn(folder.path()), (std::set<std::string>{"b"}));
}

TEST(OutputFile, FullDiskIsToldAndLeavesNothing) {
    const TemporaryFolder folder;
    const auto disk = folder / "disk";
    fs::create_directory(disk);
    if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0)
        GTEST_SKIP() << "cannot mount a small disk here";
    const std::string big(1 << 20, 'x');
    put(disk / "a", "old");
    const auto written = writeFile(disk / "a", bytesOf(big));
    const std::string kept = get(disk / "a");
    const auto names = namesIn(disk);
    ::umount(disk.c_str());
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::io);
    EXPECT_NE(written.error().message.find("No space left on device"), std::string::npos);
    EXPECT_EQ(kept, "old");
    EXPECT_EQ(names, (std::set<std::string>{"a"}));
}

TEST(OutputFile, TemporaryPathTakesWritesByName) {
    const TemporaryFolder folder;
    auto file = OutputFile::create(folder / "a");
    ASSERT_TRUE(file);
    put(*file->temporaryPath(), "by name");
    ASSERT_TRUE(file->commit());
    EXPECT_EQ(get(folder / "a"), "by name");
    auto null = OutputFile::create("/dev/null");
    ASSERT_TRUE(null);
    const fs::path gathered = *null->temporaryPath();
    put(gathered, "by name");
    ASSERT_TRUE(null->commit());
    EXPECT_FALSE(fs::exists(gathered));
}

TEST(OutputFile, WhatIsGatheredForADeviceIsNotTakenForStale) {
    const TemporaryFolder folder;
    const int status = inChild([&] {
        ::setenv("TMPDIR", folder.path().c_str(), 1);
        auto null = OutputFile::create("/dev/null");
        if (!null) return 1;
        const fs::path gathered = *null->temporaryPath();
        put(gathered, "by name");
        if (gathered.parent_path() != folder.path()) return 2;
        // As another run does.
        removeStaleTemporariesNow(folder.path());
        if (!fs::exists(gathered)) return 3;
        if (!null->commit()) return 4;
        return fs::exists(gathered) ? 5 : 0;
    });
    EXPECT_EQ(status, 0);
}

TEST(OutputFolder, AppearsAtCommitOnly) {
    const TemporaryFolder folder;
    auto set = OutputFolder::create(folder / "set/", {});
    ASSERT_TRUE(set) << set.error().text();
    put(set->temporaryPath() / "images/view_1.png", "1");
    EXPECT_FALSE(fs::exists(folder / "set"));
    ASSERT_TRUE(set->commit());
    EXPECT_EQ(get(folder / "set/images/view_1.png"), "1");
    EXPECT_EQ(namesIn(folder.path()), (std::set<std::string>{"set"}));
}

TEST(OutputFolder, ReplacesItsOwnKindWhole) {
    const TemporaryFolder folder;
    put(folder / "set/view_1.png", "old");
    put(folder / "set/view_17.png", "old");
    put(folder / "set/splat.exr", "old");
    auto set = OutputFolder::create(folder / "set", {}, {"splat.exr"});
    ASSERT_TRUE(set);
    put(set->temporaryPath() / "view_1.png", "new");
    const auto committed = set->commit();
    ASSERT_TRUE(committed) << committed.error().text();
    EXPECT_EQ(namesIn(folder / "set"), (std::set<std::string>{"view_1.png"}));
    EXPECT_EQ(get(folder / "set/view_1.png"), "new");
    EXPECT_EQ(namesIn(folder.path()), (std::set<std::string>{"set"}));
}

TEST(OutputFolder, NeverReplacesForeignFiles) {
    const TemporaryFolder folder;
    put(folder / "set/view_1.png", "old");
    put(folder / "set/thesis.tex", "precious");
    auto set = OutputFolder::create(folder / "set", {});
    ASSERT_TRUE(set);
    put(set->temporaryPath() / "view_1.png", "new");
    const auto committed = set->commit();
    ASSERT_FALSE(committed);
    EXPECT_NE(committed.error().message.find("'thesis.tex'"), std::string::npos);
    EXPECT_EQ(get(folder / "set/view_1.png"), "old");
    EXPECT_EQ(get(folder / "set/thesis.tex"), "precious");
}

TEST(OutputFolder, NoClobberAndWrongTargets) {
    const TemporaryFolder folder;
    fs::create_directory(folder / "set");
    EXPECT_FALSE(OutputFolder::create(folder / "set", {.noClobber = true}));
    put(folder / "file", "");
    EXPECT_FALSE(OutputFolder::create(folder / "file", {}));
    EXPECT_FALSE(OutputFolder::create(folder / "..", {}));
    EXPECT_FALSE(OutputFolder::create("", {}));
}

class ResolveInside : public testing::Test {
  protected:
    ResolveInside() {
        put(folder / "set/images/a.png", "a");
        put(folder / "outside.png", "secret");
        fs::create_symlink("../outside.png", folder / "set/leak.png");
        fs::create_directory_symlink("..", folder / "set/up");
        fs::create_symlink("images/a.png", folder / "set/inner.png");
    }
    Result<fs::path> resolve(std::string_view name, bool outside = false) {
        Limits limits;
        limits.allowOutside = outside;
        return resolveInside(folder / "set", name, limits);
    }
    const TemporaryFolder folder;
};

TEST_F(ResolveInside, FindsWhatIsInside) {
    for (const char* name : {"images/a.png", "./images/a.png", "images/../images/a.png",
                             "inner.png", "images\\a.png"}) {
        const auto path = resolve(name);
        ASSERT_TRUE(path) << path.error().text();
        EXPECT_EQ(get(*path), "a");
    }
}

TEST_F(ResolveInside, RefusesEveryWayOut) {
    for (const char* name : {"../outside.png", "images/../../outside.png", "/etc/passwd",
                             "leak.png", "up/outside.png", "..\\outside.png", "file:///etc/passwd",
                             "http://example.org/a.png", "C:\\a.png", "", "images", "."}) {
        const auto path = resolve(name);
        ASSERT_FALSE(path) << name;
        EXPECT_EQ(path.error().code, ErrorCode::invalidInput) << name;
    }
    EXPECT_FALSE(resolve(std::string_view("images/a.png\0.jpg", 17)));
}

TEST_F(ResolveInside, MissingFilesAreIo) {
    EXPECT_EQ(resolve("images/b.png").error().code, ErrorCode::io);
}

TEST_F(ResolveInside, OutsideIsAllowedOnRequest) {
    for (const char* name : {"../outside.png", "leak.png", "up/outside.png"}) {
        const auto path = resolve(name, true);
        ASSERT_TRUE(path) << path.error().text();
        EXPECT_EQ(get(*path), "secret");
    }
    EXPECT_TRUE(resolve((folder / "outside.png").string(), true));
    EXPECT_FALSE(resolve("http://example.org/a.png", true));
}

}  // namespace
}  // namespace stx
