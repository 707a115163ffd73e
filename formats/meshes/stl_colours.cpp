#include "formats/meshes/stl_colours.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "formats/meshes/vertex_colours.hpp"
#include "lib/model/texture.hpp"

namespace stx {
namespace {

constexpr std::size_t kHeader = 80, kFacets = 84, kFacet = 50, kAttribute = 48;
constexpr std::uint16_t kFlag = 0x8000, kAllSet = 0xffff;

/// The object's colour in the header of Magics.
std::optional<glm::vec4> objectColour(ByteSpan bytes) {
    constexpr std::string_view kKey = "COLOR=";
    const std::string_view header(reinterpret_cast<const char*>(bytes.data()), kHeader);
    const auto at = header.find(kKey);
    if (at == std::string_view::npos || at + kKey.size() + 4 > kHeader) return std::nullopt;
    glm::vec4 colour;
    for (int k = 0; k < 4; ++k)
        colour[k] = static_cast<float>(bytes[at + kKey.size() + k]) / 255.0f;
    return colour;
}

}  // namespace

std::optional<std::uint32_t> facetsOfBinaryStl(ByteSpan bytes) {
    std::uint32_t facets = 0;
    if (bytes.size() >= kFacets) std::memcpy(&facets, bytes.data() + kHeader, sizeof(facets));
    // Some programs write more behind them. In a text these four letters are a count that no file
    // is long enough for.
    const bool whole = bytes.size() >= kFacets + std::uint64_t{facets} * kFacet;
    if (!whole || (facets == 0 && bytes.size() > kFacets)) return std::nullopt;
    return facets;
}

std::uint64_t bytesBehindBinaryStl(ByteSpan bytes) {
    const auto facets = facetsOfBinaryStl(bytes);
    return facets ? bytes.size() - kFacets - std::uint64_t{*facets} * kFacet : 0;
}

std::optional<Bytes> lowerCaseStl(ByteSpan bytes) {
    constexpr std::size_t kHead = 4096;
    const std::string_view head(reinterpret_cast<const char*>(bytes.data()),
                                std::min(bytes.size(), kHead));
    if (facetsOfBinaryStl(bytes) || head.find("FACET") == std::string_view::npos)
        return std::nullopt;
    Bytes lower(bytes.begin(), bytes.end());
    for (auto& b : lower) {
        const auto c = std::to_integer<char>(b);
        if (c >= 'A' && c <= 'Z') b = static_cast<std::byte>(c - 'A' + 'a');
    }
    return lower;
}

void readStlColours(ByteSpan bytes, std::vector<glm::vec4>& colours) {
    const auto facets = facetsOfBinaryStl(bytes);
    if (!facets) return;
    const auto object = objectColour(bytes);
    if (object) colours.assign(std::size_t{*facets} * 3, *object);
    if (colours.size() != std::size_t{*facets} * 3) return;
    const auto attributeOf = [&](std::size_t facet) {
        std::uint16_t bits = 0;
        std::memcpy(&bits, bytes.data() + kFacets + facet * kFacet + kAttribute, sizeof(bits));
        return bits;
    };
    bool anyClear = false, anyBits = false;
    for (std::size_t i = 0; i < *facets; ++i) {
        anyClear = anyClear || !(attributeOf(i) & kFlag);
        anyBits = anyBits || attributeOf(i) != 0;
    }
    if (!anyBits) return;
    if (!object)
        colours.assign(colours.size(), glm::vec4(glm::vec3(srgbFromLinear(kPlainGrey)), 1));
    const bool clearIsOwn = object && anyClear;
    for (std::size_t i = 0; i < *facets; ++i) {
        const std::uint16_t bits = attributeOf(i);
        const bool blank = object && !anyClear && (bits == kFlag || bits == kAllSet);
        if (blank || ((bits & kFlag) == 0) != clearIsOwn) continue;
        const glm::vec4 lowestFirst(bits & 31, bits >> 5 & 31, bits >> 10 & 31, 31);
        const auto colour =
            (object ? lowestFirst : glm::vec4(lowestFirst.b, lowestFirst.g, lowestFirst.r, 31)) /
            31.0f;
        for (int k = 0; k < 3; ++k) colours[i * 3 + k] = colour;
    }
}

}  // namespace stx
