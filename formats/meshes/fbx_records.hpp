#pragma once

#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/files/files.hpp"

namespace stx {

/// Numbers of a file, lowest byte first.
template <class T>
[[nodiscard]] std::optional<T> numberAt(ByteSpan bytes, std::uint64_t at) {
    if (at > bytes.size() || sizeof(T) > bytes.size() - at) return std::nullopt;
    T value{};
    std::memcpy(&value, bytes.data() + at, sizeof(T));
    return value;
}

/// A record of a binary FBX file: its name, where its properties are and how many, and in how many
/// records it is. It ends within the file, and so does its name; all else may be wrong.
struct FbxRecord {
    std::string_view name;
    std::uint64_t properties = 0, count = 0, end = 0;
    std::size_t depth = 0;
    bool opens = false;  ///< there are records in it
};

/// Calls visit(record) for each record of a binary FBX file, in their order, until that is an error
/// or the file makes no sense: after a header of 27 bytes, records of (end, count of properties,
/// their bytes, name), the records inside of one between its properties and its end.
template <class Visit>
Result<void> eachFbxRecord(ByteSpan bytes, const Visit& visit) {
    // From version 7.5 on.
    const bool wide = numberAt<std::uint32_t>(bytes, 23).value_or(0) >= 7500;
    const std::uint64_t size = wide ? 8 : 4;
    const auto field = [&](std::uint64_t at) -> std::optional<std::uint64_t> {
        if (wide) return numberAt<std::uint64_t>(bytes, at);
        return numberAt<std::uint32_t>(bytes, at);
    };
    std::vector<std::uint64_t> ends = {bytes.size()};
    std::uint64_t at = 27;
    while (!ends.empty()) {
        const auto end = at < ends.back() ? field(at) : std::nullopt;
        if (!end || *end == 0) {  // the list of records ends here
            at = ends.back();
            ends.pop_back();
            continue;
        }
        const auto count = field(at + size), length = field(at + 2 * size);
        const auto name = numberAt<std::uint8_t>(bytes, at + 3 * size);
        if (!count || !length || !name || *end <= at || *end > bytes.size()) return {};
        FbxRecord record;
        record.properties = at + 3 * size + 1 + *name;
        if (record.properties > *end) return {};
        record.name = {reinterpret_cast<const char*>(bytes.data()) + record.properties - *name,
                       *name};
        record.count = *count;
        record.end = *end;
        record.depth = ends.size() - 1;
        record.opens = *length < *end - record.properties;
        STX_CHECK(visit(record));
        if (record.opens) ends.push_back(*end);
        at = record.opens ? record.properties + *length : *end;
    }
    return {};
}

}  // namespace stx
