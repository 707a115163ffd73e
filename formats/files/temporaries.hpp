#pragma once

#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include <tl/expected.hpp>

namespace stx {

/// An open file that closes itself.
class Descriptor {
  public:
    Descriptor() = default;
    explicit Descriptor(int fd) : fd_(fd) {}
    Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        if (this != &other) {
            close();
            fd_ = std::exchange(other.fd_, -1);
        }
        return *this;
    }
    ~Descriptor() { close(); }

    [[nodiscard]] int get() const { return fd_; }
    /// errno of close(), which is where some file systems tell of a full disk; 0 when all is well.
    int close() {
        const int fd = std::exchange(fd_, -1);
        return fd >= 0 && ::close(fd) != 0 && errno != EINTR ? errno : 0;
    }

  private:
    int fd_ = -1;
};

/// Each unfinished output is a file or folder with a name of this kind, beside its target:
/// `.stx-tmp-<random>-<process>-<number>`. Its owner holds an flock() on it, so a run that can lock
/// one knows that its owner is gone, in whatever container or machine that was.
inline constexpr const char* kTemporaryPrefix = ".stx-tmp-";

struct Temporary {
    std::filesystem::path path;
    Descriptor fd;  ///< open for writing (a folder: for reading), locked
};

/// Where to gather what has no folder of its own: what TMPDIR names, if that is a folder, else
/// /tmp.
[[nodiscard]] std::filesystem::path folderOfTemporaries();

/// Lets temporaries make `folder` again when it is gone by then: runs that end take away the
/// folders that they made and left empty, also where other runs are about to write into these.
void mayBeMadeAgain(const std::filesystem::path& folder);

/// A new, empty, locked file in `folder`; errno when that fails.
[[nodiscard]] tl::expected<Temporary, int> createTemporaryFile(const std::filesystem::path& folder);
/// The same for a folder in a folder.
[[nodiscard]] tl::expected<Temporary, int> createTemporaryFolder(
    const std::filesystem::path& folder);

/// Removes what killed runs left in `folder`. Looks once per folder and process, and never fails.
void removeStaleTemporaries(const std::filesystem::path& folder);
/// The same, looking again each time.
void removeStaleTemporariesNow(const std::filesystem::path& folder);

/// Removes the unfinished outputs of this very process, for the moment before it ends by a signal.
void removeOwnTemporaries();

}  // namespace stx
