#include "formats/files/stream_names.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <string>

#include "formats/files/files.hpp"
#include "formats/files/temporaries.hpp"
#include "tests/temporary_folder.hpp"

namespace stx {
namespace {

std::string wholeText(const std::filesystem::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

TEST(DescriptorNamed, KnowsTheNamesOfDescriptors) {
    const TemporaryFolder folder;
    EXPECT_EQ(descriptorNamed("/dev/stdout"), STDOUT_FILENO);
    EXPECT_EQ(descriptorNamed("/dev/stderr"), STDERR_FILENO);
    EXPECT_EQ(descriptorNamed("/dev/fd/17"), 17);
    EXPECT_EQ(descriptorNamed("/proc/self/fd/1"), 1);
    std::filesystem::create_symlink("/dev/stdout", folder / "link");
    std::filesystem::create_symlink("link", folder / "again");
    EXPECT_EQ(descriptorNamed(folder / "again"), STDOUT_FILENO);
    std::filesystem::create_symlink("circle", folder / "circle");
    for (const auto& other :
         {folder / "circle", folder / "none", std::filesystem::path("/dev/fd/x"),
          std::filesystem::path("/dev/null"), std::filesystem::path("dev/stdout")})
        EXPECT_EQ(descriptorNamed(other), std::nullopt) << other;
}

TEST(IsStream, IsNeitherOfFilesNorOfFolders) {
    const TemporaryFolder folder;
    std::ofstream(folder / "file") << "x";
    ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
    std::filesystem::create_symlink("pipe", folder / "to_pipe");
    std::filesystem::create_symlink("file", folder / "to_file");
    for (const auto& stream :
         {folder / "pipe", folder / "to_pipe", std::filesystem::path("/dev/null"),
          std::filesystem::path("/dev/stdout")})
        EXPECT_TRUE(isStream(stream)) << stream;
    for (const auto& other : {folder / "file", folder / "to_file", folder / "none", folder.path()})
        EXPECT_FALSE(isStream(other)) << other;
}

/// A log that the output of several programs goes into: nothing in it is lost, and it stays the
/// file that the others write into.
TEST(OutputFile, GoesOnWhereADescriptorIs) {
    const TemporaryFolder folder;
    const auto log = folder / "log";
    const Descriptor open(::open(log.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
    ASSERT_GE(open.get(), 0);
    ASSERT_EQ(::write(open.get(), "before\n", 7), 7);
    const auto name = "/dev/fd/" + std::to_string(open.get());
    for (const std::filesystem::path& target : {std::filesystem::path(name), folder / "link"}) {
        if (target != name) std::filesystem::create_symlink(name, target);
        const auto written =
            writeFile(target, std::as_bytes(std::span(std::string_view("mine\n"))));
        ASSERT_TRUE(written) << written.error().text();
    }
    ASSERT_EQ(::write(open.get(), "after\n", 6), 6);
    EXPECT_EQ(wholeText(log), "before\nmine\nmine\nafter\n");
    EXPECT_FALSE(writeFile("/dev/fd/987654", Bytes(1))) << "it is not open";
}

}  // namespace
}  // namespace stx
