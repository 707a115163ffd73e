#include "formats/files/file_spool.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <map>
#include <mutex>
#include <new>
#include <stop_token>
#include <string>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "formats/files/temporaries.hpp"

namespace stx {
namespace {

/// How often memory is looked at. Going over pixels brings in some megabytes meanwhile.
constexpr std::chrono::milliseconds kLook{2};

/// What is written at a time, bytes. The system takes room for as much in one piece, which takes
/// long where memory is in small pieces or comes from a host: 1 GiB in 4 MiB took 3.8 s, in 64 KiB
/// 0.3.
constexpr std::size_t kPiece = 64u << 10;

std::size_t pageSize() {
    static const auto size = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    return size;
}

std::size_t inPages(std::size_t bytes) {
    return (bytes + pageSize() - 1) / pageSize() * pageSize();
}

/// Memory of this process that files are mapped into, bytes; 0 where the system does not tell.
std::uint64_t mappedBytes(int statm) {
    std::array<char, 128> text{};
    if (::pread(statm, text.data(), text.size() - 1, 0) <= 0) return 0;
    char* at = text.data();
    std::strtoull(at, &at, 10);  // all of the address space
    std::strtoull(at, &at, 10);  // what is in memory
    return std::strtoull(at, &at, 10) * pageSize();
}

}  // namespace

struct FileSpool::File {
    std::filesystem::path folder;
    Descriptor file, statm;
    std::uint64_t budget = 0;
    std::uint64_t others = 0;  ///< libraries are mapped, too

    std::mutex mutex;  ///< of what follows
    std::uint64_t size = 0;
    struct Room {
        std::size_t bytes;
        off_t offset;
    };
    std::map<void*, Room> mapped;
    /// Room that was given back, by its size. What is kept of views is as large of each.
    std::multimap<std::size_t, off_t> unused;
    std::condition_variable_any stopped;
    std::jthread keeper;  ///< gives memory back

    /// Room for so many bytes, with those of `data` in it if that is not null.
    void* map(std::size_t length, const void* data) {
        const std::size_t bytes = inPages(length);
        const off_t offset = offsetFor(bytes);
        if (data) write(static_cast<const std::byte*>(data), length, offset);
        const std::scoped_lock lock(mutex);
        settle();
        void* room = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), offset);
        if (room == MAP_FAILED) throw std::bad_alloc();
        mapped.emplace(room, Room{bytes, offset});
        return room;
    }
    /// Room in the file.
    off_t offsetFor(std::size_t bytes) {
        const std::scoped_lock lock(mutex);
        if (const auto found = unused.find(bytes); found != unused.end()) {
            const off_t offset = found->second;
            unused.erase(found);
            return offset;
        }
        const auto offset = static_cast<off_t>(size);
        // A file with holes would end the process where the disk is full.
        if (const int error = ::posix_fallocate(file.get(), offset, static_cast<off_t>(bytes));
            error != 0)
            throw std::system_error(error, std::generic_category(), noRoom());
        size += bytes;
        return offset;
    }
    void write(const std::byte* data, std::size_t bytes, off_t offset) const {
        while (bytes > 0) {
            const ssize_t n = ::pwrite(file.get(), data, std::min(bytes, kPiece), offset);
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0)
                throw std::system_error(n < 0 ? errno : ENOSPC, std::generic_category(), noRoom());
            data += n;
            bytes -= static_cast<std::size_t>(n);
            offset += n;
        }
    }
    [[nodiscard]] std::string noRoom() const {
        return fmt::format("no room for pixels in '{}'", folder.string());
    }
    void unmap(void* at) {
        const std::scoped_lock lock(mutex);
        const auto found = mapped.find(at);
        if (found == mapped.end()) return;
        ::munmap(at, found->second.bytes);
        try {
            unused.emplace(found->second.bytes, found->second.offset);
        } catch (const std::bad_alloc&) {
            // The file is larger then than it need be.
        }
        mapped.erase(found);
    }
    /// Under the lock.
    void settle() {
        if (mappedBytes(statm.get()) < others + budget) return;
        for (const auto& [at, room] : mapped) ::madvise(at, room.bytes, MADV_DONTNEED);
    }
    void keep(const std::stop_token& stop) {
        std::unique_lock lock(mutex);
        while (!stopped.wait_for(lock, stop, kLook, [&] { return stop.stop_requested(); }))
            settle();
    }
};

Result<std::unique_ptr<FileSpool>> FileSpool::create(const std::filesystem::path& folder,
                                                     std::uint64_t budget, std::uint64_t room) {
    auto made = createTemporaryFile(folder);
    if (!made)
        return fail(ErrorCode::io, "cannot make a file in '{}': {}", folder.string(),
                    std::generic_category().message(made.error()));
    std::error_code ignored;
    std::filesystem::remove(made->path, ignored);
    auto file = std::make_unique<File>();
    file->folder = folder;
    file->file = std::move(made->fd);
    // Quotas and limits of the process tell only so.
    if (room > 0) {
        const int error = ::posix_fallocate(file->file.get(), 0, static_cast<off_t>(room));
        if (error != 0)
            return fail(ErrorCode::io, "{}: {}", file->noRoom(),
                        std::generic_category().message(error));
    }
    file->statm = Descriptor(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
    file->budget = budget;
    file->others = mappedBytes(file->statm.get());
    return std::unique_ptr<FileSpool>(new FileSpool(std::move(file)));
}

bool FileSpool::costsLittle(const std::filesystem::path& folder) noexcept {
    struct statfs disk {};
    if (::statfs(folder.c_str(), &disk) != 0) return false;
    switch (static_cast<std::uint32_t>(disk.f_type)) {
        case EXT4_SUPER_MAGIC:
        case XFS_SUPER_MAGIC:
        case BTRFS_SUPER_MAGIC:
        case F2FS_SUPER_MAGIC:
        case OVERLAYFS_SUPER_MAGIC:
            return true;
        default:
            return false;
    }
}

FileSpool::FileSpool(std::unique_ptr<File> file) : file_(std::move(file)) {
    file_->keeper = std::jthread([f = file_.get()](const std::stop_token& stop) { f->keep(stop); });
}

FileSpool::~FileSpool() = default;

void* FileSpool::take(std::size_t bytes) {
    return file_->map(bytes, nullptr);
}

void* FileSpool::keep(const void* data, std::size_t bytes) {
    return file_->map(bytes, data);
}

void FileSpool::settle() noexcept {
    const std::scoped_lock lock(file_->mutex);
    file_->settle();
}

void FileSpool::give(void* room, std::size_t /*bytes*/) noexcept {
    file_->unmap(room);
}

}  // namespace stx
