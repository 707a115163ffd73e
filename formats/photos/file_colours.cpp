#include "formats/photos/file_colours.hpp"

#include <lcms2.h>
#include <libdeflate.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "formats/files/messages.hpp"
#include "formats/images/exif.hpp"
#include "formats/images/tiff_numbers.hpp"
#include "formats/images/webp_chunks.hpp"
#include "formats/photos/colour_profile.hpp"
#include "formats/photos/jpeg_segments.hpp"
#include "formats/photos/numbers.hpp"
#include "formats/photos/photo.hpp"
#include "lib/base/parallel.hpp"

namespace stx::photos {
namespace {

using namespace std::string_view_literals;

/// Of ITU-T H.273 and of gAMA: how codes become light.
struct Curve {
    bool srgb = true;
    double exponent = 1;  ///< of a code, where it is not sRGB's
};

/// The chromaticities of white and the primaries.
struct Points {
    cmsCIExyY white;
    cmsCIExyYTRIPLE primaries;
};
constexpr cmsCIExyY kD65{0.3127, 0.3290, 1};
constexpr Points kRec709{kD65, {{0.64, 0.33, 1}, {0.30, 0.60, 1}, {0.15, 0.06, 1}}};

Bytes profileOf(const Points& points, const Curve& curve) {
    struct FreeCurve {
        void operator()(cmsToneCurve* c) const { cmsFreeToneCurve(c); }
    };
    // IEC 61966-2-1: ((a x + b))^g from d on, c x below.
    constexpr double kSrgb[] = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
    constexpr int kSrgbKind = 4;
    if (!(curve.exponent > 0 && std::isfinite(curve.exponent))) return {};
    const std::unique_ptr<cmsToneCurve, FreeCurve> tone(
        curve.srgb ? cmsBuildParametricToneCurve(nullptr, kSrgbKind, kSrgb)
                   : cmsBuildGamma(nullptr, curve.exponent));
    if (!tone) return {};
    cmsToneCurve* const three[] = {tone.get(), tone.get(), tone.get()};
    const cmsHPROFILE made = cmsCreateRGBProfile(&points.white, &points.primaries, three);
    if (!made) return {};
    cmsUInt32Number size = 0;
    Bytes out;
    if (cmsSaveProfileToMem(made, nullptr, &size)) {
        out.resize(size);
        if (!cmsSaveProfileToMem(made, out.data(), &size)) out.clear();
    }
    cmsCloseProfile(made);
    return out;
}

FileColours madeOf(const Points& points, const Curve& curve) {
    FileColours out{profileOf(points, curve), {}};
    if (out.profile.empty())
        out.note = "what it says of its colours (gAMA, cHRM) is of none: they are taken for sRGB";
    return out;
}

/// Primaries of ITU-T H.273, table 2.
std::optional<Points> pointsOf(unsigned code) {
    switch (code) {
        case 1:
        case 2:  // not told
            return kRec709;
        case 5:
            return Points{kD65, {{0.64, 0.33, 1}, {0.29, 0.60, 1}, {0.15, 0.06, 1}}};
        case 6:
        case 7:
            return Points{kD65, {{0.630, 0.340, 1}, {0.310, 0.595, 1}, {0.155, 0.070, 1}}};
        case 9:
            return Points{kD65, {{0.708, 0.292, 1}, {0.170, 0.797, 1}, {0.131, 0.046, 1}}};
        case 12:
            return Points{kD65, {{0.680, 0.320, 1}, {0.265, 0.690, 1}, {0.150, 0.060, 1}}};
        default:
            return {};
    }
}

/// Transfer characteristics of ITU-T H.273, table 3: those of cameras (BT.601, 709, 2020) are shown
/// as sRGB, as films are.
std::optional<Curve> curveOf(unsigned code) {
    switch (code) {
        case 1:
        case 2:
        case 6:
        case 13:
        case 14:
        case 15:
            return Curve{};
        case 4:
            return Curve{false, 2.2};
        case 5:
            return Curve{false, 2.8};
        case 8:
            return Curve{false, 1};
        default:
            return {};
    }
}

Bytes inflated(ByteSpan zlib) {
    constexpr std::size_t kLargest = 1 << 20;  // as toSrgb() takes
    const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflate(
        libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
    Bytes out(kLargest);
    std::size_t size = 0;
    if (!inflate || libdeflate_zlib_decompress(inflate.get(), zlib.data(), zlib.size(), out.data(),
                                               out.size(), &size) != LIBDEFLATE_SUCCESS)
        size = 0;
    out.resize(size);
    return out;
}

/// Of chunks before the pixels; what is damaged counts as not there.
FileColours coloursOfPng(ByteSpan file) {
    ByteSpan cicp, iccp, gama, chrm;
    bool srgb = false;
    for (std::size_t at = 8; at + 12 <= file.size();) {
        const std::size_t size = bigEndian(file, at, 4);
        const std::string_view kind = textIn(file.subspan(at + 4, 4));
        if (file.size() - at - 12 < size || kind == "IDAT") break;
        const ByteSpan body = file.subspan(at + 8, size);
        if (kind == "cICP" && size == 4) cicp = body;
        if (kind == "iCCP") iccp = body;
        if (kind == "gAMA" && size == 4) gama = body;
        if (kind == "cHRM" && size == 32) chrm = body;
        srgb = srgb || kind == "sRGB";
        at += 12 + size;
    }
    if (!cicp.empty()) {
        const unsigned primaries = byteAt(cicp, 0), transfer = byteAt(cicp, 1);
        if (byteAt(cicp, 2) != 0 || byteAt(cicp, 3) != 1)
            return {{},
                    "its cICP says that its colours are of narrow range or not RGB, which is not "
                    "converted: they are taken for sRGB of full range"};
        return coloursOfCodes(primaries, transfer);
    }
    if (!iccp.empty()) {
        // A name, a zero, and the compression, which is 0.
        const std::size_t name = textIn(iccp).find('\0');
        if (name + 2 > iccp.size() || name == std::string_view::npos) return {};
        return {inflated(iccp.subspan(name + 2)), {}};
    }
    if (srgb || (gama.empty() && chrm.empty())) return {};
    constexpr double kUnit = 100000;
    constexpr std::uint32_t kSrgbGamma = 45455;  // it means sRGB's curve (11.3.2.3)
    Curve curve;
    if (!gama.empty()) {
        const std::uint32_t gamma = bigEndian(gama, 0, 4);
        curve = {gamma == kSrgbGamma, kUnit / gamma};
    }
    Points points = kRec709;
    if (!chrm.empty()) {
        const auto point = [&](std::size_t k) {
            return cmsCIExyY{bigEndian(chrm, 8 * k, 4) / kUnit,
                             bigEndian(chrm, 8 * k + 4, 4) / kUnit, 1};
        };
        points = {point(0), {point(1), point(2), point(3)}};
    }
    return madeOf(points, curve);
}

Bytes profileOfWebp(ByteSpan file) {
    Bytes profile;
    eachWebpChunk(file, "ICCP", [&](ByteSpan body) {
        profile.assign(body.begin(), body.end());
        return true;
    });
    return profile;
}

/// Tag 34675 of the first directory (ICC.1:2022, annex B.4).
Bytes profileOfTiff(ByteSpan file) {
    constexpr std::uint32_t kProfile = 34675;
    const TiffLayout* const layout = tiffLayoutOf(file);
    if (!layout) return {};
    const TiffNumbers numbers(file);
    const auto found =
        findTiffEntry(numbers, *layout, numbers.at(layout->start, layout->offset), kProfile);
    if (!found || found->number > file.size() || file.size() - found->number < found->count)
        return {};
    const ByteSpan body = file.subspan(found->number, found->count);
    return {body.begin(), body.end()};
}

/// The picture of a HEIF file, upright.
Result<Rgba8Image> heifAsShown(ByteSpan file, const Limits& limits, std::string& note) {
    STX_TRY(const auto photo, openPhoto(std::make_shared<const Bytes>(file.begin(), file.end()),
                                        {.needsDepth = false}, limits));
    Job job;
    job.limits = limits;
    return decodeColour(photo, note, job);
}

}  // namespace

FileColours coloursOfCodes(unsigned primaries, unsigned transfer) {
    const auto points = pointsOf(primaries);
    const auto curve = curveOf(transfer);
    if (points && curve) return madeOf(*points, *curve);
    return {{},
            fmt::format("its colours are coded by the primaries {} and the transfer function {} of "
                        "ITU-T H.273, which are not converted: they are taken for sRGB",
                        primaries, transfer)};
}

std::string madeSrgb(Rgba8Image& picture, const FileColours& colours) {
    return colours.note.empty() ? toSrgb(picture, colours.profile) : colours.note;
}

FileColours coloursOf(ByteSpan file) {
    if (isJpeg(file)) return {readJpegSegments(file).profile, {}};
    if (beginsWith(file, "\x89PNG\r\n\x1a\n"sv)) return coloursOfPng(file);
    if (isWebp(file)) return {profileOfWebp(file), {}};
    return {profileOfTiff(file), {}};
}

void fileToSrgb(Rgba8Image& picture, ByteSpan file, std::string& note) {
    note = madeSrgb(picture, coloursOf(file));
}

RgbaFloatImage srgbFloatFrom(const DecodedImage& image, ByteSpan file, std::string& note) {
    RgbaFloatImage out = rgbaFloatFrom(image);
    if (image.linear) return out;
    const FileColours colours = coloursOf(file);
    note = colours.note.empty() ? toSrgb(out, colours.profile) : colours.note;
    return out;
}

Rgba8Image srgb8From(const DecodedImage& image, ByteSpan file, std::string& note, Rgba8Loss* loss) {
    if (image.bits() == 8) {
        Rgba8Image out = rgba8From(image);
        fileToSrgb(out, file, note);
        return out;
    }
    if (image.linear || coloursOf(file).profile.empty()) {
        if (!image.linear) note = coloursOf(file).note;
        return rgba8From(image, loss);
    }
    if (loss) loss->add({.bits = image.bits()});
    const RgbaFloatImage fine = srgbFloatFrom(image, file, note);
    Rgba8Image out(fine.width(), fine.height());
    parallelFor(0, out.height(), [&](int y) {
        const auto from = fine.row(y);
        const auto to = out.row(y);
        for (std::size_t x = 0; x < to.size(); ++x) to[x] = glm::u8vec4(from[x] * 255.0f + 0.5f);
    });
    return out;
}

Result<Rgba8Image> decodeAsShown(ByteSpan file, std::string_view name, const Limits& limits,
                                 std::string& note, Rgba8Loss* loss) {
    if (isHeif(file)) return within(inQuotes(name), heifAsShown(file, limits, note));
    Rgba8Image stored;
    if (const auto info = probeImage(file); info && info->bits == 8) {
        STX_SET(stored, decodeRgba8(file, name, limits, loss));
        fileToSrgb(stored, file, note);
    } else {
        STX_TRY(auto image, decodeImage(file, name, limits));
        const std::string primaries = toRec709(image);
        stored = srgb8From(image, file, note, loss);
        if (note.empty()) note = primaries;
    }
    return turnedUpright(std::move(stored), readExif(file).orientation);
}

}  // namespace stx::photos
