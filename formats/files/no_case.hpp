#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>

namespace stx {

/// A small letter for each ASCII capital.
[[nodiscard]] inline char lowerAscii(char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// Equal but for the case of ASCII letters.
[[nodiscard]] inline bool equalNoCase(std::string_view a, std::string_view b) {
    return std::ranges::equal(a, b, {}, lowerAscii, lowerAscii);
}

/// The ending of a file's name in small letters, as ".exr"; empty where it has none.
[[nodiscard]] inline std::string lowerExtension(const std::filesystem::path& path) {
    std::string ending = path.extension().string();
    std::ranges::transform(ending, ending.begin(), lowerAscii);
    return ending;
}

}  // namespace stx
