#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/files.hpp"

namespace stx::photos {

/// What a HEIF file says of its items (ISO/IEC 23008-12, ISO/IEC 14496-12), without their pixels.
/// Spans lie in the file.
struct HeifBoxes {
    struct Property {
        std::string type;
        ByteSpan content;
    };
    struct Item {
        std::string type;         ///< "hvc1", "grid", "mime", "Exif" …
        std::string contentType;  ///< of "mime"
        std::size_t flagsAt = 0;  ///< in the file: the byte of `infe` whose bit 0 hides it
        std::vector<std::size_t> properties;  ///< indices, in the order that they are applied
        std::vector<ByteSpan> extents;        ///< where it lies; empty: elsewhere
    };
    struct Reference {
        std::string type;        ///< "auxl", "cdsc" …
        std::size_t typeAt = 0;  ///< in the file
        std::uint32_t from = 0;
        std::vector<std::uint32_t> to;
    };
    std::uint32_t primary = 0;
    std::map<std::uint32_t, Item> items;
    std::vector<Reference> references;
    std::vector<Property> properties;
    bool stereo = false;  ///< a group of pictures for two eyes (`ster`)

    /// The first property of a type that an item has; null where it has none.
    [[nodiscard]] const Property* property(const Item& item, std::string_view type) const;
    /// The bytes of an item of at most `most`; empty where there are none, or more.
    [[nodiscard]] static Bytes bytesOf(const Item& item, std::size_t most);
};

/// Errors (invalidInput): no `meta` box, a box or a list that reaches beyond what holds it, no
/// primary item; with the box and its byte offset.
[[nodiscard]] Result<HeifBoxes> readHeifBoxes(ByteSpan file);

}  // namespace stx::photos
