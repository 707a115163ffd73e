#include "lib/sheet/canvas.hpp"

#include <algorithm>
#include <vector>

#include "lib/sheet/font.hpp"

namespace stx {
namespace {

/// The code points of UTF-8; U+FFFD for what is none.
std::vector<char32_t> codePointsOf(std::string_view text) {
    std::vector<char32_t> out;
    for (std::size_t at = 0; at < text.size();) {
        const auto first = static_cast<unsigned char>(text[at++]);
        const int more = first < 0x80             ? 0
                         : (first & 0xe0) == 0xc0 ? 1
                         : (first & 0xf0) == 0xe0 ? 2
                         : (first & 0xf8) == 0xf0 ? 3
                                                  : -1;
        if (more < 0) {
            out.push_back(kNoGlyph);
            continue;
        }
        char32_t code = more == 0 ? first : first & (0x3f >> more);
        int read = 0;
        for (; read < more && at < text.size(); ++read, ++at) {
            const auto next = static_cast<unsigned char>(text[at]);
            if ((next & 0xc0) != 0x80) break;
            code = code << 6 | (next & 0x3f);
        }
        out.push_back(read == more ? code : kNoGlyph);
    }
    return out;
}

}  // namespace

Canvas::Canvas(int width, int height, glm::u8vec3 paper) : image_(width, height, paper) {}

void Canvas::fill(glm::ivec2 corner, glm::ivec2 size, glm::u8vec3 colour) {
    const glm::ivec2 from = glm::max(corner, glm::ivec2(0));
    const glm::ivec2 to = glm::min(corner + size, image_.size());
    for (int y = from.y; y < to.y; ++y) {
        for (int x = from.x; x < to.x; ++x) image_.at(x, y) = colour;
    }
}

void Canvas::frame(glm::ivec2 corner, glm::ivec2 size, glm::u8vec3 colour) {
    fill(corner, {size.x, 1}, colour);
    fill({corner.x, corner.y + size.y - 1}, {size.x, 1}, colour);
    fill(corner, {1, size.y}, colour);
    fill({corner.x + size.x - 1, corner.y}, {1, size.y}, colour);
}

void Canvas::picture(glm::ivec2 corner, const Rgb8Image& picture) {
    for (int y = 0; y < picture.height(); ++y) {
        for (int x = 0; x < picture.width(); ++x) {
            if (image_.contains(corner.x + x, corner.y + y))
                image_.at(corner.x + x, corner.y + y) = picture.at(x, y);
        }
    }
}

void Canvas::text(glm::ivec2 corner, std::string_view line, glm::u8vec3 colour, int room) {
    auto codes = codePointsOf(line);
    const auto most = static_cast<std::size_t>(std::max(room, 0) / kGlyphWidth);
    if (codes.size() > most) {
        codes.resize(most);
        for (std::size_t i = most - std::min<std::size_t>(most, 2); i < most; ++i) codes[i] = '.';
    }
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const Glyph& glyph = glyphOf(codes[i]);
        for (std::size_t y = 0; y < glyph.size(); ++y) {
            for (int x = 0; x < kGlyphWidth; ++x) {
                const glm::ivec2 at = corner + glm::ivec2(static_cast<int>(i) * kGlyphWidth + x,
                                                          static_cast<int>(y) + 1);
                if ((glyph[y] >> (7 - x) & 1) != 0 && image_.contains(at.x, at.y))
                    image_.at(at.x, at.y) = colour;
            }
        }
    }
}

}  // namespace stx
