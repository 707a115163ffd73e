#include "formats/files/stream_names.hpp"

#include <unistd.h>

#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "formats/files/files.hpp"
#include "lib/base/whole_number.hpp"

namespace stx {

namespace fs = std::filesystem;

namespace {

std::optional<int> descriptorOfName(std::string_view name) {
    static constexpr std::pair<std::string_view, int> kNames[] = {{"/dev/stdin", STDIN_FILENO},
                                                                  {"/dev/stdout", STDOUT_FILENO},
                                                                  {"/dev/stderr", STDERR_FILENO}};
    for (const auto& [known, number] : kNames)
        if (name == known) return number;
    for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"})
        if (name.starts_with(folder)) return wholeNumber<int>(name.substr(folder.size()));
    return std::nullopt;
}

}  // namespace

std::optional<int> descriptorNamed(const fs::path& path) {
    constexpr int kMostLinks = 40;  // as the system
    fs::path step = path;
    for (int links = 0; links <= kMostLinks; ++links) {
        // Before the link is followed: that of a descriptor leads to the file behind it.
        if (const auto number = descriptorOfName(step.native())) return number;
        std::error_code ec;
        if (!fs::is_symlink(fs::symlink_status(step, ec))) return std::nullopt;
        const fs::path next = fs::read_symlink(step, ec);
        if (ec) return std::nullopt;
        step = folderOf(step) / next;
    }
    return std::nullopt;
}

bool isStream(const fs::path& path) {
    if (descriptorOfName(path.native())) return true;
    // Most outputs are not there yet, perhaps far away: one question is enough then.
    std::error_code ec;
    auto status = fs::symlink_status(path, ec);
    if (!fs::exists(status)) return false;
    if (fs::is_symlink(status)) {
        if (descriptorNamed(path)) return true;
        status = fs::status(path, ec);
    }
    return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

}  // namespace stx
