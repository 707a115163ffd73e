#include "formats/meshes/ply_header.hpp"

#include <optional>
#include <string_view>

#include "formats/files/text_encoding.hpp"
#include "lib/base/whole_number.hpp"

namespace stx {
namespace {

std::optional<PlyType> typeOf(std::string_view name) {
    if (name == "char" || name == "int8") return PlyType::int8;
    if (name == "uchar" || name == "uint8") return PlyType::uint8;
    if (name == "short" || name == "int16") return PlyType::int16;
    if (name == "ushort" || name == "uint16") return PlyType::uint16;
    if (name == "int" || name == "int32") return PlyType::int32;
    if (name == "uint" || name == "uint32") return PlyType::uint32;
    if (name == "float" || name == "float32") return PlyType::float32;
    if (name == "double" || name == "float64") return PlyType::float64;
    return std::nullopt;
}

/// Takes the first word off a line.
std::string_view word(std::string_view& line) {
    line = trimmed(line);
    const auto end = line.find_first_of(" \t");
    const auto result = line.substr(0, end);
    line = end == std::string_view::npos ? std::string_view{} : trimmed(line.substr(end));
    return result;
}

Result<PlyProperty> readProperty(std::string_view line, int number) {
    PlyProperty property;
    auto typeName = word(line);
    if (typeName == "list") {
        property.isList = true;
        const auto countName = word(line);
        const auto countType = typeOf(countName);
        if (!countType || *countType == PlyType::float32 || *countType == PlyType::float64)
            return fail(ErrorCode::invalidInput, "line {}: a list's length cannot be of type '{}'",
                        number, countName);
        property.countType = *countType;
        typeName = word(line);
    }
    const auto type = typeOf(typeName);
    if (!type)
        return fail(ErrorCode::invalidInput, "line {}: unknown property type '{}'", number,
                    typeName);
    property.type = *type;
    property.name = word(line);
    if (property.name.empty())
        return fail(ErrorCode::invalidInput, "line {}: the property has no name", number);
    return property;
}

Result<void> checkCounts(const PlyHeader& header, std::uint64_t dataBytes) {
    for (const auto& element : header.elements) {
        if (element.count == 0) continue;
        // Text needs a digit and a blank for each value, but for the last blank.
        std::uint64_t least = 0;
        for (const auto& p : element.properties)
            least +=
                header.coding == PlyCoding::ascii ? 2 : plySize(p.isList ? p.countType : p.type);
        if (least == 0)
            return fail(ErrorCode::invalidInput, "the {} {} elements have no properties",
                        element.count, element.name);
        if (element.count > (dataBytes + 1) / least)
            return fail(ErrorCode::invalidInput,
                        "the header says {} {} elements, which take {} bytes each or more, but "
                        "only {} bytes "
                        "follow; the file is cut short or its header is wrong",
                        element.count, element.name, least, dataBytes);
    }
    return {};
}

}  // namespace

std::size_t plySize(PlyType type) {
    switch (type) {
        case PlyType::int8:
        case PlyType::uint8:
            return 1;
        case PlyType::int16:
        case PlyType::uint16:
            return 2;
        case PlyType::int32:
        case PlyType::uint32:
        case PlyType::float32:
            return 4;
        case PlyType::float64:
            return 8;
    }
    return 1;
}

Result<PlyHeader> readPlyHeader(ByteSpan file) {
    constexpr std::size_t kMostHeaderBytes = 1 << 20;
    const std::string_view text(reinterpret_cast<const char*>(file.data()),
                                std::min(file.size(), kMostHeaderBytes));
    if (!text.starts_with("ply"))
        return fail(
            ErrorCode::invalidInput,
            "a PLY file begins with 'ply'; this one does not, so it is another kind of file");
    PlyHeader header;
    bool hasFormat = false;
    std::size_t at = 0;
    for (int number = 1;; ++number) {
        const auto end = text.find_first_of("\r\n", at);
        if (end == std::string_view::npos)
            return fail(ErrorCode::invalidInput, "the PLY header has no end_header line");
        auto line = text.substr(at, end - at);
        at = end + 1;
        // Only a pair is one line end: a single CR may be followed by binary data that looks like
        // LF, but no writer ends its lines in CR alone and then has pairs.
        if (text[end] == '\r' && at < text.size() && text[at] == '\n') ++at;
        const auto key = word(line);
        if (number == 1) {
            if (key != "ply")
                return fail(ErrorCode::invalidInput, "line 1 is '{}', expected 'ply'", key);
        } else if (key == "format") {
            const auto coding = word(line);
            if (coding == "ascii")
                header.coding = PlyCoding::ascii;
            else if (coding == "binary_little_endian")
                header.coding = PlyCoding::littleEndian;
            else if (coding == "binary_big_endian")
                header.coding = PlyCoding::bigEndian;
            else
                return fail(ErrorCode::invalidInput,
                            "line {}: format '{}', expected ascii, binary_little_endian or "
                            "binary_big_endian",
                            number, coding.substr(0, 40));
            hasFormat = true;
        } else if (key == "comment" || key == "obj_info") {
            if (word(line) == "TextureFile" && !line.empty())
                header.textureFiles.emplace_back(trimmed(line));
        } else if (key == "element") {
            PlyElement element;
            element.name = word(line);
            const auto count = word(line);
            const auto known = wholeNumber<decltype(element.count)>(count);
            if (!known)
                return fail(ErrorCode::invalidInput, "line {}: '{}' is not a number of {} elements",
                            number, count.substr(0, 40), element.name);
            element.count = *known;
            header.elements.push_back(std::move(element));
        } else if (key == "property") {
            if (header.elements.empty())
                return fail(ErrorCode::invalidInput, "line {}: a property before the first element",
                            number);
            STX_TRY(auto property, readProperty(line, number));
            header.elements.back().properties.push_back(std::move(property));
        } else if (key == "end_header") {
            break;
        }
        // Other lines are of programs that have more to say, as comments are.
    }
    if (!hasFormat) return fail(ErrorCode::invalidInput, "the PLY header has no format line");
    header.dataOffset = at;
    STX_CHECK(checkCounts(header, file.size() - at));
    return header;
}

}  // namespace stx
