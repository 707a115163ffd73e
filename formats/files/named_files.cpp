#include "formats/files/named_files.hpp"

#include <sys/stat.h>

#include <atomic>
#include <mutex>
#include <set>
#include <utility>

namespace stx {
namespace {

/// A file by device and number: whatever name it is reached by.
using FileNumber = std::pair<dev_t, ino_t>;

struct NamedFiles {
    std::atomic<bool> guarded = false;
    std::mutex mutex;
    std::set<FileNumber> numbers;
};
NamedFiles& namedFiles() {
    static NamedFiles all;
    return all;
}

}  // namespace

void guardNamedFiles() {
    namedFiles().guarded = true;
}

void rememberNamedFile(const std::filesystem::path& file) {
    NamedFiles& all = namedFiles();
    struct stat status {};
    if (!all.guarded || ::stat(file.c_str(), &status) != 0) return;
    const std::lock_guard lock(all.mutex);
    all.numbers.emplace(status.st_dev, status.st_ino);
}

Result<void> checkIsNotNamed(const std::filesystem::path& target) {
    NamedFiles& all = namedFiles();
    struct stat status {};
    if (!all.guarded || ::stat(target.c_str(), &status) != 0) return {};
    const std::lock_guard lock(all.mutex);
    if (!all.numbers.contains({status.st_dev, status.st_ino})) return {};
    return fail(ErrorCode::usage,
                "'{}' is a {} that the input names, which would be lost; give the output another "
                "name",
                target.string(), S_ISDIR(status.st_mode) ? "folder" : "file");
}

}  // namespace stx
