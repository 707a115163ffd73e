// HEIC of Apple's phones: the picture is the primary item, the depth an auxiliary one.

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "formats/files/byte_io.hpp"
#include "formats/images/exif.hpp"
#include "formats/photos/heif_boxes.hpp"
#include "formats/photos/numbers.hpp"
#include "formats/photos/readers.hpp"

namespace stx::photos {
namespace {

/// Packets of XMP and EXIF in an item; those of phones have some kilobytes.
constexpr std::size_t kMostMetadata = 4u << 20;

/// How an item is turned, in the order of its properties, and what becomes of its size.
struct ItemTurn {
    glm::ivec2 stored{0}, upright{0};
    struct Step {
        int quarters = 0;  ///< clockwise
        bool mirrors = false, leftAndRight = false;
        glm::ivec2 corner{0};  ///< of what is left of it
        glm::ivec2 size{0};    ///< before it
    };
    std::vector<Step> steps;
    /// What is cut out of the stored picture, as shares of its size; none: it is whole.
    std::optional<std::pair<glm::dvec2, glm::dvec2>> cut;
};

/// Cuts a picture as its `clap` says (ISO/IEC 14496-12, 12.1.4): the size as two fractions, then
/// how far its middle is from the picture's, both counted between the outer pixels' centres.
Result<void> cutOut(ByteSpan clap, const char* what, ItemTurn& turn) {
    const auto wrong = [&] {
        return fail(ErrorCode::invalidInput,
                    "{} is cut by its file (clap) to what is not in its {}x{} pixels", what,
                    turn.upright.x, turn.upright.y);
    };
    if (clap.size() < 32) return wrong();
    glm::dvec2 first(0), last(0);
    ItemTurn::Step step;
    step.size = turn.upright;
    for (int k = 0; k < 2; ++k) {
        const auto number = [&](std::size_t index) { return bigEndian(clap, 4 * index, 4); };
        const std::size_t at = 2 * static_cast<std::size_t>(k);
        if (number(at + 1) == 0 || number(at + 5) == 0) return wrong();
        const double length = std::round(static_cast<double>(number(at)) / number(at + 1));
        const double off =
            static_cast<double>(static_cast<std::int32_t>(number(at + 4))) / number(at + 5);
        const double from = std::floor(off + (step.size[k] - 1) / 2.0 - (length - 1) / 2);
        if (!(length >= 1 && from >= 0 && from + length <= step.size[k])) return wrong();
        step.corner[k] = static_cast<int>(from);
        turn.upright[k] = static_cast<int>(length);
        first[k] = from / step.size[k];
        last[k] = (from + length) / step.size[k];
    }
    turn.cut = {first, last};
    turn.steps.push_back(step);
    return {};
}

/// A picture and its depth are cut alike, within what a pixel of the depth is.
bool cutAlike(const ItemTurn& picture, const ItemTurn& depth) {
    constexpr double kSamePlace = 0.01;  // of the size, as for the shapes of both
    if (!picture.cut || !depth.cut) return picture.cut.has_value() == depth.cut.has_value();
    const auto near = [](glm::dvec2 a, glm::dvec2 b) {
        return glm::all(glm::lessThan(glm::abs(a - b), glm::dvec2(kSamePlace)));
    };
    return near(picture.cut->first, depth.cut->first) &&
           near(picture.cut->second, depth.cut->second);
}

PhotoIntrinsics afterStep(PhotoIntrinsics k, const ItemTurn::Step& step) {
    k.cx -= step.corner.x;
    k.cy -= step.corner.y;
    if (step.mirrors) return mirrored(k, step.size, step.leftAndRight);
    return turned(k, step.size, step.quarters);
}

Result<ItemTurn> turnOf(const HeifBoxes& boxes, const HeifBoxes::Item& item, const char* what) {
    ItemTurn turn;
    const auto* size = boxes.property(item, "ispe");
    if (!size || size->content.size() < 12)
        return fail(ErrorCode::invalidInput, "{} has no size (ispe)", what);
    const std::uint32_t w = bigEndian(size->content, 4, 4), h = bigEndian(size->content, 8, 4);
    if (w < 1 || h < 1 || w > INT32_MAX || h > INT32_MAX)
        return fail(ErrorCode::invalidInput, "{} claims {}x{} pixels", what, w, h);
    turn.stored = turn.upright = {static_cast<int>(w), static_cast<int>(h)};
    for (const std::size_t index : item.properties) {
        const auto& property = boxes.properties[index];
        if (property.type == "clap") {
            STX_CHECK(cutOut(property.content, what, turn));
            continue;
        }
        if (property.content.empty()) continue;
        const unsigned value = byteAt(property.content, 0) & 3;
        ItemTurn::Step step;
        step.size = turn.upright;
        if (property.type == "irot") {  // counter-clockwise in the file
            step.quarters = static_cast<int>((4 - value) % 4);
            if (value % 2 == 1) std::swap(turn.upright.x, turn.upright.y);
        } else if (property.type == "imir") {
            step.mirrors = true;
            step.leftAndRight = (value & 1) != 0;
        } else {
            continue;
        }
        turn.steps.push_back(step);
    }
    return turn;
}

/// The kind of an auxiliary item: the text of its auxC.
std::string auxiliaryKind(const HeifBoxes& boxes, const HeifBoxes::Item& item) {
    const auto* property = boxes.property(item, "auxC");
    if (!property || property->content.size() < 4) return {};
    const std::string_view text = textIn(property->content.subspan(4));
    return std::string(text.substr(0, text.find('\0')));
}

bool isDepthKind(std::string_view kind) {
    return kind == "urn:mpeg:hevc:2015:auxid:2" ||
           kind == "urn:mpeg:mpegB:cicp:systems:auxiliary:depth";
}

/// An item that describes another (cdsc), of a type; null where there is none.
const HeifBoxes::Item* descriptionOf(const HeifBoxes& boxes, std::uint32_t id,
                                     std::string_view type) {
    for (const auto& reference : boxes.references) {
        if (reference.type != "cdsc" || std::ranges::find(reference.to, id) == reference.to.end())
            continue;
        const auto item = boxes.items.find(reference.from);
        if (item == boxes.items.end() || item->second.type != type) continue;
        if (type == "mime" && item->second.contentType != "application/rdf+xml") continue;
        return &item->second;
    }
    return nullptr;
}

/// The file with its auxiliary items as pictures of their own, each of which libheif then gives by
/// its number. Version 1.15.1 refuses files in which one belongs to two pictures, as phones write
/// since iOS 18. Nothing moves: references get another type, and items are no longer hidden.
Bytes withoutAuxiliaries(ByteSpan file, const HeifBoxes& boxes) {
    Bytes out(file.begin(), file.end());
    for (const auto& reference : boxes.references) {
        const auto item = boxes.items.find(reference.from);
        if (reference.type != "auxl" || item == boxes.items.end()) continue;
        out[reference.typeAt] = std::byte{'x'};
        out[item->second.flagsAt] &= std::byte{0xfe};
    }
    return out;
}

void noteAuxiliary(const std::string& kind, Photo& photo) {
    constexpr std::string_view kAux = ":aux:";
    const auto at = kind.rfind(kAux);
    const std::string name = at == std::string::npos ? kind : kind.substr(at + kAux.size());
    if (name.ends_with("matte"))
        photo.mattes.push_back(name);
    else if (name == "hdrgainmap")
        photo.others.emplace_back("a gain map");
}

/// What an item says of its colours: an ICC profile, wherever that is among its boxes, or else
/// codes of H.273 (ISO/IEC 14496-12, 12.1.5).
FileColours coloursOfItem(const HeifBoxes& boxes, const HeifBoxes::Item& item) {
    FileColours out;
    for (const std::size_t index : item.properties) {
        const ByteSpan body = boxes.properties[index].content;
        if (boxes.properties[index].type != "colr") continue;
        if (beginsWith(body, "prof") || beginsWith(body, "rICC")) {
            const ByteSpan profile = body.subspan(4);
            return {{profile.begin(), profile.end()}, {}};
        }
        if (beginsWith(body, "nclx") && body.size() >= 8)
            out = coloursOfCodes(static_cast<unsigned>(bigEndian(body, 4, 2)),
                                 static_cast<unsigned>(bigEndian(body, 6, 2)));
    }
    return out;
}

}  // namespace

bool isHeif(ByteSpan head) {
    if (head.size() < 16 || textIn(head.subspan(4, 4)) != "ftyp") return false;
    const std::size_t size = std::min<std::size_t>(bigEndian(head, 0, 4), head.size());
    // A film may have mif1 among its brands, too; its first brand is a film's.
    for (const std::string_view brand : {"heic", "heix", "heim", "heis", "mif1", "hevc", "hevx"})
        if (size >= 12 && textIn(head.subspan(8, 4)) == brand) return true;
    return false;
}

Result<void> readHeic(Photo& photo, const Limits& limits) {
    const ByteSpan file = *photo.file;
    STX_TRY(const HeifBoxes boxes, readHeifBoxes(file));
    STX_CHECK(limits.checkAllocation(2, file.size(), "the file and its copy"));
    photo.format = "HEIC";
    const auto& primary = boxes.items.at(boxes.primary);
    STX_TRY(const ItemTurn turn, turnOf(boxes, primary, "its picture"));
    // Decoded from a copy in which auxiliary items are pictures like others.
    const auto copy = std::make_shared<const Bytes>(withoutAuxiliaries(file, boxes));
    photo.colour = {PhotoImage::Coding::heif, *copy,         copy, boxes.primary,
                    turn.upright.x,           turn.upright.y};
    photo.colours = coloursOfItem(boxes, primary);
    if (const auto* exif = descriptionOf(boxes, boxes.primary, "Exif")) {
        const Bytes bytes = HeifBoxes::bytesOf(*exif, kMostMetadata);
        // Four bytes count up to the TIFF. Its orientation repeats irot.
        if (bytes.size() > 4)
            if (const std::size_t skip = bigEndian(bytes, 0, 4); skip < bytes.size() - 4)
                photo.focal35 = readExifTiff(ByteSpan(bytes).subspan(4 + skip)).focal35;
    }
    if (boxes.stereo) photo.others.emplace_back("a pair for two eyes");
    for (const auto& reference : boxes.references) {
        if (reference.type != "auxl" ||
            std::ranges::find(reference.to, boxes.primary) == reference.to.end())
            continue;
        const auto item = boxes.items.find(reference.from);
        if (item == boxes.items.end()) continue;
        const std::string kind = auxiliaryKind(boxes, item->second);
        if (!isDepthKind(kind)) {
            noteAuxiliary(kind, photo);
            // Damaged or cut in another way, it is as if it were not there: depth is what matters.
            if (const auto matte = turnOf(boxes, item->second, "its matte");
                matte && kind.ends_with(kPortraitMatte) && cutAlike(turn, *matte))
                photo.matte = {PhotoImage::Coding::heif, *copy,           copy, reference.from,
                               matte->upright.x,         matte->upright.y};
            continue;
        }
        if (photo.depth.coding != PhotoImage::Coding::none) continue;
        STX_TRY(const ItemTurn depth, turnOf(boxes, item->second, "its depth"));
        if (!cutAlike(turn, depth))
            return fail(ErrorCode::unsupported,
                        "its picture and its depth are not cut alike (clap), so that it is not "
                        "known what of one belongs to the other; save it again without the cut");
        photo.depth = {PhotoImage::Coding::heif, *copy,           copy,
                       reference.from,           depth.upright.x, depth.upright.y};
        photo.coding = "white is near";
        photo.accuracy = "relative";
        const auto* packet = descriptionOf(boxes, reference.from, "mime");
        if (!packet) continue;
        STX_TRY(const Xmp xmp, Xmp::parse(HeifBoxes::bytesOf(*packet, kMostMetadata)));
        std::string subtype;
        if (!readAppleDepth(xmp, turn.stored, photo, subtype)) continue;
        photo.format = "Apple HEIC";
        if (photo.intrinsics)
            for (const auto& step : turn.steps)
                photo.intrinsics = afterStep(*photo.intrinsics, step);
    }
    return {};
}

}  // namespace stx::photos
