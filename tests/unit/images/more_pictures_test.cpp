// Which files hold more than one picture; damaged ones hold as many as can be seen.
#include "formats/images/more_pictures.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "tests/unit/images/png_builder.hpp"

namespace stx {
namespace {

using namespace std::string_literals;

Bytes bytesOf(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text));
    return {bytes.begin(), bytes.end()};
}

std::string little(std::uint32_t value, int bytes) {
    std::string out;
    for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> 8 * i & 255);
    return out;
}

/// Directories of one entry, NewSubfileType; a value below 0: of another tag.
std::string tiffOf(std::initializer_list<int> kinds) {
    std::string file = "II*\0"s + little(8, 4);
    std::size_t left = kinds.size();
    for (const int kind : kinds) {
        file += little(1, 2) + little(kind < 0 ? 256 : 254, 2) + little(4, 2) + little(1, 4) +
                little(kind < 0 ? 7 : static_cast<std::uint32_t>(kind), 4);
        const auto next = static_cast<std::uint32_t>(file.size()) + 4;
        file += little(--left > 0 ? next : 0, 4);
    }
    return file;
}

std::string gifOf(int frames) {
    // A global table of two colours, and a comment.
    std::string file = "GIF89a\1\0\1\0\x80\0\0"s + "\0\0\0\xff\xff\xff"s + "\x21\xfe\3abc\0"s;
    for (int i = 0; i < frames; ++i) file += "\x2c\0\0\0\0\1\0\1\0\0"s + "\2\2\x4c\1\0"s;
    return file + ";";
}

std::string webpOf(int frames) {
    std::string file = "VP8X"s + little(10, 4) + std::string(10, '\0');
    for (int i = 0; i < frames; ++i) file += "ANMF"s + little(3, 4) + "abc\0"s;
    return "RIFF"s + little(static_cast<std::uint32_t>(file.size() + 4), 4) + "WEBP" + file;
}

std::string pngOf(int frames) {
    std::string control =
        png::bigEndian(static_cast<std::uint64_t>(frames), 4) + png::bigEndian(0, 4);
    return "\x89PNG\r\n\x1a\n"s + png::chunk("IHDR", std::string(13, '\1')) +
           (frames > 0 ? png::chunk("acTL", control) : ""s) + png::chunk("IDAT", "");
}

TEST(MorePictures, AreThoseOfFullSize) {
    const std::pair<std::string, bool> cases[] = {
        {tiffOf({0}), false},       {tiffOf({0, 0}), true},
        {tiffOf({-1, -1}), true},   {tiffOf({0, 1, 4}), false},
        {tiffOf({0, 1, 2}), true},  {gifOf(1), false},
        {gifOf(2), true},           {webpOf(0), false},
        {webpOf(1), false},         {webpOf(2), true},
        {pngOf(0), false},          {pngOf(1), false},
        {pngOf(3), true},           {"", false},
        {"\xff\xd8\xff\xe0", false}};
    for (const auto& [file, more] : cases) {
        const Bytes bytes = bytesOf(file);
        EXPECT_EQ(holdsMorePictures(bytes), more) << file.substr(0, 4) << file.size();
        for (std::size_t n = 0; n < bytes.size(); ++n)
            (void)holdsMorePictures(ByteSpan(bytes).first(n));  // in bounds
    }
    // Directories in a circle.
    std::string circle = tiffOf({0, 1});
    circle.replace(circle.size() - 4, 4, little(26, 4));
    EXPECT_FALSE(holdsMorePictures(bytesOf(circle)));
}

TEST(MorePictures, AreNotedOnce) {
    Job job;
    for (int i = 0; i < 2; ++i) noteMorePictures(bytesOf(gifOf(2)), "a.gif", job);
    noteMorePictures(bytesOf(gifOf(1)), "b.gif", job);
    EXPECT_EQ(job.takeNotes(),
              std::vector<std::string>{"'a.gif' holds more than one picture; the first is taken"});
}

}  // namespace
}  // namespace stx
