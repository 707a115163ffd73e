#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "lib/base/result.hpp"

namespace stx {

/// Size and time of a file when it was opened: what is read later must be of the same bytes as its
/// headers were.
struct FileStamp {
    std::int64_t size = 0, seconds = 0, nanoseconds = 0;

    [[nodiscard]] static FileStamp of(const struct stat& status) {
        return {status.st_size, status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
    }
    /// Whether an open file is as it was.
    [[nodiscard]] bool holds(int file) const {
        struct stat status {};
        return ::fstat(file, &status) == 0 && of(status) == *this;
    }
    bool operator==(const FileStamp&) const = default;
};

/// The error of one that is not as it was.
[[nodiscard]] inline tl::unexpected<Error> changedError(std::string_view name) {
    return fail(ErrorCode::invalidInput,
                "'{}' was changed while it was read: its size or its time is another; start again "
                "when it is finished",
                name);
}

/// Of the file that has a name now; empty where there is none.
[[nodiscard]] inline std::optional<FileStamp> stampOf(const std::filesystem::path& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) return {};
    return FileStamp::of(status);
}

}  // namespace stx
