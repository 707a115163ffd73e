// Google's two ways: GDepth, with the depth as base64 in the XMP, and Dynamic Depth, whose depth is
// a JPEG behind the first one.

#include "formats/files/base64.hpp"
#include "formats/files/text_numbers.hpp"
#include "formats/photos/readers.hpp"

namespace stx::photos {
namespace {

constexpr std::string_view kGDepth = "http://ns.google.com/photos/1.0/depthmap/";
constexpr std::string_view kGImage = "http://ns.google.com/photos/1.0/image/";
constexpr std::string_view kDepthMap = "http://ns.google.com/photos/dd/1.0/depthmap/";
constexpr std::string_view kDepthImage = "http://ns.google.com/photos/dd/1.0/image/";
constexpr std::string_view kModel = "http://ns.google.com/photos/dd/1.0/imagingmodel/";
constexpr std::string_view kContainer = "http://ns.google.com/photos/dd/1.0/container/";
constexpr std::string_view kItem = "http://ns.google.com/photos/dd/1.0/item/";

/// Format, Near and Far of both, with what both mean by them. `unit`: metres of the numbers.
Result<void> readRange(std::string_view format, double near, double far, double unit,
                       std::string_view measure, Photo& photo) {
    photo.coding = format;
    if (format != "RangeInverse" && format != "RangeLinear")
        return fail(ErrorCode::invalidInput,
                    "the format of its depth is '{}'; RangeInverse and RangeLinear exist", format);
    if (!(near > 0 && near < far))
        return fail(ErrorCode::invalidInput,
                    "its depth is from {:g} to {:g}; the first must be above 0 and below the "
                    "second",
                    near, far);
    photo.code.inverse = format == "RangeInverse";
    photo.code.zeroIsNear = true;
    photo.code.setRange(near * unit, far * unit);
    photo.code.alongRay = measure == "OpticRay" || measure == "OpticalRay";
    return {};
}

/// An end of the range of depth: the number that a property of the XMP holds. Errors
/// (invalidInput): it is missing or something else.
Result<double> rangeEnd(const std::optional<std::string_view>& text, std::string_view name) {
    constexpr std::size_t kShown = 40;  // letters of a text that may be any long
    if (!text)
        return fail(ErrorCode::invalidInput,
                    "it has depth, but not its {}; a finite number is expected", name);
    const auto numbers = numbersFrom(*text);
    if (!numbers || numbers->size() != 1)
        return fail(ErrorCode::invalidInput,
                    "the {} of its depth is '{}'; a finite number like 0.5 is expected", name,
                    text->substr(0, kShown));
    return numbers->front();
}

/// A picture that the XMP holds as base64.
Result<PhotoImage> pictureInText(std::string_view base64, std::string_view what) {
    // Base64 of mails and of XML has lines of 76 letters.
    constexpr std::string_view kBlanks = " \t\n\v\f\r";
    std::string joined;
    if (base64.find_first_of(kBlanks) != std::string_view::npos) {
        joined = base64;
        std::erase_if(joined, [&](char c) { return kBlanks.find(c) != std::string_view::npos; });
        base64 = joined;
    }
    auto bytes = decodeBase64(base64);
    if (!bytes) return fail(ErrorCode::invalidInput, "{} in its XMP is not base64", what);
    const auto owner = std::make_shared<const Bytes>(std::move(*bytes));
    return embeddedPicture(*owner, owner, what);
}

/// What an item of a container is, and where it lies.
struct ContainerItem {
    std::string semantic, uri;
    std::size_t offset = 0, length = 0;
};

/// The items of Container:Directory, which lie behind each other. Errors (invalidInput): one
/// reaches beyond the file.
Result<std::vector<ContainerItem>> itemsOf(const Xmp& xmp, ByteSpan file) {
    std::vector<ContainerItem> items;
    std::size_t at = 0;
    for (const auto node : xmp.all(kContainer, "Item")) {
        const auto number = [&](std::string_view name) -> double {
            const auto text = xmp.textIn(node, kItem, name);
            const auto numbers = text ? numbersFrom(*text) : std::nullopt;
            return numbers && numbers->size() == 1 ? numbers->front() : 0.0;
        };
        ContainerItem item;
        item.semantic = xmp.textIn(node, kItem, "Semantic").value_or("");
        item.uri = xmp.textIn(node, kItem, "DataURI").value_or("");
        double length = number("Length");
        const double padding = number("Padding");
        // The first is the JPEG that everybody sees: it may leave its length out.
        if (items.empty()) length = static_cast<double>(jpegLength(file).value_or(file.size()));
        const double left = static_cast<double>(file.size() - at);
        if (!(length >= 0 && padding >= 0 && length <= left && padding <= left - length))
            return fail(ErrorCode::invalidInput,
                        "its item {} ('{}') claims {:.0f} bytes at byte {}, but the file has {}",
                        items.size() + 1, item.semantic, length, at, file.size());
        item.offset = at;
        item.length = static_cast<std::size_t>(length);
        at += item.length + static_cast<std::size_t>(padding);
        items.push_back(std::move(item));
        constexpr std::size_t kMostItems = 64;
        if (items.size() > kMostItems)
            return fail(ErrorCode::invalidInput, "it has more than {} items", kMostItems);
    }
    return items;
}

}  // namespace

Result<bool> readGDepth(const JpegPhoto& jpeg, Photo& photo, const Limits& limits) {
    if (!jpeg.xmp) return false;
    const auto text = [&](std::string_view space,
                          std::string_view name) -> std::optional<std::string_view> {
        if (const auto found = jpeg.xmp->text(space, name)) return found;
        return jpeg.extended ? jpeg.extended->text(space, name) : std::nullopt;
    };
    const auto format = text(kGDepth, "Format");
    if (!format) return false;
    photo.format = "GDepth";
    const std::string_view units = text(kGDepth, "Units").value_or("");
    STX_TRY(const double near, rangeEnd(text(kGDepth, "Near"), "GDepth:Near"));
    STX_TRY(const double far, rangeEnd(text(kGDepth, "Far"), "GDepth:Far"));
    STX_CHECK(readRange(*format, near, far, units == "mm" ? 0.001 : 1.0,
                        text(kGDepth, "MeasureType").value_or(""), photo));
    photo.accuracy = units == "m" || units == "mm" ? "absolute" : "unscaled";
    const auto data = text(kGDepth, "Data");
    if (!data && jpeg.notExtended) return tl::unexpected(*jpeg.notExtended);
    if (!data)
        return fail(ErrorCode::invalidInput,
                    "it tells of depth (GDepth:Format), but the depth itself (GDepth:Data) is "
                    "missing");
    // Without its line breaks, and decoded.
    STX_CHECK(limits.checkAllocation(data->size(), 2, "its depth"));
    STX_TRY(photo.depth, pictureInText(*data, "its depth"));
    if (const auto sharp = text(kGImage, "Data"); sharp) {
        photo.colourIs = jpeg.options.portrait ? "portrait" : "original";
        if (!jpeg.options.portrait)
            STX_SET(photo.colour, pictureInText(*sharp, "its original picture"));
    }
    return true;
}

Result<bool> readDynamicDepth(const JpegPhoto& jpeg, Photo& photo) {
    if (!jpeg.xmp) return false;
    const Xmp& xmp = *jpeg.xmp;
    const auto uri = xmp.text(kDepthMap, "DepthURI");
    if (!uri) return false;
    photo.format = "Dynamic Depth";
    const ByteSpan file = *jpeg.file;
    STX_TRY(const auto items, itemsOf(xmp, file));
    const auto find = [&](std::string_view wanted) -> const ContainerItem* {
        for (std::size_t i = 1; i < items.size(); ++i)
            if (items[i].uri == wanted) return &items[i];
        return nullptr;
    };
    const ContainerItem* depth = find(*uri);
    if (!depth)
        return fail(ErrorCode::invalidInput,
                    "its depth is named '{}', but no item of its directory has that name", *uri);
    const std::string_view units = xmp.text(kDepthMap, "Units").value_or("");
    STX_TRY(double near, rangeEnd(xmp.text(kDepthMap, "Near"), "DepthMap:Near"));
    STX_TRY(double far, rangeEnd(xmp.text(kDepthMap, "Far"), "DepthMap:Far"));
    // Diopters are 1/m, so the nearest has the most. Phones that write them the other way round
    // mean some range of their own.
    const bool diopters = units == "Diopters" && near > far && far > 0;
    if (diopters) {
        near = 1 / near;
        far = 1 / far;
    }
    STX_CHECK(readRange(xmp.text(kDepthMap, "Format").value_or(""), near, far, 1,
                        xmp.text(kDepthMap, "MeasureType").value_or(""), photo));
    photo.accuracy = units == "Meters" || diopters ? "absolute" : "relative";
    STX_TRY(photo.depth,
            embeddedPicture(file.subspan(depth->offset, depth->length), jpeg.file, "its depth"));
    const auto original = xmp.text(kDepthImage, "ItemURI");
    if (const ContainerItem* sharp = original ? find(*original) : nullptr) {
        photo.colourIs = jpeg.options.portrait ? "portrait" : "original";
        if (!jpeg.options.portrait)
            STX_SET(photo.colour, embeddedPicture(file.subspan(sharp->offset, sharp->length),
                                                  jpeg.file, "its original picture"));
    }
    for (const ContainerItem& item : items)
        if (item.semantic == "GainMap") photo.others.emplace_back("a gain map");
    const double w = xmp.number(kModel, "ImageWidth").value_or(0);
    const double h = xmp.number(kModel, "ImageHeight").value_or(0);
    const auto of = [&](const char* name) { return xmp.number(kModel, name).value_or(0); };
    if (w >= 1 && h >= 1) {
        const double sx = photo.colour.width / w, sy = photo.colour.height / h;
        const PhotoIntrinsics k{of("FocalLengthX") * sx, of("FocalLengthY") * sy,
                                of("PrincipalPointX") * sx, of("PrincipalPointY") * sy};
        if (k.fx > 0 && k.fy > 0) photo.intrinsics = k;
    }
    return true;
}

}  // namespace stx::photos
