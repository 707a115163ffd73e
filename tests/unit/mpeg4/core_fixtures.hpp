#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "formats/mpeg4/container/isobmff.hpp"
#include "tests/shared_data.hpp"

/// The .mp4 files of a folder, by name.
inline std::vector<std::filesystem::path> mp4FilesIn(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == ".mp4") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

inline stx::ByteSource openSource(const std::filesystem::path& path) {
    auto source = stx::ByteSource::open(path);
    EXPECT_TRUE(source) << path;
    return source ? *source : stx::ByteSource();
}

/// "c0 05 a6"
inline std::string hex(stx::ByteSpan bytes) {
    std::string text;
    for (const std::byte b : bytes)
        text += fmt::format("{}{:02x}", text.empty() ? "" : " ", std::to_integer<int>(b));
    return text;
}

inline stx::Bytes unhex(std::string_view text) {
    stx::Bytes bytes;
    for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
        while (i < text.size() && (text[i] == ' ' || text[i] == '\n')) ++i;
        if (i + 1 < text.size())
            bytes.push_back(
                static_cast<std::byte>(std::stoi(std::string(text.substr(i, 2)), nullptr, 16)));
    }
    return bytes;
}
