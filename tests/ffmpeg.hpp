#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "formats/images/images.hpp"
#include "formats/video/video_process.hpp"

/// Films for tests, made and read by ffmpeg, which is not ours.
namespace films {

inline bool haveFfmpeg() {
    static const bool here = std::system("ffmpeg -version > /dev/null 2>&1") == 0;
    return here;
}

/// `ffmpeg ARGUMENTS` in a folder.
inline void ffmpeg(const std::filesystem::path& folder, const std::string& arguments) {
    const std::string command = "cd '" + folder.string() + "' && ffmpeg -nostdin -v error -y " +
                                arguments + " > ffmpeg.log 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

/// A colour that tells where and when it is, with an edge that moves.
inline stx::Rgba8Image picture(int width, int height, int frame) {
    stx::Rgba8Image out(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool box = x / 4 == frame % (width / 4);
            out.at(x, y) = box ? glm::u8vec4(230, 60, 20 + frame * 5, 255)
                               : glm::u8vec4(30 + 3 * x, 50 + 2 * y, 120 + frame, 255);
        }
    return out;
}

/// A depth code: steep and shallow parts, some pixels without any.
inline std::uint16_t code(int x, int y, int frame, int largest) {
    if ((x + y * 7 + frame) % 11 == 0) return 0;
    return static_cast<std::uint16_t>(1 + (x * 977 + y * 131 + frame * 53) % largest);
}

inline void writePictures(const std::filesystem::path& folder, int count, int width, int height) {
    for (int k = 0; k < count; ++k) {
        const auto image = picture(width, height, k);
        const auto png = stx::encodePng(width, height, 4, 8, image.data(), true);
        ASSERT_TRUE(stx::writeFile(folder / ("c" + std::to_string(k) + ".png"), *png));
    }
}

/// Codes of up to `largest` as raw little-endian 16-bit frames, or bytes where they fit.
inline void writeCodes(const std::filesystem::path& file, int count, int width, int height,
                       int largest) {
    stx::Bytes bytes;
    for (int k = 0; k < count; ++k)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const auto value = code(x, y, k, largest);
                bytes.push_back(static_cast<std::byte>(value & 255));
                if (largest > 255) bytes.push_back(static_cast<std::byte>(value >> 8));
            }
    ASSERT_TRUE(stx::writeFile(file, bytes));
}

}  // namespace films

/// Skips the test with a clear line where films cannot be made or read.
#define REQUIRE_VIDEO()                                                       \
    if (!films::haveFfmpeg())                                                 \
        GTEST_SKIP() << "needs the program ffmpeg (Debian's package ffmpeg)"; \
    if (const auto video = stx::VideoProcess::start(stx::Limits()); !video)   \
    GTEST_SKIP() << video.error().message
