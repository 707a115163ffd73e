#include "formats/images/oiio/tiff.hpp"

#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string_view>

#include "formats/images/tiff_numbers.hpp"

namespace stx::codecs {
namespace {

struct Kept {
    std::string first;
    TIFFErrorHandler outerError = nullptr, outerWarning = nullptr;
};

Kept& kept() {
    static Kept one;
    return one;
}

void keep(const char* format, std::va_list values) {
    if (!kept().first.empty()) return;
    std::array<char, 512> text{};
    std::vsnprintf(text.data(), text.size(), format, values);
    kept().first = text.data();
}

void onError(const char* module, const char* format, std::va_list values) {
    std::va_list again;
    va_copy(again, values);
    keep(format, again);
    va_end(again);
    if (kept().outerError) kept().outerError(module, format, values);
}

/// The decoders of JPEG, PackBits and fax warn of pixels that they made up or left out.
void onWarning(const char* module, const char* format, std::va_list values) {
    const std::string_view from = module ? module : "";
    const std::string_view what = format;
    const bool madeUp = from == "JPEGLib" || from == "PackBitsDecode" ||
                        what.find("Premature EOF") != what.npos ||
                        what.find("(got %") != what.npos;  // a row of another length
    std::va_list again;
    va_copy(again, values);
    if (madeUp) keep(format, again);
    va_end(again);
    if (kept().outerWarning) kept().outerWarning(module, format, values);
}

/// Turns each colour of a palette into one that the library, which divides by 257, makes its upper
/// eight bits of; other writers multiply these by 256.
void repairPalette(const TiffNumbers& numbers, const TiffEntry& palette,
                   std::vector<std::byte>& file) {
    if (palette.number > file.size() || palette.count > (file.size() - palette.number) / 2) return;
    for (std::uint64_t i = 0; i < palette.count; ++i) {
        const std::uint64_t at = palette.number + 2 * i;
        numbers.write(file.data() + at, (numbers.at(at, 2) >> 8) * 257, 2);
    }
}

}  // namespace

TiffErrors::TiffErrors() {
    kept().first.clear();
    kept().outerError = TIFFSetErrorHandler(onError);
    kept().outerWarning = TIFFSetWarningHandler(onWarning);
}

TiffErrors::~TiffErrors() {
    TIFFSetErrorHandler(kept().outerError);
    TIFFSetWarningHandler(kept().outerWarning);
}

const std::string& TiffErrors::first() {
    return kept().first;
}

bool endsWhole(const char* path) {
    // Not mapped: a file that is too short would end the process.
    const std::unique_ptr<TIFF, void (*)(TIFF*)> file(TIFFOpen(path, "rm"), &TIFFClose);
    if (!file) return false;
    const std::uint32_t strips = TIFFNumberOfStrips(file.get());
    const tmsize_t size = TIFFStripSize(file.get());
    if (strips == 0 || size <= 0) return false;
    std::vector<std::byte> last(static_cast<std::size_t>(size));
    return TIFFReadEncodedStrip(file.get(), strips - 1, last.data(), size) > 0;
}

std::vector<std::byte> repairedTiff(std::span<const std::byte> file) {
    constexpr std::uint64_t kBitsPerSample = 258, kCompression = 259, kSamplesPerPixel = 277,
                            kColorMap = 320;
    constexpr std::uint64_t kShort = 3, kAdobeDeflate = 8, kDeflate = 32946;
    const TiffNumbers numbers(file);
    const TiffLayout* const found = tiffLayoutOf(file);
    if (!found) return {};
    const TiffLayout& layout = *found;
    const std::uint64_t directory = numbers.at(layout.start, layout.offset);
    const std::uint64_t count = numbers.at(directory, layout.count);
    if (directory > file.size() || count == 0 || count > file.size() / layout.entry) return {};
    const std::uint64_t first = directory + layout.count, end = first + count * layout.entry;
    const std::size_t valueAt = layout.valueAt();
    if (end + layout.offset > file.size() || file.size() > 0xffff0000u) return {};
    std::uint64_t before = 0, deflated = 0;  // entries of smaller tags, which are in order
    bool hasBits = false, several = false;
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint64_t entry = first + i * layout.entry;
        const std::uint64_t tag = numbers.at(entry, 2), value = numbers.at(entry + valueAt, 2);
        hasBits = hasBits || tag == kBitsPerSample;
        // Of several samples the tag would be a list; nobody leaves that out.
        several = several || (tag == kSamplesPerPixel && value != 1);
        if (tag == kCompression && value == kAdobeDeflate) deflated = entry + valueAt;
        if (tag < kBitsPerSample) before = i + 1;
    }
    const bool addBits = !hasBits && !several;
    const auto palette = findTiffEntry(numbers, layout, directory, kColorMap);
    if (!addBits && deflated == 0 && !palette) return {};
    std::vector<std::byte> repaired(file.begin(), file.end());
    if (palette) repairPalette(numbers, *palette, repaired);
    if (deflated != 0) numbers.write(repaired.data() + deflated, kDeflate, 2);
    if (!addBits) return repaired;
    // The directory is written anew behind the rest, to which its entries go on pointing.
    const std::vector<std::byte> old(
        repaired.begin() + static_cast<std::ptrdiff_t>(directory),
        repaired.begin() + static_cast<std::ptrdiff_t>(end + layout.offset));
    const std::size_t at = file.size() + file.size() % 2;
    repaired.resize(at + old.size() + layout.entry);
    numbers.write(repaired.data() + layout.start, at, layout.offset);
    std::byte* const to = repaired.data() + at;
    const std::size_t upTo = layout.count + before * layout.entry;
    std::copy(old.begin(), old.begin() + static_cast<std::ptrdiff_t>(upTo), to);
    std::copy(old.begin() + static_cast<std::ptrdiff_t>(upTo), old.end(), to + upTo + layout.entry);
    numbers.write(to, count + 1, layout.count);
    numbers.write(to + upTo, kBitsPerSample, 2);
    numbers.write(to + upTo + 2, kShort, 2);
    numbers.write(to + upTo + 4, 1, layout.offset);
    numbers.write(to + upTo + valueAt, 1, 2);
    return repaired;
}

}  // namespace stx::codecs
