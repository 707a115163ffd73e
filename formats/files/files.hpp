#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lib/base/job.hpp"

namespace stx {

using Bytes = std::vector<std::byte>;
using ByteSpan = std::span<const std::byte>;

/// A whole file. "-" reads stdin. Errors (io): missing, a folder, not a regular file (FIFOs and
/// devices are refused), unreadable; (invalidInput) larger than the memory limit.
[[nodiscard]] Result<Bytes> readFile(const std::filesystem::path& path, const Limits& limits);
/// The error (io) of a FIFO or a device where a file is expected.
[[nodiscard]] tl::unexpected<Error> notAFile(const std::filesystem::path& path);

class OutputFiles;

/// A file that is written whole or not at all: bytes go to a temporary name beside the target,
/// commit() flushes and renames. Destroyed without commit(): nothing stays. "-" is stdout; of that,
/// of /dev/stdout and the like (descriptorNamed()), and of devices what is there goes on.
class OutputFile {
  public:
    struct Options {
        bool noClobber = false;           ///< error when the target exists
        OutputFiles* together = nullptr;  ///< commit() waits for that of these
    };
    [[nodiscard]] static Result<OutputFile> create(const std::filesystem::path& target,
                                                   Options options);
    [[nodiscard]] static Result<OutputFile> create(const std::filesystem::path& target) {
        return create(target, Options());
    }
    OutputFile(OutputFile&&) noexcept;
    OutputFile& operator=(OutputFile&&) noexcept;
    ~OutputFile();

    [[nodiscard]] Result<void> write(ByteSpan bytes);
    [[nodiscard]] Result<void> write(std::string_view text);
    /// Where the bytes are until commit(), for libraries that write by name. Error (io): those of a
    /// stream are gathered in folderOfTemporaries(), and no file can be made there.
    [[nodiscard]] Result<std::filesystem::path> temporaryPath() const;
    [[nodiscard]] Result<void> commit();

  private:
    friend class OutputFolder;
    struct Impl;
    explicit OutputFile(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// Files and folders that appear when all of them are whole, as the frames of a film: each is one
/// of OutputFile::Options::together. Destroyed without commit(): none does. They are renamed one
/// after the other: who is killed then leaves some of them, each whole.
class OutputFiles {
  public:
    OutputFiles();
    OutputFiles(OutputFiles&&) noexcept;
    OutputFiles& operator=(OutputFiles&&) noexcept;
    ~OutputFiles();
    [[nodiscard]] Result<void> commit();

  private:
    friend class OutputFile;
    friend class OutputFolder;
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Writes one file whole or not at all.
[[nodiscard]] Result<void> writeFile(const std::filesystem::path& target, ByteSpan bytes,
                                     OutputFile::Options options = {});

/// A folder of files that appears whole or not at all: files are written into a temporary folder
/// beside the target; commit() swaps it in. An existing target folder is replaced only when each of
/// its files is one that this output writes too, but for the digits in its name (`view_17.png`), or
/// one of `ownNames`; else commit() is an error (io) that names the file, and nothing changes.
class OutputFolder {
  public:
    /// `ownNames`: what outputs of this kind may hold, relative to the folder ("atlas.json").
    [[nodiscard]] static Result<OutputFolder> create(const std::filesystem::path& target,
                                                     OutputFile::Options options,
                                                     std::vector<std::string> ownNames = {});
    OutputFolder(OutputFolder&&) noexcept;
    OutputFolder& operator=(OutputFolder&&) noexcept;
    ~OutputFolder();
    /// Where to put the files until commit().
    [[nodiscard]] const std::filesystem::path& temporaryPath() const;
    [[nodiscard]] Result<void> commit();
    /// Commits this folder and a file that names what is in it. Two names cannot change in one
    /// step, so the old file goes first: whenever this ends, no file names another run's folder.
    [[nodiscard]] Result<void> commitWith(OutputFile& file);

  private:
    struct Impl;
    explicit OutputFolder(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

/// The file that a name leads to, there or not: outputs are written through links, which stay.
/// Error (io): links in a circle.
[[nodiscard]] Result<std::filesystem::path> throughLinks(const std::filesystem::path& path);

/// The folder that a file lies in; "." for a bare name.
[[nodiscard]] std::filesystem::path folderOf(const std::filesystem::path& path);

/// The folder for files that are needed while an output is made: the one that the output is written
/// in, through links; of a stream or "-" folderOfTemporaries().
[[nodiscard]] std::filesystem::path folderBeside(const std::filesystem::path& output);

/// The file that `name`, found inside a bundle, set or model in `folder`, stands for. Errors
/// (invalidInput) when it is absolute, has a URL scheme, leaves the folder by `..` or a link, or is
/// not a regular file, unless limits.allowOutside; (io) when it does not exist, or the folder is
/// that of standard input (/dev).
[[nodiscard]] Result<std::filesystem::path> resolveInside(const std::filesystem::path& folder,
                                                          std::string_view name,
                                                          const Limits& limits);

}  // namespace stx
