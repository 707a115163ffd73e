#include "formats/photos/photo.hpp"

#include <algorithm>
#include <cmath>

#include "formats/images/exif.hpp"
#include "formats/images/images.hpp"
#include "formats/images/reader.hpp"
#include "formats/photos/heif_decode.hpp"
#include "formats/photos/numbers.hpp"
#include "formats/photos/readers.hpp"

namespace stx::photos {
namespace {

using namespace std::string_view_literals;

/// Depth that covers the picture may have another shape by the rounding of its size.
constexpr double kMostOtherShape = 0.01;

bool turnsSideways(int orientation) {
    return orientation >= 5 && orientation <= 8;
}

/// The intrinsics of the picture that is turned as EXIF says (exif.hpp).
PhotoIntrinsics turnedUpright(PhotoIntrinsics k, glm::ivec2 size, int orientation) {
    static constexpr int kQuarters[9] = {0, 0, 0, 2, 0, 1, 1, 3, 3};
    if (orientation < 2 || orientation > 8) return k;
    const int quarters = kQuarters[orientation];
    k = turned(k, size, quarters);
    if (quarters % 2 == 1) std::swap(size.x, size.y);
    const bool mirror =
        orientation == 2 || orientation == 4 || orientation == 5 || orientation == 7;
    return mirror ? mirrored(k, size, orientation != 4) : k;
}

/// What the packets of a JPEG say, as far as they can be read.
Result<JpegPhoto> readPackets(std::shared_ptr<const Bytes> file, const PhotoOptions& options) {
    JpegPhoto jpeg;
    jpeg.file = std::move(file);
    jpeg.options = options;
    jpeg.segments = readJpegSegments(*jpeg.file);
    if (jpeg.segments.xmp.empty()) return jpeg;
    STX_TRY(jpeg.xmp, Xmp::parse(jpeg.segments.xmp));
    const auto guid = jpeg.xmp->text("http://ns.adobe.com/xmp/note/", "HasExtendedXMP");
    if (!guid) return jpeg;
    const auto extended = [&]() -> Result<Xmp> {
        STX_TRY(const Bytes whole, extendedXmp(jpeg.segments, *guid));
        return Xmp::parse(whole);
    };
    // Only depth makes it matter.
    if (auto read = extended())
        jpeg.extended = std::move(*read);
    else
        jpeg.notExtended = read.error();
    return jpeg;
}

Result<void> readJpegDepth(const JpegPhoto& jpeg, Photo& photo, const Limits& limits) {
    bool found = false;
    STX_TRY(found, readSamsung(jpeg, photo));
    if (found) return {};
    STX_TRY(found, readHuawei(jpeg, photo));
    if (found) return {};
    STX_TRY(found, readDynamicDepth(jpeg, photo));
    if (found) return {};
    STX_TRY(found, readGDepth(jpeg, photo, limits));
    if (found) return {};
    STX_TRY(found, readMpf(jpeg, photo));
    if (found) return {};
    if (jpeg.xmp && jpeg.xmp->text("http://ns.adobe.com/hdr-gain-map/1.0/", "Version") &&
        photo.others.empty())
        photo.others.emplace_back("a gain map");
    // Xiaomi's blocks of depth, of which no description is known.
    constexpr std::size_t kTail = 64 << 10;
    const ByteSpan file = *jpeg.file;
    if (textIn(file.last(std::min(kTail, file.size()))).find("PMPD") != std::string_view::npos)
        return fail(ErrorCode::unsupported,
                    "its depth is in a layout of Xiaomi's (PMPD), which is not read");
    return {};
}

/// The error of a photo without depth.
tl::unexpected<Error> noDepth(const Photo& photo) {
    std::string what = fmt::format("{}", fmt::join(photo.others, " and "));
    if (!photo.mattes.empty())
        what += fmt::format(
            "{}{}", what.empty() ? "" : " and ",
            photo.mattes.size() == 1 ? "a matte of a portrait" : "mattes of a portrait");
    return fail(
        ErrorCode::invalidInput, "there is no depth in this picture{}; --depth FILE gives it one",
        what.empty() ? std::string()
                     : fmt::format("; {} {} in it", what,
                                   photo.others.size() + photo.mattes.size() > 1 ? "are" : "is"));
}

/// What a picture claims to be, against the limits.
Result<void> checkPicture(const PhotoImage& image, const Limits& limits) {
    if (image.coding == PhotoImage::Coding::none || image.width == 0) return {};
    // A HEIF item's own bytes may be few: HEVC codes flat areas with next to nothing.
    const std::size_t bytes =
        image.coding == PhotoImage::Coding::heif ? std::size_t{1} << 40 : image.bytes.size();
    return checkImageHeader({"other", image.width, image.height, 4, 8}, bytes, limits);
}

bool sameShape(glm::ivec2 a, glm::ivec2 b) {
    const double ratio = static_cast<double>(a.x) * b.y / (static_cast<double>(a.y) * b.x);
    // A pixel more or less is no other shape.
    const double rounding = 1.0 / std::min(b.x, b.y);
    return std::abs(ratio - 1) <= kMostOtherShape + rounding;
}

Result<void> checkPictures(Photo& photo, const Limits& limits) {
    STX_CHECK(checkPicture(photo.colour, limits));
    STX_CHECK(checkPicture(photo.depth, limits));
    const glm::ivec2 c = photo.uprightSize(photo.colour), d = photo.uprightSize(photo.depth),
                     m = photo.uprightSize(photo.matte);
    if (m.x > 0 &&
        (c.x == 0 || m.x > c.x || !sameShape(c, m) || !checkPicture(photo.matte, limits)))
        photo.matte = {};
    if (c.x == 0 || d.x == 0 || sameShape(c, d)) return {};
    return fail(ErrorCode::invalidInput,
                "its picture is {}x{}, but its depth {}x{}, which is another shape", c.x, c.y, d.x,
                d.y);
}

/// The values of a picture that is grey, whatever it is coded as. `what`: "its depth".
Result<PhotoDepthValues> greyOf(const DecodedImage& image, std::string_view what) {
    PhotoDepthValues out;
    out.bits = image.bits();
    if (out.bits > 16)
        return fail(ErrorCode::unsupported, "{} is coded as floats, which is not known", what);
    out.values = Image<float>(image.width, image.height);
    const auto step = static_cast<std::size_t>(image.channels);
    bool grey = true;
    std::visit(
        [&](const auto& values) {
            for (std::size_t i = 0; i < out.values.count(); ++i) {
                const auto* pixel = values.data() + i * step;
                grey = grey && (step < 3 || (pixel[0] == pixel[1] && pixel[0] == pixel[2]));
                out.values.data()[i] = static_cast<float>(pixel[0]);
            }
        },
        image.values);
    if (!grey)
        return fail(ErrorCode::invalidInput, "{} is a picture in colours; grey is expected", what);
    return out;
}

/// A grey picture of a photo, as it is stored.
Result<PhotoDepthValues> decodeGrey(const PhotoImage& from, std::string_view what,
                                    const Limits& limits) {
    STX_TRY(auto decoded, within(std::string(what), from.coding == PhotoImage::Coding::heif
                                                        ? decodeHeifItem(from, true, limits)
                                                        : decodeImage(from.bytes, what, limits)));
    return greyOf(decoded, what);
}

}  // namespace

void PhotoDepthCode::setRange(double near, double far) {
    const bool zeroNear = scaled() ? (inverse ? zero > one : zero < one) : zeroIsNear;
    const double n = inverse ? 1 / near : near, f = inverse ? 1 / far : far;
    zero = zeroNear ? n : f;
    one = zeroNear ? f : n;
}

void PhotoDepthCode::setRange(double near, double far, const Image<float>& values, int largest,
                              bool lossy) {
    // Levels by which JPEG moves ends of 0 and 255: up to 3 in Middlebury's aloe, books, dolls and
    // laundry reduced 4 and 5 times, qualities 85 and 95.
    constexpr float kMoved = 3;
    setRange(near, far);
    least = std::min(zero, one);
    if (values.empty()) return;
    const auto [low, high] = std::minmax_element(values.pixels().begin(), values.pixels().end());
    if (!(*low < *high)) return;
    first = lossy && *low <= kMoved ? 0 : *low / largest;
    last = lossy && *high >= largest - kMoved ? 1 : *high / largest;
}

void PhotoDepthCode::assumeRange(const Image<float>& values, int largest, bool lossy) {
    constexpr double kFarOverNear = 4;
    std::vector<float> sorted(values.pixels().begin(), values.pixels().end());
    if (sorted.empty()) return;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    inverse = true;
    setRange(1, kFarOverNear, values, largest, lossy);
    // 1 / distance of the median becomes 1.
    const double median = zero + (*middle / largest - first) / (last - first) * (one - zero);
    zero /= median;
    one /= median;
    least /= median;
}

void PhotoDepthCode::toDistances(Image<float>& values, const Camera& camera, int largest) const {
    const double slope = (one - zero) / (last - first);
    const double floor = least > 0 ? least : std::abs(slope) / largest / 2;
    for (int y = 0; y < values.height(); ++y)
        for (int x = 0; x < values.width(); ++x) {
            float& value = values.at(x, y);
            double a = zero + (value / largest - first) * slope;
            if (inverse) a = 1 / std::max(a, floor);
            if (alongRay) {
                const glm::dvec3 ray = camera.unproject(x + 0.5, y + 0.5, 1);
                a /= glm::length(ray);
            }
            value = static_cast<float>(a);
        }
}

glm::ivec2 Photo::uprightSize(const PhotoImage& image) const {
    const glm::ivec2 size(image.width, image.height);
    return turnsSideways(orientation) ? glm::ivec2(size.y, size.x) : size;
}

PhotoIntrinsics turned(PhotoIntrinsics k, glm::ivec2 size, int quarters) {
    for (int i = 0; i < quarters; ++i) {
        k = {k.fy, k.fx, size.y - k.cy, k.cx};
        std::swap(size.x, size.y);
    }
    return k;
}

PhotoIntrinsics mirrored(PhotoIntrinsics k, glm::ivec2 size, bool leftAndRight) {
    if (leftAndRight)
        k.cx = size.x - k.cx;
    else
        k.cy = size.y - k.cy;
    return k;
}

Result<PhotoImage> embeddedPicture(ByteSpan bytes, std::shared_ptr<const Bytes> owner,
                                   std::string_view what) {
    if (isJpeg(bytes) && readJpegSegments(bytes).lossless)
        return fail(ErrorCode::unsupported,
                    "{} is a lossless JPEG (as unfiltered depth of 16 bits is), which is not read",
                    what);
    const auto info = probeImage(bytes);
    if (!info && info.error().code == ErrorCode::unsupported)
        return fail(ErrorCode::invalidInput, "{} is neither a JPEG nor a PNG", what);
    if (!info) return fail(ErrorCode::invalidInput, "{}: {}", what, info.error().message);
    return PhotoImage{
        PhotoImage::Coding::file, bytes, std::move(owner), 0, info->width, info->height};
}

Result<Photo> openPhoto(const std::shared_ptr<const Bytes>& file, const PhotoOptions& options,
                        const Limits& limits) {
    Photo photo;
    photo.file = file;
    const ByteSpan bytes = *file;
    if (isHeif(bytes)) {
        STX_CHECK(readHeic(photo, limits));
    } else {
        photo.colour = {PhotoImage::Coding::file, bytes, file, 0, 0, 0};
        if (const auto info = probeImage(bytes)) {
            photo.colour.width = info->width;
            photo.colour.height = info->height;
        } else {
            const glm::ivec2 size = storedSizeOfTiff(bytes);
            photo.colour.width = size.x;
            photo.colour.height = size.y;
        }
        const ExifNotes exif = readExif(bytes);
        photo.orientation = exif.orientation;
        photo.focal35 = exif.focal35;
        photo.format = "picture";
        if (isJpeg(bytes) && options.needsDepth) {
            STX_TRY(const JpegPhoto jpeg, readPackets(file, options));
            STX_CHECK(readJpegDepth(jpeg, photo, limits));
        }
        if (photo.intrinsics)
            photo.intrinsics = turnedUpright(
                *photo.intrinsics, {photo.colour.width, photo.colour.height}, photo.orientation);
    }
    if (!options.needsDepth)
        photo.depth = {};
    else if (photo.depth.coding == PhotoImage::Coding::none)
        return noDepth(photo);
    STX_CHECK(checkPictures(photo, limits));
    return photo;
}

Result<Rgba8Image> decodeColour(const Photo& photo, std::string& profileNote, Job& job) {
    const PhotoImage& from = photo.colour;
    Rgba8Image picture;
    if (from.coding == PhotoImage::Coding::heif) {
        STX_TRY(const auto decoded, decodeHeifItem(from, false, job.limits));
        picture = rgba8From(decoded);
    } else {
        STX_TRY(picture, decodeRgba8(from.bytes, "picture", job.limits));
        fileToSrgb(picture, from.bytes, profileNote);
        return turnedUpright(std::move(picture), photo.orientation);
    }
    profileNote = madeSrgb(picture, photo.colours);
    return turnedUpright(std::move(picture), photo.orientation);
}

Result<PhotoDepthValues> decodeDepth(const Photo& photo, Job& job) {
    const PhotoImage& from = photo.depth;
    PhotoDepthValues out;
    if (from.coding == PhotoImage::Coding::grey) {
        out.values = Image<float>(from.width, from.height);
        std::ranges::transform(from.bytes, out.values.data(), [](std::byte b) {
            return static_cast<float>(std::to_integer<unsigned>(b));
        });
    } else {
        STX_TRY(out, decodeGrey(from, "its depth", job.limits));
    }
    out.values = turnedUpright(std::move(out.values), photo.orientation);
    return out;
}

Result<Image<std::uint8_t>> decodeMatte(const Photo& photo, Job& job) {
    STX_TRY(const PhotoDepthValues grey, decodeGrey(photo.matte, "its matte", job.limits));
    Image<std::uint8_t> out(grey.values.width(), grey.values.height());
    const float scale = 255.0f / static_cast<float>((1 << grey.bits) - 1);
    std::ranges::transform(grey.values.pixels(), out.data(), [scale](float v) {
        return static_cast<std::uint8_t>(std::lround(v * scale));
    });
    return turnedUpright(std::move(out), photo.orientation);
}

}  // namespace stx::photos
