#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/files/files.hpp"
#include "lib/base/result.hpp"

namespace stx {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float32;  ///< of the value, or of a list's values
    bool isList = false;
    PlyType countType = PlyType::uint8;
};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;
};

enum class PlyCoding { ascii, littleEndian, bigEndian };

struct PlyHeader {
    PlyCoding coding = PlyCoding::ascii;
    std::vector<PlyElement> elements;
    std::vector<std::string> textureFiles;  ///< `comment TextureFile NAME`, in order
    std::size_t dataOffset = 0;             ///< bytes before the first element
};

/// Bytes of a value of this type.
[[nodiscard]] std::size_t plySize(PlyType type);

/// Errors (invalidInput) name the line. Lines may end in LF, CR LF or CR; blanks are free. Counts
/// are held against the size of the file: each element takes its bytes.
[[nodiscard]] Result<PlyHeader> readPlyHeader(ByteSpan file);

/// "a, b" of the properties of an element that `isUsed` does not want, at most 6, and "…" for the
/// rest; empty: all are used.
template <class IsUsed>
[[nodiscard]] std::string unusedProperties(const PlyElement& element, const IsUsed& isUsed) {
    constexpr int kMostNamed = 6;
    std::string names;
    int count = 0;
    for (const auto& p : element.properties) {
        if (isUsed(p)) continue;
        if (count++ < kMostNamed) names += (names.empty() ? "" : ", ") + p.name;
    }
    return count > kMostNamed ? names + ", …" : names;
}

}  // namespace stx
