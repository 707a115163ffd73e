#pragma once

#include <filesystem>
#include <string>
#include <system_error>

namespace stx {

/// Why nothing is found at a path: it does not exist, or the system does not let us look.
[[nodiscard]] inline std::string whyNotThere(const std::filesystem::path& path) {
    std::error_code ec;
    const bool there = std::filesystem::exists(std::filesystem::status(path, ec));
    const bool missing =
        !ec || ec == std::errc::no_such_file_or_directory || ec == std::errc::not_a_directory;
    return there || missing ? "the file or folder does not exist" : ec.message();
}

}  // namespace stx
