#pragma once

#include <lcms2_plugin.h>

#include <algorithm>
#include <initializer_list>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/files/base64.hpp"
#include "formats/files/byte_io.hpp"
#include "formats/images/images.hpp"

/// Small photographs with depth, put together as phones write them. Nothing here is shared with the
/// readers.
namespace made {

using namespace stx;

inline void append(Bytes& to, ByteSpan from) {
    std::ranges::copy(from, std::back_inserter(to));
}
inline void append(Bytes& to, std::string_view text) {
    append(to, std::as_bytes(std::span(text)));
}
inline void appendLittle(Bytes& to, std::uint32_t value, int size = 4) {
    for (int i = 0; i < size; ++i) to.push_back(static_cast<std::byte>(value >> 8 * i & 0xff));
}
inline void appendBig(Bytes& to, std::uint32_t value, int size = 4) {
    for (int i = size - 1; i >= 0; --i) to.push_back(static_cast<std::byte>(value >> 8 * i & 0xff));
}

/// A picture of `width` x `height`, red to the right and green downward.
inline Bytes colourJpeg(int width = 32, int height = 24, int blue = 0) {
    std::vector<std::uint8_t> rgb;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (const int v : {255 * x / (width - 1), 255 * y / (height - 1), blue})
                rgb.push_back(static_cast<std::uint8_t>(v));
    return *encodeJpeg(width, height, 3, rgb.data(), 95);
}
/// Codes that grow to the right, 16 a pixel, and jump by half downward.
inline std::vector<std::uint8_t> depthCodes(int width = 16, int height = 12) {
    std::vector<std::uint8_t> codes;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            codes.push_back(static_cast<std::uint8_t>(x * 8 + (y < height / 2 ? 0 : 120)));
    return codes;
}
inline Bytes depthPng(int width = 16, int height = 12) {
    return *encodePng(width, height, 1, 8, depthCodes(width, height).data(), false);
}
inline Bytes depthJpeg(int width = 16, int height = 12) {
    return *encodeJpeg(width, height, 1, depthCodes(width, height).data(), 100);
}

inline Bytes segment(int marker, std::string_view head, ByteSpan content) {
    Bytes out;
    appendBig(out, 0xff00u | static_cast<unsigned>(marker), 2);
    appendBig(out, static_cast<std::uint32_t>(2 + head.size() + content.size()), 2);
    append(out, head);
    append(out, content);
    return out;
}
/// Segments behind a JPEG's first two bytes.
inline Bytes withSegments(const Bytes& jpeg, const std::vector<Bytes>& segments) {
    Bytes out(jpeg.begin(), jpeg.begin() + 2);
    for (const Bytes& each : segments) append(out, each);
    out.insert(out.end(), jpeg.begin() + 2, jpeg.end());
    return out;
}

/// EXIF of an orientation and, where above 0, a focal length of a 35 mm camera.
inline Bytes exifSegment(int orientation, int focal35) {
    Bytes tiff;
    append(tiff, std::string_view("MM\0*\0\0\0\x08", 8));
    appendBig(tiff, 2, 2);
    const auto entry = [&](std::uint32_t tag, std::uint32_t type, std::uint32_t value) {
        appendBig(tiff, tag, 2);
        appendBig(tiff, type, 2);
        appendBig(tiff, 1);
        appendBig(tiff, type == 3 ? value << 16 : value);
    };
    entry(0x0112, 3, static_cast<std::uint32_t>(orientation));
    entry(0x8769, 4, 8 + 2 + 24 + 4);
    appendBig(tiff, 0);
    appendBig(tiff, focal35 > 0 ? 1 : 0, 2);
    if (focal35 > 0) entry(0xa405, 3, static_cast<std::uint32_t>(focal35));
    appendBig(tiff, 0);
    return segment(0xe1, std::string_view("Exif\0\0", 6), tiff);
}

inline std::string rdf(const std::string& attributes, const std::string& inside = "") {
    return "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF "
           "xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description "
           "rdf:about=\"\" " +
           attributes + ">" + inside + "</rdf:Description></rdf:RDF></x:xmpmeta>";
}
inline Bytes xmpSegment(const std::string& packet) {
    return segment(0xe1, std::string_view("http://ns.adobe.com/xap/1.0/\0", 29),
                   std::as_bytes(std::span(packet)));
}

/// What Apple writes beside depth. `matrix`: fx and fy of a picture of 32x24.
inline std::string appleXmp(double least = 0.5, double most = 2, double fx = 30, double fy = 30,
                            const std::string& accuracy = "absolute", double cx = 17,
                            double cy = 11) {
    std::string list;
    for (const double v : {fx, 0.0, 0.0, 0.0, fy, 0.0, cx, cy, 1.0})
        list += fmt::format("<rdf:li>{}</rdf:li>", v);
    return rdf(
        "xmlns:p=\"http://ns.apple.com/pixeldatainfo/1.0/\" "
        "xmlns:d=\"http://ns.apple.com/depthData/1.0/\"",
        fmt::format("<p:FloatMinValue>{}</p:FloatMinValue>"
                    "<p:FloatMaxValue>{}</p:FloatMaxValue>"
                    "<p:AuxiliaryImageType>disparity</p:AuxiliaryImageType>"
                    "<d:Accuracy>{}</d:Accuracy>"
                    "<d:IntrinsicMatrixReferenceWidth>32</d:IntrinsicMatrixReferenceWidth>"
                    "<d:IntrinsicMatrixReferenceHeight>24</d:IntrinsicMatrixReferenceHeight>"
                    "<d:IntrinsicMatrix><rdf:Seq>{}</rdf:Seq></d:IntrinsicMatrix>",
                    least, most, accuracy, list));
}
inline std::string matteXmp() {
    return rdf(
        "xmlns:p=\"http://ns.apple.com/pixeldatainfo/1.0/\" "
        "p:AuxiliaryImageType=\"depth\" p:AuxiliaryImageSubType=\"portraiteffectsmatte\"");
}

/// The first picture and others behind it, with the list of them. Offsets count from the list's
/// TIFF header; `wrong` is added to that of the second picture.
inline Bytes mpf(const Bytes& first, const std::vector<Bytes>& others, std::vector<Bytes> segments,
                 int wrong = 0) {
    Bytes tiff;
    append(tiff, std::string_view("MM\0*\0\0\0\x08", 8));
    appendBig(tiff, 1, 2);
    appendBig(tiff, 0xb002, 2);
    appendBig(tiff, 7, 2);
    appendBig(tiff, static_cast<std::uint32_t>(16 * (1 + others.size())));
    appendBig(tiff, 8 + 2 + 12 + 4);
    appendBig(tiff, 0);
    std::size_t before = 2 + 4 + 4;  // the start of the file, the segment's head and its mark
    for (const Bytes& each : segments) before += each.size();
    const std::size_t listEnd = before + tiff.size() + 16 * (1 + others.size());
    std::size_t at = listEnd + first.size() - 2;
    for (std::size_t i = 0; i <= others.size(); ++i) {
        appendBig(tiff, 0);
        appendBig(tiff, static_cast<std::uint32_t>(i == 0 ? at : others[i - 1].size()));
        appendBig(tiff, i == 0 ? 0
                               : static_cast<std::uint32_t>(static_cast<int>(at - before) +
                                                            (i == 1 ? wrong : 0)));
        appendBig(tiff, 0);
        if (i > 0) at += others[i - 1].size();
    }
    segments.push_back(segment(0xe2, std::string_view("MPF\0", 4), tiff));
    Bytes out = withSegments(first, segments);
    for (const Bytes& each : others) append(out, each);
    return out;
}
/// Apple's JPEG: a picture, a matte, the depth, and zeros.
inline Bytes applePhoto(int orientation = 1, const std::string& xmp = appleXmp()) {
    Bytes out = mpf(colourJpeg(),
                    {withSegments(depthJpeg(8, 6), {xmpSegment(matteXmp())}),
                     withSegments(depthJpeg(), {xmpSegment(xmp)})},
                    {exifSegment(orientation, 0)});
    out.resize(out.size() + 100);
    return out;
}

inline std::string md5(std::string_view text) {
    const cmsHANDLE sum = cmsMD5alloc(nullptr);
    cmsMD5add(sum, reinterpret_cast<const cmsUInt8Number*>(text.data()),
              static_cast<cmsUInt32Number>(text.size()));
    cmsProfileID id = {};
    cmsMD5finish(&id, sum);
    return fmt::format("{:02X}", fmt::join(id.ID8, ""));
}

/// GDepth: a picture in front, the depth and, where there is one, the sharp original in extended
/// XMP of parts of `part` bytes. `attributes`: what else its XMP says. `segments` come before.
/// `lineEnd` stands behind each 76 letters of base64.
inline Bytes gdepthPhoto(const Bytes& shown, const std::string& format, ByteSpan depth,
                         const Bytes& sharp, const std::string& attributes, std::size_t part,
                         std::vector<Bytes> segments = {}, const std::string& lineEnd = "") {
    const auto base64 = [&](ByteSpan bytes) {
        const std::string line = encodeBase64(bytes);
        if (lineEnd.empty()) return line;
        std::string lines;
        for (std::size_t at = 0; at < line.size(); at += 76) lines += line.substr(at, 76) + lineEnd;
        return lines;
    };
    const std::string spaces =
        "xmlns:D=\"http://ns.google.com/photos/1.0/depthmap/\" "
        "xmlns:I=\"http://ns.google.com/photos/1.0/image/\" "
        "xmlns:N=\"http://ns.adobe.com/xmp/note/\" ";
    const std::string extended = rdf(spaces + "D:Data=\"" + base64(depth) + "\"" +
                                     (sharp.empty() ? "" : " I:Data=\"" + base64(sharp) + "\""));
    const std::string guid = md5(extended);
    segments.push_back(xmpSegment(rdf(spaces + "D:Format=\"" + format + "\" " + attributes +
                                      " N:HasExtendedXMP=\"" + guid + "\"")));
    for (std::size_t at = 0; at < extended.size(); at += part) {
        Bytes content;
        append(content, guid);
        appendBig(content, static_cast<std::uint32_t>(extended.size()));
        appendBig(content, static_cast<std::uint32_t>(at));
        append(content, std::string_view(extended).substr(at, part));
        segments.push_back(
            segment(0xe1, std::string_view("http://ns.adobe.com/xmp/extension/\0", 35), content));
    }
    return withSegments(shown, segments);
}
/// A small one: blurred (blue) in front, and the sharp original.
inline Bytes gdepthPhoto(std::size_t part = 400, const std::string& format = "RangeInverse",
                         const std::string& more = "") {
    return gdepthPhoto(colourJpeg(32, 24, 255), format, depthPng(), colourJpeg(),
                       "D:Near=\"1\" D:Far=\"9\" " + more, part);
}

/// Dynamic Depth: blurred, gain map, sharp, depth. `units` "Meters" and such; `focal` of 64x48.
inline Bytes dynamicPhoto(const std::string& units = "Meters", glm::dvec2 focal = {60, 60}) {
    const std::string base = "http://ns.google.com/photos/dd/1.0/";
    const Bytes gain = colourJpeg(8, 6), sharp = colourJpeg(), depth = depthJpeg();
    const auto item = [](const char* semantic, std::size_t length, const char* uri) {
        return fmt::format(
            "<rdf:li rdf:parseType=\"Resource\"><C:Item T:Mime=\"image/jpeg\" "
            "T:Semantic=\"{}\" T:Length=\"{}\" T:DataURI=\"{}\"/></rdf:li>",
            semantic, length, uri);
    };
    const std::string inside =
        "<C:Directory><rdf:Seq>" + item("Primary", 0, "first") + item("GainMap", gain.size(), "") +
        item("Original", sharp.size(), "android/original") +
        item("Depth", depth.size(), "android/depthmap") +
        "</rdf:Seq></C:Directory><J:ItemURI>android/original</J:ItemURI>"
        "<M:Format>RangeLinear</M:Format><M:Near>0.5</M:Near><M:Far>8.5</M:Far><M:Units>" +
        units +
        "</M:Units><M:DepthURI>android/depthmap</M:DepthURI>"
        "<K:FocalLengthX>" +
        fmt::format("{}</K:FocalLengthX><K:FocalLengthY>{}</K:FocalLengthY>", focal.x, focal.y) +
        "<K:PrincipalPointX>30</K:PrincipalPointX><K:PrincipalPointY>26</K:PrincipalPointY>"
        "<K:ImageWidth>64</K:ImageWidth><K:ImageHeight>48</K:ImageHeight>";
    Bytes out =
        withSegments(colourJpeg(32, 24, 255),
                     {xmpSegment(rdf("xmlns:C=\"" + base + "container/\" xmlns:T=\"" + base +
                                         "item/\" xmlns:J=\"" + base + "image/\" xmlns:M=\"" +
                                         base + "depthmap/\" xmlns:K=\"" + base + "imagingmodel/\"",
                                     inside))});
    for (const Bytes& each : {gain, sharp, depth}) append(out, each);
    return out;
}

/// Samsung: blurred, then a trailer with the sharp picture, the depth and its size.
inline Bytes samsungPhoto(std::uint32_t version = 3,
                          const std::string& name = "DualShot_DepthMap_1") {
    Bytes out = colourJpeg(32, 24, 255);
    struct Block {
        std::uint32_t type;
        std::size_t at, size;
    };
    std::vector<Block> blocks;
    const auto add = [&](std::uint32_t type, const std::string& blockName, ByteSpan content) {
        const std::size_t at = out.size();
        appendLittle(out, 0, 2);
        appendLittle(out, type, 2);
        appendLittle(out, static_cast<std::uint32_t>(blockName.size()));
        append(out, blockName);
        append(out, content);
        blocks.push_back({type, at, out.size() - at});
    };
    const Bytes sharp = colourJpeg();
    add(1, "DualShot_1", sharp);
    const auto codes = depthCodes();
    add(0x0ab1, name, std::as_bytes(std::span(codes)));
    Bytes info;
    for (std::uint32_t i = 0; i < 26; ++i)
        appendLittle(info, i == 0 ? version : i == 12 ? 16 : i == 13 ? 12 : 0);
    add(0x0ab3, "DualShot_Extra_Info", info);
    const std::size_t directory = out.size();
    append(out, "SEFH");
    appendLittle(out, 107);
    appendLittle(out, static_cast<std::uint32_t>(blocks.size()));
    for (const Block& block : blocks) {
        appendLittle(out, 0, 2);
        appendLittle(out, block.type, 2);
        appendLittle(out, static_cast<std::uint32_t>(directory - block.at));
        appendLittle(out, static_cast<std::uint32_t>(block.size));
    }
    appendLittle(out, static_cast<std::uint32_t>(out.size() - directory));
    append(out, "SEFT");
    return out;
}

/// Huawei: blurred, the sharp picture, and a block of depth. `turn`: 0x10 to 0x13.
inline Bytes huaweiPhoto(int turn = 0x10) {
    Bytes out = colourJpeg(32, 24, 255);
    const Bytes sharp = colourJpeg();
    append(out, sharp);
    appendLittle(out, static_cast<std::uint32_t>(sharp.size()));
    append(out, std::string_view("edof\0\0\0\0", 8));
    Bytes head(64);
    head[3] = static_cast<std::byte>(turn);
    head[12] = std::byte{16};
    head[14] = std::byte{12};
    append(out, head);
    const auto codes = depthCodes();
    append(out, std::as_bytes(std::span(codes)));
    appendLittle(out, static_cast<std::uint32_t>(64 + codes.size()));
    append(out, std::string_view("DepthEn\0", 8));
    return out;
}

inline Bytes box(std::string_view type, ByteSpan content) {
    Bytes out;
    appendBig(out, static_cast<std::uint32_t>(8 + content.size()));
    append(out, type);
    append(out, content);
    return out;
}
inline Bytes joined(std::initializer_list<Bytes> parts) {
    Bytes out;
    for (const Bytes& part : parts) append(out, part);
    return out;
}
inline Bytes numbers(std::initializer_list<std::pair<std::uint32_t, int>> values) {
    Bytes out;
    for (const auto& [value, size] : values) appendBig(out, value, size);
    return out;
}

/// HEIC without pixels: picture 1 of 32x24 turned by `quarters` counter-clockwise, depth 2 of
/// 16x12 with Apple's XMP (3). `targets` of the depth: 1, or 2 as iOS 18 writes them. `colours`:
/// what is in boxes `colr` of the picture.
inline Bytes heicBoxes(int quarters = 0, int targets = 1, const std::vector<Bytes>& colours = {}) {
    const auto item = [](std::uint32_t id, std::uint32_t flags, std::string_view type,
                         std::string_view rest = std::string_view("\0", 1)) {
        Bytes content = numbers({{2, 1}, {flags, 3}, {id, 2}, {0, 2}});
        append(content, type);
        append(content, rest);
        return box("infe", content);
    };
    const std::string xmp = appleXmp();
    const Bytes items = joined({numbers({{0, 4}, {4, 2}}), item(1, 0, "hvc1"), item(2, 1, "hvc1"),
                                item(3, 1, "mime", std::string_view("\0application/rdf+xml\0", 21)),
                                item(4, 0, "tmap")});
    const auto size = [](std::uint32_t w, std::uint32_t h) {
        return box("ispe", numbers({{0, 4}, {w, 4}, {h, 4}}));
    };
    Bytes kind = numbers({{0, 4}});
    append(kind, std::string_view("urn:mpeg:hevc:2015:auxid:2\0", 27));
    const auto count = static_cast<std::uint32_t>(colours.size());
    Bytes all = joined({size(32, 24), size(16, 12), box("auxC", kind),
                        box("irot", numbers({{static_cast<std::uint32_t>(quarters), 1}}))});
    Bytes ofColour = numbers({{1, 2}, {2 + count, 1}, {1, 1}, {4, 1}});
    for (std::uint32_t i = 0; i < count; ++i) {
        all = joined({all, box("colr", colours[i])});
        appendBig(ofColour, 5 + i, 1);
    }
    const Bytes properties = box(
        "iprp", joined({box("ipco", all),
                        box("ipma", joined({numbers({{0, 4}, {2, 4}}), ofColour,
                                            numbers({{2, 2}, {3, 1}, {2, 1}, {3, 1}, {4, 1}})}))}));
    Bytes depthOf = numbers({{2, 2}, {static_cast<std::uint32_t>(targets), 2}, {1, 2}});
    if (targets > 1) appendBig(depthOf, 4, 2);
    const Bytes references = box("iref", joined({numbers({{0, 4}}), box("auxl", depthOf),
                                                 box("cdsc", numbers({{3, 2}, {1, 2}, {2, 2}}))}));
    const Bytes start = box("ftyp", joined({[] {
                                                Bytes b;
                                                append(b, "heic");
                                                return b;
                                            }(),
                                            numbers({{0, 4}}),
                                            [] {
                                                Bytes b;
                                                append(b, "mif1");
                                                return b;
                                            }()}));
    // The packet lies in idat.
    const Bytes locations = box("iloc", numbers({{1, 1},
                                                 {0, 3},
                                                 {0x44, 1},
                                                 {0, 1},
                                                 {1, 2},
                                                 {3, 2},
                                                 {1, 2},
                                                 {0, 2},
                                                 {1, 2},
                                                 {0, 4},
                                                 {static_cast<std::uint32_t>(xmp.size()), 4}}));
    const Bytes meta = box(
        "meta",
        joined({numbers({{0, 4}}), box("pitm", numbers({{0, 4}, {1, 2}})), box("iinf", items),
                references, properties, box("idat", std::as_bytes(std::span(xmp))), locations}));
    return joined({start, meta});
}

}  // namespace made
