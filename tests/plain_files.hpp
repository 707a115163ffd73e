#pragma once

#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/files/files.hpp"
#include "formats/images/images.hpp"

/// Pictures and JSON files of the shared data, read without the image-set readers, so that a
/// mistake of theirs and one of what is tested cannot cancel out.
namespace plain {

inline stx::DecodedImage decoded(const std::filesystem::path& path) {
    auto bytes = stx::readFile(path, stx::Limits{});
    EXPECT_TRUE(bytes) << bytes.error().text();
    auto image = stx::decodeImage(*bytes, path.filename().string(), stx::Limits{});
    EXPECT_TRUE(image) << image.error().text();
    return *std::move(image);
}

inline stx::Image<glm::u8vec4> picture(const std::filesystem::path& path) {
    return stx::rgba8From(decoded(path));
}

inline nlohmann::json json(const std::filesystem::path& path) {
    auto bytes = stx::readFile(path, stx::Limits{});
    EXPECT_TRUE(bytes) << bytes.error().text();
    const auto* text = reinterpret_cast<const char*>(bytes->data());
    return nlohmann::json::parse(text, text + bytes->size());
}

}  // namespace plain
