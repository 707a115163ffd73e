#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/files.hpp"

/// PNG files of every kind, made without any library: stored deflate blocks, no row filters.
namespace stx::png {

inline std::string bigEndian(std::uint64_t value, int bytes) {
    std::string text;
    for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> (8 * i) & 0xff);
    return text;
}

inline std::uint32_t crc32(std::string_view bytes) {
    std::uint32_t crc = 0xffffffffu;
    for (const char byte : bytes) {
        crc ^= static_cast<unsigned char>(byte);
        for (int k = 0; k < 8; ++k) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

inline std::string chunk(const std::string& kind, const std::string& body) {
    return bigEndian(body.size(), 4) + kind + body + bigEndian(crc32(kind + body), 4);
}

inline std::string zlibStored(const std::string& bytes) {
    std::string out = "\x78\x01";
    for (std::size_t at = 0; at == 0 || at < bytes.size(); at += 65535) {
        const auto block = bytes.substr(at, 65535);
        const auto size = static_cast<unsigned>(block.size());
        out += static_cast<char>(at + 65535 >= bytes.size());
        for (const unsigned value : {size, ~size})
            for (const int shift : {0, 8}) out += static_cast<char>(value >> shift & 0xff);
        out += block;
    }
    std::uint32_t a = 1, b = 0;
    for (const char byte : bytes) {
        a = (a + static_cast<unsigned char>(byte)) % 65521;
        b = (b + a) % 65521;
    }
    return out + bigEndian(b << 16 | a, 4);
}

struct Picture {
    int width = 0, height = 0;
    int colourType = 0;  ///< 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA
    int bits = 8;
    bool interlaced = false;
    std::string palette, transparency;   ///< bodies of PLTE and tRNS; empty = none
    std::string before;                  ///< whole chunks behind IHDR
    std::vector<std::uint16_t> samples;  ///< as stored

    [[nodiscard]] int channels() const {
        return colourType == 2 ? 3 : colourType == 4 ? 2 : colourType == 6 ? 4 : 1;
    }
};

inline std::string header(const Picture& p) {
    const auto byte = [](int value) { return static_cast<char>(value); };
    return "\x89PNG\r\n\x1a\n" +
           chunk("IHDR", bigEndian(p.width, 4) + bigEndian(p.height, 4) + byte(p.bits) +
                             byte(p.colourType) + byte(0) + byte(0) + byte(p.interlaced));
}

inline std::string build(const Picture& p) {
    struct Pass {
        int x, y, dx, dy;
    };
    static constexpr Pass kAdam7[] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                                      {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
    std::vector<Pass> passes = {{0, 0, 1, 1}};
    if (p.interlaced) passes.assign(std::begin(kAdam7), std::end(kAdam7));
    std::string rows;
    for (const auto& pass : passes) {
        for (int y = pass.y; y < p.height && pass.x < p.width; y += pass.dy) {
            rows += '\0';
            std::uint32_t bits = 0;
            int filled = 0;
            for (int x = pass.x; x < p.width; x += pass.dx) {
                for (int c = 0; c < p.channels(); ++c) {
                    bits = bits << p.bits | p.samples[(y * p.width + x) * p.channels() + c];
                    for (filled += p.bits; filled >= 8; filled -= 8)
                        rows += static_cast<char>(bits >> (filled - 8) & 0xff);
                }
            }
            if (filled > 0) rows += static_cast<char>(bits << (8 - filled) & 0xff);
        }
    }
    std::string out = header(p) + p.before;
    if (!p.palette.empty()) out += chunk("PLTE", p.palette);
    if (!p.transparency.empty()) out += chunk("tRNS", p.transparency);
    return out + chunk("IDAT", zlibStored(rows)) + chunk("IEND", "");
}

}  // namespace stx::png
