#include "formats/photos/jpeg_segments.hpp"

#include <lcms2_plugin.h>

#include <algorithm>
#include <cstring>

#include "formats/files/no_case.hpp"
#include "formats/photos/numbers.hpp"

namespace stx::photos {
namespace {

using namespace std::string_view_literals;

constexpr auto kExif = "Exif\0\0"sv;
constexpr auto kXmp = "http://ns.adobe.com/xap/1.0/\0"sv;
constexpr auto kExtension = "http://ns.adobe.com/xmp/extension/\0"sv;
constexpr auto kMpf = "MPF\0"sv;
constexpr auto kProfile = "ICC_PROFILE\0"sv;
constexpr std::size_t kGuidLength = 32;  ///< an MD5 in hexadecimal digits
constexpr std::size_t kMostExtended = 64u << 20;
constexpr std::size_t kMostPictures = 64;  ///< of a multi-picture file; phones write up to ten

/// Calls work(marker, content, at) for each segment up to the first scan's, with that; `at`: where
/// the content begins. Gives where it stopped: behind the scan's header, or at what is damaged.
template <class Work>
std::size_t eachSegment(ByteSpan file, const Work& work) {
    std::size_t at = 2;
    while (at + 4 <= file.size() && byteAt(file, at) == 0xff) {
        const unsigned marker = byteAt(file, at + 1);
        if (marker == 0xff) {  // filling
            ++at;
            continue;
        }
        if (marker == 0xd9) return at;
        const std::size_t length = bigEndian(file, at + 2, 2);
        if (length < 2 || length > file.size() - at - 2) return at;
        work(marker, file.subspan(at + 4, length - 2), at + 4);
        at += 2 + length;
        if (marker == 0xda) break;
    }
    return at;
}

/// In hexadecimal digits, by the one of Little CMS.
std::string md5Of(ByteSpan bytes) {
    const cmsHANDLE sum = cmsMD5alloc(nullptr);
    cmsMD5add(sum, reinterpret_cast<const cmsUInt8Number*>(bytes.data()),
              static_cast<cmsUInt32Number>(bytes.size()));
    cmsProfileID id = {};
    cmsMD5finish(&id, sum);
    return fmt::format("{:02X}", fmt::join(id.ID8, ""));
}

}  // namespace

bool isJpeg(ByteSpan bytes) {
    return beginsWith(bytes, "\xff\xd8\xff"sv);
}

JpegSegments readJpegSegments(ByteSpan file) {
    JpegSegments out;
    std::vector<ByteSpan> profile;
    std::size_t profileParts = 0;
    if (!isJpeg(file)) return out;
    (void)eachSegment(file, [&](unsigned marker, ByteSpan content, std::size_t at) {
        if (marker == 0xc3) out.lossless = true;
        if (marker == 0xe1 && beginsWith(content, kExif) && out.exif.empty()) {
            out.exif = content.subspan(kExif.size());
        } else if (marker == 0xe1 && beginsWith(content, kXmp) && out.xmp.empty()) {
            out.xmp = content.subspan(kXmp.size());
        } else if (marker == 0xe1 && beginsWith(content, kExtension)) {
            const ByteSpan rest = content.subspan(kExtension.size());
            if (rest.size() < kGuidLength + 8) return;
            out.extended.push_back(
                {std::string(textIn(rest.first(kGuidLength))), bigEndian(rest, kGuidLength, 4),
                 bigEndian(rest, kGuidLength + 4, 4), rest.subspan(kGuidLength + 8)});
        } else if (marker == 0xe2 && beginsWith(content, kMpf) && out.mpf.empty()) {
            out.mpf = content.subspan(kMpf.size());
            out.mpfAt = at + kMpf.size();
        } else if (marker == 0xe2 && beginsWith(content, kProfile) &&
                   content.size() > kProfile.size() + 2) {
            // Their number, from 1, and how many they are.
            const std::size_t number = byteAt(content, kProfile.size());
            profileParts = byteAt(content, kProfile.size() + 1);
            if (number < 1 || number > profileParts) return;
            profile.resize(profileParts);
            profile[number - 1] = content.subspan(kProfile.size() + 2);
        }
    });
    if (std::ranges::none_of(profile, &ByteSpan::empty))
        for (const ByteSpan part : profile)
            out.profile.insert(out.profile.end(), part.begin(), part.end());
    return out;
}

Result<Bytes> extendedXmp(const JpegSegments& segments, std::string_view guid) {
    std::vector<const JpegSegments::Part*> parts;
    for (const auto& part : segments.extended)
        if (equalNoCase(part.guid, guid)) parts.push_back(&part);
    if (parts.empty())
        return fail(ErrorCode::invalidInput,
                    "its XMP goes on in segments with the mark {}, but there is none", guid);
    const std::size_t total = parts.front()->total;
    if (total > kMostExtended)
        return fail(ErrorCode::invalidInput,
                    "its extended XMP claims {} bytes; at most {} are read", total, kMostExtended);
    std::ranges::sort(parts, {}, &JpegSegments::Part::offset);
    // Not more than the file itself has, whatever it claims.
    Bytes out;
    for (const auto* part : parts) {
        if (part->total != total || part->offset != out.size())
            return fail(ErrorCode::invalidInput,
                        "its extended XMP of {} bytes has no part at byte {}; the next is at {}",
                        total, out.size(), part->offset);
        out.insert(out.end(), part->bytes.begin(), part->bytes.end());
    }
    if (out.size() != total)
        return fail(ErrorCode::invalidInput, "its extended XMP has {} of {} bytes", out.size(),
                    total);
    // Adobe writes it in capitals; small letters are the same number.
    if (const std::string found = md5Of(out); !equalNoCase(found, guid))
        return fail(ErrorCode::invalidInput,
                    "its extended XMP has the MD5 {}, but the mark {}: it is damaged", found, guid);
    return out;
}

std::optional<std::size_t> jpegLength(ByteSpan file) {
    if (!isJpeg(file)) return {};
    std::size_t at = eachSegment(file, [](unsigned, ByteSpan, std::size_t) {});
    // In a scan's coded bytes 0xff is followed by 0 or is a restart marker's. Other markers are
    // segments between scans.
    while (at + 2 <= file.size()) {
        if (byteAt(file, at) != 0xff) {
            const auto rest = file.subspan(at);
            const void* next = std::memchr(rest.data(), 0xff, rest.size());
            if (!next) return {};
            at += static_cast<std::size_t>(static_cast<const std::byte*>(next) - rest.data());
            continue;
        }
        const unsigned marker = byteAt(file, at + 1);
        if (marker == 0xd9) return at + 2;
        if (marker == 0xff) {
            ++at;
        } else if (marker == 0 || (marker >= 0xd0 && marker <= 0xd7)) {
            at += 2;
        } else {
            if (at + 4 > file.size()) return {};
            at += 2 + std::max(2u, bigEndian(file, at + 2, 2));
        }
    }
    return {};
}

Result<std::vector<std::size_t>> mpfPictures(ByteSpan file, const JpegSegments& segments) {
    const ByteSpan tiff = segments.mpf;
    const auto cut = [] {
        return fail(ErrorCode::invalidInput,
                    "its list of pictures (MPF) is cut off or not a TIFF directory");
    };
    if (tiff.size() < 8) return cut();
    const bool little = beginsWith(tiff, "II*\0"sv);
    if (!little && !beginsWith(tiff, "MM\0*"sv)) return cut();
    const auto number = [&](std::size_t at, int size) {
        return little ? littleEndian(tiff, at, size) : bigEndian(tiff, at, size);
    };
    const std::size_t directory = number(4, 4);
    if (directory > tiff.size() || tiff.size() - directory < 2) return cut();
    const std::size_t count = number(directory, 2);
    if ((tiff.size() - directory - 2) / 12 < count) return cut();
    for (std::size_t i = 0; i < count; ++i) {
        constexpr unsigned kEntries = 0xb002;
        constexpr std::size_t kEntrySize = 16;
        const std::size_t at = directory + 2 + 12 * i;
        if (number(at, 2) != kEntries) continue;
        const std::size_t bytes = number(at + 4, 4), entries = number(at + 8, 4);
        const std::size_t pictures = std::min(bytes / kEntrySize, kMostPictures);
        if (entries > tiff.size() || (tiff.size() - entries) / kEntrySize < pictures) return cut();
        std::vector<std::size_t> found = {0};
        for (std::size_t k = 1; k < pictures; ++k) {
            const std::size_t offset = segments.mpfAt + number(entries + kEntrySize * k + 8, 4);
            if (offset >= file.size() || !isJpeg(file.subspan(offset)))
                return fail(ErrorCode::invalidInput,
                            "its list of pictures (MPF) has picture {} at byte {}, where {}", k + 1,
                            offset,
                            offset >= file.size()
                                ? fmt::format("the file of {} bytes has ended", file.size())
                                : std::string("no JPEG begins"));
            found.push_back(offset);
        }
        return found;
    }
    return cut();
}

}  // namespace stx::photos
