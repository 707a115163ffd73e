#include "formats/photos/heif_boxes.hpp"

#include <optional>

#include "formats/files/byte_io.hpp"

namespace stx::photos {
namespace {

struct Box {
    std::string type;
    std::size_t at = 0;  ///< of its content, in the file
    ByteSpan content;
};

tl::unexpected<Error> damagedBox(std::string_view type, std::size_t at, std::string_view what) {
    return fail(ErrorCode::invalidInput, "box '{}' at byte {}: {}", type, at, what);
}

/// Calls work(box) for the boxes in `bytes`, which begin at `at` of the file. Errors: work's; a box
/// that reaches beyond the end.
template <class Work>
Result<void> eachBox(ByteSpan bytes, std::size_t at, const Work& work) {
    std::size_t done = 0;
    while (bytes.size() - done >= 8) {
        ByteReader in(bytes.subspan(done));
        std::uint64_t size = in.u32();
        Box box;
        box.type = in.text(4);
        std::size_t head = 8;
        if (size == 1) {
            size = in.u64();
            head = 16;
        } else if (size == 0) {
            size = bytes.size() - done;
        }
        if (in.failed() || size < head || size > bytes.size() - done)
            return damagedBox(
                box.type, at + done,
                fmt::format("{} bytes are claimed where {} are left", size, bytes.size() - done));
        box.at = at + done + head;
        box.content = bytes.subspan(done + head, static_cast<std::size_t>(size) - head);
        STX_CHECK(work(box));
        done += static_cast<std::size_t>(size);
    }
    return {};
}

/// The boxes that `meta` holds, of those that are of interest.
struct Meta {
    std::optional<Box> pitm, iinf, iloc, iref, iprp, idat, grpl;
};

/// Version and flags of a full box, and what follows.
struct FullBox {
    explicit FullBox(const Box& box) : in(box.content), version(in.u8()), flags(in.u24()) {}
    ByteReader in;
    std::uint8_t version;
    std::uint32_t flags;
};

Result<void> readItems(const Box& box, HeifBoxes& out) {
    FullBox list(box);
    const std::uint32_t count = list.version == 0 ? list.in.u16() : list.in.u32();
    const std::size_t head = list.version == 0 ? 6 : 8;
    if (list.in.failed() || count > list.in.left() / 12)
        return damagedBox(
            "iinf", box.at,
            fmt::format("{} items are claimed in {} bytes", count, box.content.size()));
    return eachBox(box.content.subspan(head), box.at + head, [&](const Box& each) -> Result<void> {
        if (each.type != "infe") return {};
        FullBox entry(each);
        if (entry.version < 2) return {};
        const std::uint32_t id = entry.version == 2 ? entry.in.u16() : entry.in.u32();
        (void)entry.in.u16();  // how it is protected
        HeifBoxes::Item item;
        item.type = entry.in.text(4);
        if (entry.in.failed()) return damagedBox("infe", each.at, "it is too short");
        item.flagsAt = each.at + 3;
        const auto rest = entry.in.restView();
        const std::string_view text(reinterpret_cast<const char*>(rest.data()), rest.size());
        // The item's name, then what it contains, each up to a zero.
        if (item.type == "mime")
            if (const auto zero = text.find('\0'); zero != std::string_view::npos)
                item.contentType = text.substr(zero + 1, text.find('\0', zero + 1) - zero - 1);
        out.items[id] = std::move(item);
        return {};
    });
}

Result<void> readLocations(const Box& box, ByteSpan file, const std::optional<Box>& idat,
                           HeifBoxes& out) {
    FullBox list(box);
    ByteReader& in = list.in;
    const unsigned sizes = in.u16();
    const unsigned offsetSize = sizes >> 12, lengthSize = sizes >> 8 & 15,
                   baseSize = sizes >> 4 & 15;
    const unsigned indexSize = list.version > 0 ? sizes & 15 : 0;
    for (const unsigned size : {offsetSize, lengthSize, baseSize, indexSize})
        if (size != 0 && size != 4 && size != 8)
            return damagedBox("iloc", box.at, fmt::format("it has numbers of {} bytes", size));
    const auto number = [&](unsigned size) -> std::uint64_t {
        return size == 0 ? 0 : size == 4 ? in.u32() : in.u64();
    };
    const std::uint32_t count = list.version < 2 ? in.u16() : in.u32();
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t id = list.version < 2 ? in.u16() : in.u32();
        const unsigned method = list.version > 0 ? in.u16() & 15u : 0;
        const bool elsewhere = in.u16() != 0;
        const std::uint64_t base = number(baseSize);
        const unsigned extents = in.u16();
        const auto item = out.items.find(id);
        for (unsigned k = 0; k < extents; ++k) {
            (void)number(indexSize);
            const std::uint64_t offset = number(offsetSize), length = number(lengthSize);
            if (in.failed()) return damagedBox("iloc", box.at, "it is too short");
            if (item == out.items.end() || elsewhere || method > 1) continue;
            const ByteSpan in_ = method == 0 ? file : idat ? idat->content : ByteSpan();
            if (offset > in_.size() || base > in_.size() - offset ||
                length > in_.size() - offset - base)
                return damagedBox("iloc", box.at,
                                  fmt::format("item {} has {} bytes at {}, where {} are", id,
                                              length, base + offset, in_.size()));
            item->second.extents.push_back(in_.subspan(base + offset, length));
        }
        if (in.failed()) return damagedBox("iloc", box.at, "it is too short");
    }
    return {};
}

Result<void> readReferences(const Box& box, HeifBoxes& out) {
    const FullBox list(box);
    const bool wide = list.version > 0;
    if (box.content.size() < 4) return {};
    return eachBox(box.content.subspan(4), box.at + 4, [&](const Box& each) -> Result<void> {
        ByteReader in(each.content);
        HeifBoxes::Reference reference;
        reference.type = each.type;
        reference.typeAt = each.at - 4;
        reference.from = wide ? in.u32() : in.u16();
        const unsigned count = in.u16();
        if (in.failed() || in.left() < std::size_t{count} * (wide ? 4 : 2))
            return damagedBox(each.type, each.at, "it is too short");
        for (unsigned i = 0; i < count; ++i) reference.to.push_back(wide ? in.u32() : in.u16());
        out.references.push_back(std::move(reference));
        return {};
    });
}

Result<void> readProperties(const Box& box, HeifBoxes& out) {
    std::optional<Box> associations;
    STX_CHECK(eachBox(box.content, box.at, [&](const Box& each) -> Result<void> {
        if (each.type == "ipma" && !associations) associations = each;
        if (each.type != "ipco") return {};
        return eachBox(each.content, each.at, [&](const Box& property) -> Result<void> {
            out.properties.push_back({property.type, property.content});
            return {};
        });
    }));
    if (!associations) return {};
    FullBox list(*associations);
    ByteReader& in = list.in;
    const std::uint32_t count = in.u32();
    for (std::uint32_t i = 0; i < count && !in.failed(); ++i) {
        const std::uint32_t id = list.version < 1 ? in.u16() : in.u32();
        const unsigned properties = in.u8();
        const auto item = out.items.find(id);
        for (unsigned k = 0; k < properties && !in.failed(); ++k) {
            const unsigned index = (list.flags & 1) != 0 ? in.u16() & 0x7fffu : in.u8() & 0x7fu;
            if (index > 0 && index <= out.properties.size() && item != out.items.end())
                item->second.properties.push_back(index - 1);
        }
    }
    if (in.failed()) return damagedBox("ipma", associations->at, "it is too short");
    return {};
}

}  // namespace

const HeifBoxes::Property* HeifBoxes::property(const Item& item, std::string_view type) const {
    for (const std::size_t index : item.properties)
        if (properties[index].type == type) return &properties[index];
    return nullptr;
}

Bytes HeifBoxes::bytesOf(const Item& item, std::size_t most) {
    Bytes out;
    for (const ByteSpan extent : item.extents) {
        if (extent.size() > most - out.size()) return {};
        out.insert(out.end(), extent.begin(), extent.end());
    }
    return out;
}

Result<HeifBoxes> readHeifBoxes(ByteSpan file) {
    std::optional<Box> meta;
    // What follows it may be cut off: the items say whether they are whole.
    const auto top = eachBox(file, 0, [&](const Box& box) -> Result<void> {
        if (box.type == "meta" && !meta) meta = box;
        return {};
    });
    if (!meta && !top) return tl::unexpected(top.error());
    if (!meta || meta->content.size() < 4)
        return fail(ErrorCode::invalidInput,
                    "the box 'meta', which tells what is in it, is missing");
    Meta found;
    STX_CHECK(eachBox(meta->content.subspan(4), meta->at + 4, [&](const Box& box) -> Result<void> {
        for (const auto& [type, to] : {std::pair{"pitm", &found.pitm},
                                       {"iinf", &found.iinf},
                                       {"iloc", &found.iloc},
                                       {"iref", &found.iref},
                                       {"iprp", &found.iprp},
                                       {"idat", &found.idat},
                                       {"grpl", &found.grpl}})
            if (box.type == type && !*to) *to = box;
        return {};
    }));
    if (!found.pitm || !found.iinf || !found.iloc)
        return damagedBox("meta", meta->at,
                          fmt::format("'{}' is missing in it", !found.pitm   ? "pitm"
                                                               : !found.iinf ? "iinf"
                                                                             : "iloc"));
    HeifBoxes out;
    STX_CHECK(readItems(*found.iinf, out));
    STX_CHECK(readLocations(*found.iloc, file, found.idat, out));
    if (found.iref) STX_CHECK(readReferences(*found.iref, out));
    if (found.iprp) STX_CHECK(readProperties(*found.iprp, out));
    if (found.grpl)
        STX_CHECK(eachBox(found.grpl->content, found.grpl->at, [&](const Box& box) -> Result<void> {
            out.stereo = out.stereo || box.type == "ster";
            return {};
        }));
    FullBox primary(*found.pitm);
    out.primary = primary.version == 0 ? primary.in.u16() : primary.in.u32();
    if (primary.in.failed() || !out.items.contains(out.primary))
        return damagedBox("pitm", found.pitm->at,
                          fmt::format("the primary item {} is not there", out.primary));
    return out;
}

}  // namespace stx::photos
