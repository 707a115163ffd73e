// Phones that put the depth behind the end of the JPEG: Samsung (SEF) and Huawei (edof). Both are
// known from programs that read them, not from a description.

#include <array>

#include "formats/photos/numbers.hpp"
#include "formats/photos/readers.hpp"

namespace stx::photos {
namespace {

using namespace std::string_view_literals;

/// A block of Samsung's trailer.
struct SefBlock {
    unsigned type = 0;
    std::string_view name;
    ByteSpan content;
};

/// The blocks of the trailer that ends with SEFT: before it, the length of a directory of 12 bytes
/// a block, which count back from the directory.
Result<std::vector<SefBlock>> blocksOf(ByteSpan file) {
    constexpr std::size_t kEnd = 8, kHead = 12, kEntry = 12, kBlockHead = 8;
    const auto damaged = [](std::string_view what) {
        return fail(ErrorCode::invalidInput, "its Samsung trailer (SEFT) is damaged: {}", what);
    };
    const std::size_t length = littleEndian(file, file.size() - kEnd, 4);
    if (length < kHead || length > file.size() - kEnd)
        return damaged(fmt::format("its directory claims {} bytes", length));
    const std::size_t at = file.size() - kEnd - length;
    const ByteSpan directory = file.subspan(at, length);
    if (!beginsWith(directory, "SEFH")) return damaged("no directory (SEFH) is before it");
    const std::size_t count = littleEndian(directory, 8, 4);
    if (count > (length - kHead) / kEntry)
        return damaged(
            fmt::format("{} blocks are claimed in a directory of {} bytes", count, length));
    std::vector<SefBlock> blocks;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t entry = kHead + kEntry * i;
        const std::size_t back = littleEndian(directory, entry + 4, 4);
        const std::size_t size = littleEndian(directory, entry + 8, 4);
        if (back > at || size > back || size < kBlockHead)
            return damaged(fmt::format("block {} of {} bytes lies {} bytes before the directory",
                                       i + 1, size, back));
        const ByteSpan block = file.subspan(at - back, size);
        const std::size_t name = littleEndian(block, 4, 4);
        if (name > size - kBlockHead)
            return damaged(fmt::format("block {} has a name of {} bytes", i + 1, name));
        blocks.push_back({littleEndian(block, 2, 2), textIn(block.subspan(kBlockHead, name)),
                          block.subspan(kBlockHead + name)});
    }
    return blocks;
}

/// Where DualShot_Extra_Info has the depth's width and height, in numbers of 4 bytes, by its
/// version.
struct SizeAt {
    unsigned version, width, height;
};
constexpr std::array kSizes = {SizeAt{1, 9, 10}, SizeAt{3, 12, 13}, SizeAt{4, 17, 18},
                               SizeAt{5, 20, 19}, SizeAt{6, 22, 21}};

}  // namespace

Result<bool> readSamsung(const JpegPhoto& jpeg, Photo& photo) {
    const ByteSpan file = *jpeg.file;
    if (file.size() < 8 || !endsWith(file, "SEFT")) return false;
    STX_TRY(const auto blocks, blocksOf(file));
    const auto find = [&](unsigned type, std::string_view name) -> const SefBlock* {
        for (const SefBlock& block : blocks)
            if (block.type == type && block.name == name) return &block;
        return nullptr;
    };
    constexpr unsigned kPicture = 0x0001, kDepth = 0x0ab1, kInfo = 0x0ab3;
    const SefBlock* depth = find(kDepth, "DualShot_DepthMap_1");
    if (!depth) {
        for (const SefBlock& block : blocks)
            if (block.name.find("DepthMap") != std::string_view::npos)
                return fail(ErrorCode::unsupported,
                            "its depth is in Samsung's layout '{}', which is not read; "
                            "DualShot_DepthMap_1 is",
                            block.name);
        return false;  // Samsung writes such trailers for other things, too
    }
    photo.format = "Samsung";
    const SefBlock* info = find(kInfo, "DualShot_Extra_Info");
    if (!info || info->content.size() < 4)
        return fail(ErrorCode::invalidInput,
                    "its Samsung trailer (SEFT) is damaged: the depth's size (DualShot_Extra_Info) "
                    "is missing");
    const unsigned version = littleEndian(info->content, 0, 2);
    const SizeAt* at = nullptr;
    for (const SizeAt& known : kSizes)
        if (known.version == version) at = &known;
    if (!at)
        return fail(ErrorCode::unsupported,
                    "its Samsung trailer has version {} of DualShot_Extra_Info, which is not read; "
                    "1, 3, 4, 5 and 6 are",
                    version);
    const std::size_t width = 4ull * at->width, height = 4ull * at->height;
    const std::size_t last = std::max(width, height) + 4;
    const std::uint64_t w =
        last <= info->content.size() ? littleEndian(info->content, width, 4) : 0;
    const std::uint64_t h =
        last <= info->content.size() ? littleEndian(info->content, height, 4) : 0;
    if (w < 1 || h < 1 || w > depth->content.size() || w * h != depth->content.size())
        return fail(ErrorCode::invalidInput,
                    "its Samsung depth claims {}x{} pixels, but has {} bytes", w, h,
                    depth->content.size());
    photo.depth = {PhotoImage::Coding::grey, depth->content,     jpeg.file, 0,
                   static_cast<int>(w),      static_cast<int>(h)};
    photo.code.zeroIsNear = false;
    photo.accuracy = "relative";
    photo.coding = "white is near";
    if (const SefBlock* sharp = find(kPicture, "DualShot_1")) {
        photo.colourIs = jpeg.options.portrait ? "portrait" : "original";
        if (!jpeg.options.portrait)
            STX_SET(photo.colour,
                    embeddedPicture(sharp->content, jpeg.file, "its original picture"));
    }
    return true;
}

Result<bool> readHuawei(const JpegPhoto& jpeg, Photo& photo) {
    const ByteSpan file = *jpeg.file;
    constexpr auto kMark = "DepthEn\0"sv;
    constexpr std::size_t kEnd = 12, kHead = 64, kBefore = 12;
    if (file.size() < kEnd || !endsWith(file, kMark)) return false;
    photo.format = "Huawei";
    const auto damaged = [](std::string_view what) {
        return fail(ErrorCode::invalidInput, "its Huawei trailer (DepthEn) is damaged: {}", what);
    };
    const std::size_t length = littleEndian(file, file.size() - kEnd, 4);
    if (length < kHead || file.size() < kEnd + kBefore || length > file.size() - kEnd - kBefore)
        return damaged(
            fmt::format("its block claims {} bytes of a file of {}", length, file.size()));
    const std::size_t at = file.size() - kEnd - length;
    const ByteSpan block = file.subspan(at, length);
    const std::size_t w = littleEndian(block, 12, 2), h = littleEndian(block, 14, 2);
    if (w < 1 || h < 1 || w * h > length - kHead)
        return damaged(fmt::format("depth of {}x{} pixels in {} bytes", w, h, length - kHead));
    photo.depth = {PhotoImage::Coding::grey, block.subspan(kHead, w * h), jpeg.file, 0,
                   static_cast<int>(w),      static_cast<int>(h)};
    photo.code.zeroIsNear = true;
    photo.accuracy = "relative";
    photo.coding = "black is near";
    // How the phone was held: it is of both pictures.
    switch (byteAt(block, 3)) {
        case 0x11:
            photo.orientation = 8;
            break;
        case 0x12:
            photo.orientation = 3;
            break;
        case 0x13:
            photo.orientation = 6;
            break;
        default:
            break;
    }
    const ByteSpan before = file.subspan(at - kBefore, kBefore);
    if (!beginsWith(before.subspan(4), "edof\0\0\0\0"sv))
        return damaged("the mark 'edof' is not before its depth");
    const std::size_t jpegBytes = littleEndian(before, 0, 4);
    if (jpegBytes > at - kBefore)
        return damaged(fmt::format("a picture of {} bytes before byte {}", jpegBytes, at));
    photo.colourIs = jpeg.options.portrait ? "portrait" : "original";
    if (!jpeg.options.portrait)
        STX_SET(photo.colour, embeddedPicture(file.subspan(at - kBefore - jpegBytes, jpegBytes),
                                              jpeg.file, "its original picture"));
    return true;
}

}  // namespace stx::photos
