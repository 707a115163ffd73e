#include "formats/files/named_files.hpp"

#include <sys/stat.h>

#include <atomic>
#include <mutex>
#include <optional>
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
    std::set<FileNumber> inputs;
    std::multiset<FileNumber> ofFilms;
};
NamedFiles& namedFiles() {
    static NamedFiles all;
    return all;
}

std::optional<FileNumber> numberOf(const std::filesystem::path& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return std::nullopt;
    return FileNumber(status.st_dev, status.st_ino);
}

void rememberAmong(const std::filesystem::path& file, std::set<FileNumber> NamedFiles::*among) {
    NamedFiles& all = namedFiles();
    if (!all.guarded) return;
    const auto number = numberOf(file);
    if (!number) return;
    const std::lock_guard lock(all.mutex);
    (all.*among).insert(*number);
}

}  // namespace

void guardNamedFiles() {
    namedFiles().guarded = true;
}

void rememberInput(const std::filesystem::path& file) {
    rememberAmong(file, &NamedFiles::inputs);
}

void rememberNamedFile(const std::filesystem::path& file) {
    rememberAmong(file, &NamedFiles::numbers);
}

FilesOfFilm::FilesOfFilm(const std::vector<std::filesystem::path>& files) {
    NamedFiles& all = namedFiles();
    for (const auto& file : files)
        if (const auto number = numberOf(file)) numbers_.push_back(*number);
    const std::lock_guard lock(all.mutex);
    all.ofFilms.insert(numbers_.begin(), numbers_.end());
}

FilesOfFilm::~FilesOfFilm() {
    NamedFiles& all = namedFiles();
    const std::lock_guard lock(all.mutex);
    for (const FileNumber& number : numbers_)
        if (const auto one = all.ofFilms.find(number); one != all.ofFilms.end())
            all.ofFilms.erase(one);
}

Result<void> checkIsNotNamed(const std::filesystem::path& target) {
    NamedFiles& all = namedFiles();
    const auto number = numberOf(target);
    if (!number) return {};
    const std::lock_guard lock(all.mutex);
    if (all.inputs.contains(*number))
        return fail(ErrorCode::usage,
                    "'{}' is an input, which would be lost; give the output another name",
                    target.string());
    const bool named = all.numbers.contains(*number);
    if (!named && !all.ofFilms.contains(*number)) return {};
    std::error_code ec;
    return fail(ErrorCode::usage,
                "'{}' is a {} {}, which would be lost; give the output another name",
                target.string(), std::filesystem::is_directory(target, ec) ? "folder" : "file",
                named ? "that the input names" : "of a film that is open");
}

}  // namespace stx
