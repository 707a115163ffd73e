#include "formats/files/temporaries.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <atomic>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <system_error>

#include <fmt/format.h>

namespace stx {

namespace fs = std::filesystem;

namespace {

/// What the names of this process's temporaries begin with. Machines that share a file system, and
/// containers, have processes of the same number, hence the mark.
std::string ownPrefix() {
    static const unsigned mark = std::random_device()();
    return fmt::format("{}{:08x}-{}-", kTemporaryPrefix, mark, ::getpid());
}

fs::path nextName(const fs::path& folder) {
    static std::atomic<unsigned> counter = 0;
    return folder / fmt::format("{}{}", ownPrefix(), counter++);
}

/// True when `fd` is locked now and still is what `path` names: another run may have taken it for
/// a stale one in the moment before the lock.
bool lockAndKeep(int fd, const fs::path& path) {
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) return false;
    struct stat opened = {}, named = {};
    return ::fstat(fd, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
           opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

constexpr int kAttempts = 1000;

/// Folders where this process has made temporaries, and those that it may make again.
struct Folders {
    std::mutex mutex;
    std::set<fs::path> paths, again;
};
Folders& foldersUsed() {
    static auto* const folders = new Folders;  // outlives every thread
    return *folders;
}

void remember(const fs::path& folder) {
    const std::lock_guard lock(foldersUsed().mutex);
    foldersUsed().paths.insert(folder);
}

/// Whether to try again after that error: the folder was gone, may be made again, and is there, or
/// was taken away once more.
bool isThereAgain(const fs::path& folder, int error) {
    if (error != ENOENT) return false;
    {
        const std::lock_guard lock(foldersUsed().mutex);
        if (!foldersUsed().again.contains(folder.lexically_normal())) return false;
    }
    std::error_code ec;
    fs::create_directories(folder, ec);
    return !ec || ec == std::errc::no_such_file_or_directory;
}

}  // namespace

fs::path folderOfTemporaries() {
    std::error_code ec;
    fs::path folder = fs::temp_directory_path(ec);
    return ec ? fs::path("/tmp") : folder;
}

void mayBeMadeAgain(const fs::path& folder) {
    const std::lock_guard lock(foldersUsed().mutex);
    foldersUsed().again.insert(folder.lexically_normal());
}

tl::expected<Temporary, int> createTemporaryFile(const fs::path& folder) {
    remember(folder);
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        const fs::path path = nextName(folder);
        Descriptor fd(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
        if (fd.get() < 0) {
            const int error = errno;
            if (error == EEXIST || isThereAgain(folder, error)) continue;
            return tl::unexpected(error);
        }
        if (lockAndKeep(fd.get(), path)) return Temporary{path, std::move(fd)};
    }
    return tl::unexpected(EEXIST);
}

tl::expected<Temporary, int> createTemporaryFolder(const fs::path& folder) {
    remember(folder);
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        const fs::path path = nextName(folder);
        if (::mkdir(path.c_str(), 0777) != 0) {
            const int error = errno;
            if (error == EEXIST || isThereAgain(folder, error)) continue;
            return tl::unexpected(error);
        }
        Descriptor fd(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
        if (fd.get() >= 0 && lockAndKeep(fd.get(), path)) return Temporary{path, std::move(fd)};
    }
    return tl::unexpected(EEXIST);
}

void removeStaleTemporaries(const fs::path& folder) {
    static std::mutex mutex;
    static std::set<fs::path> known;
    std::error_code ec;
    const fs::path real = fs::weakly_canonical(folder, ec);
    {
        const std::lock_guard lock(mutex);
        if (ec || !known.insert(real).second) return;
    }
    removeStaleTemporariesNow(folder);
}

void removeStaleTemporariesNow(const fs::path& folder) {
    std::error_code ec;
    for (auto it = fs::directory_iterator(folder, ec); !ec && it != fs::directory_iterator();
         it.increment(ec)) {
        if (!it->path().filename().string().starts_with(kTemporaryPrefix)) continue;
        // O_NOFOLLOW and O_NONBLOCK: a link or a FIFO of that name is not ours.
        const Descriptor fd(
            ::open(it->path().c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
        if (fd.get() < 0 || ::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) continue;
        struct stat info = {};
        if (::fstat(fd.get(), &info) != 0) continue;
        std::error_code ignored;
        if (S_ISDIR(info.st_mode)) fs::remove_all(it->path(), ignored);
        if (S_ISREG(info.st_mode)) fs::remove(it->path(), ignored);
    }
}

void removeOwnTemporaries() {
    const std::string prefix = ownPrefix();
    // Never waits: the thread that holds the lock may be the one that hangs.
    const std::unique_lock lock(foldersUsed().mutex, std::try_to_lock);
    if (!lock) return;
    for (const auto& folder : foldersUsed().paths) {
        std::error_code ec;
        for (auto it = fs::directory_iterator(folder, ec); !ec && it != fs::directory_iterator();
             it.increment(ec)) {
            std::error_code ignored;
            if (it->path().filename().string().starts_with(prefix))
                fs::remove_all(it->path(), ignored);
        }
    }
}

}  // namespace stx
