#include "formats/files/file_spool.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <map>
#include <mutex>
#include <new>
#include <stop_token>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "formats/files/temporaries.hpp"

namespace stx {
namespace {

/// How often memory is looked at. Going over pixels brings in some megabytes meanwhile.
constexpr std::chrono::milliseconds kLook{2};

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

    void* map(std::size_t bytes) {
        const std::scoped_lock lock(mutex);
        settle();
        const off_t offset = offsetFor(bytes);
        void* room = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), offset);
        if (room == MAP_FAILED) throw std::bad_alloc();
        mapped.emplace(room, Room{bytes, offset});
        return room;
    }
    /// Room in the file. Under the lock.
    off_t offsetFor(std::size_t bytes) {
        if (const auto found = unused.find(bytes); found != unused.end()) {
            const off_t offset = found->second;
            unused.erase(found);
            return offset;
        }
        const auto offset = static_cast<off_t>(size);
        // A file with holes would end the process where the disk is full.
        if (const int error = ::posix_fallocate(file.get(), offset, static_cast<off_t>(bytes));
            error != 0)
            throw std::system_error(error, std::generic_category(),
                                    fmt::format("no room for pixels in '{}'", folder.string()));
        size += bytes;
        return offset;
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
                                                     std::uint64_t budget) {
    auto made = createTemporaryFile(folder);
    if (!made)
        return fail(ErrorCode::io, "cannot make a file in '{}': {}", folder.string(),
                    std::generic_category().message(made.error()));
    std::error_code ignored;
    std::filesystem::remove(made->path, ignored);
    auto file = std::make_unique<File>();
    file->folder = folder;
    file->file = std::move(made->fd);
    file->statm = Descriptor(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
    file->budget = budget;
    file->others = mappedBytes(file->statm.get());
    return std::unique_ptr<FileSpool>(new FileSpool(std::move(file)));
}

FileSpool::FileSpool(std::unique_ptr<File> file) : file_(std::move(file)) {
    file_->keeper = std::jthread([f = file_.get()](const std::stop_token& stop) { f->keep(stop); });
}

FileSpool::~FileSpool() = default;

void* FileSpool::take(std::size_t bytes) {
    return file_->map(inPages(bytes));
}

void FileSpool::settle() noexcept {
    const std::scoped_lock lock(file_->mutex);
    file_->settle();
}

void FileSpool::give(void* room, std::size_t /*bytes*/) noexcept {
    file_->unmap(room);
}

}  // namespace stx
