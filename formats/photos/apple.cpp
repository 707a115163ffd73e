// Apple's depth: what its XMP says (in HEIC and JPEG alike), and JPEGs whose depth is a later
// picture of the file (MPF).

#include <cmath>

#include "formats/photos/readers.hpp"

namespace stx::photos {
namespace {

constexpr std::string_view kPixels = "http://ns.apple.com/pixeldatainfo/1.0/";
constexpr std::string_view kDepth = "http://ns.apple.com/depthData/1.0/";

/// depthData:IntrinsicMatrix, by columns, of a picture of the reference size.
std::optional<PhotoIntrinsics> matrixOf(const Xmp& xmp, glm::ivec2 stored) {
    const auto m = xmp.numbers(kDepth, "IntrinsicMatrix");
    const double w = xmp.number(kDepth, "IntrinsicMatrixReferenceWidth").value_or(0);
    const double h = xmp.number(kDepth, "IntrinsicMatrixReferenceHeight").value_or(0);
    // Of another shape it is of another picture.
    if (m.size() != 9 || !(w >= 1) || !(h >= 1) ||
        std::abs(w * stored.y - h * stored.x) > 0.01 * w * stored.y)
        return {};
    const double sx = stored.x / w, sy = stored.y / h;
    return PhotoIntrinsics{m[0] * sx, m[4] * sy, m[6] * sx, m[7] * sy};
}

}  // namespace

bool readAppleDepth(const Xmp& xmp, glm::ivec2 stored, Photo& photo, std::string& subtype) {
    subtype = xmp.text(kPixels, "AuxiliaryImageSubType").value_or("");
    const auto least = xmp.number(kPixels, "FloatMinValue");
    const auto most = xmp.number(kPixels, "FloatMaxValue");
    const std::string kind(xmp.text(kPixels, "AuxiliaryImageType").value_or(""));
    // A matte says 'depth', too, but has no range.
    if (!subtype.empty() || !least || !most || !(*least < *most)) return false;
    if (kind != "disparity" && kind != "depth") return false;
    photo.coding = kind;
    photo.code.inverse = kind == "disparity";
    photo.code.zero = *least;
    photo.code.one = *most;
    photo.accuracy =
        xmp.text(kDepth, "Accuracy").value_or("") == "absolute" ? "absolute" : "relative";
    photo.intrinsics = matrixOf(xmp, stored);
    return true;
}

Result<bool> readMpf(const JpegPhoto& jpeg, Photo& photo) {
    if (jpeg.segments.mpf.empty()) return false;
    const ByteSpan file = *jpeg.file;
    STX_TRY(const auto pictures, mpfPictures(file, jpeg.segments));
    for (std::size_t i = 1; i < pictures.size(); ++i) {
        // Sizes in the list may be wrong: the decoder finds the end.
        const ByteSpan picture = file.subspan(pictures[i]);
        const JpegSegments own = readJpegSegments(picture);
        if (own.xmp.empty()) continue;
        STX_TRY(const Xmp xmp, Xmp::parse(own.xmp));
        std::string subtype;
        if (photo.depth.coding == PhotoImage::Coding::none &&
            readAppleDepth(xmp, {photo.colour.width, photo.colour.height}, photo, subtype)) {
            STX_TRY(photo.depth, embeddedPicture(picture, jpeg.file, "its depth"));
        } else if (!subtype.empty()) {
            photo.mattes.push_back(subtype);
            // Damaged, it is as if it were not there: depth is what matters.
            if (auto matte = embeddedPicture(picture, jpeg.file, "its matte");
                matte && subtype == kPortraitMatte)
                photo.matte = std::move(*matte);
        } else if (xmp.text("http://ns.apple.com/HDRGainMap/1.0/", "HDRGainMapVersion")) {
            photo.others.emplace_back("a gain map");
        }
    }
    photo.format = "Apple JPEG";
    return photo.depth.coding != PhotoImage::Coding::none;
}

}  // namespace stx::photos
