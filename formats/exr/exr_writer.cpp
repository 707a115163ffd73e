// OpenEXR files of scan lines and zip compression. The library writes the headers; chunks are
// compressed and put behind each other here, since the library's own zlib took most of the time.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfEnvmapAttribute.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <OpenEXR/ImfVersion.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <set>

#include "formats/exr/exr_adapt.hpp"
#include "formats/exr/exr_file.hpp"
#include "formats/exr/exr_streams.hpp"
#include "formats/exr/exr_zip.hpp"
#include "formats/files/shown_name.hpp"
#include "formats/files/source_date.hpp"
#include "lib/base/byte_planes.hpp"
#include "lib/base/parallel.hpp"

namespace stx {
namespace {

using exr::adapt;
using exr::kZipRows;

static_assert(std::endian::native == std::endian::little, "files are little-endian, as pixels are");

Imf::Header headerFrom(const ExrPart& part) {
    const Imath::Box2i display({0, 0}, {part.displayWidth - 1, part.displayHeight - 1});
    const Imath::Box2i data({part.originX, part.originY},
                            {part.originX + part.width - 1, part.originY + part.height - 1});
    Imf::Header header(display, data, static_cast<float>(part.pixelAspectRatio),
                       Imath::V2f(static_cast<float>(part.screenWindowCenter.x),
                                  static_cast<float>(part.screenWindowCenter.y)),
                       static_cast<float>(part.screenWindowWidth), Imf::INCREASING_Y,
                       Imf::ZIP_COMPRESSION);
    header.setType(Imf::SCANLINEIMAGE);
    if (!part.name.empty()) header.setName(part.name);
    if (!part.view.empty()) header.setView(part.view);
    Imf::addChromaticities(header, Imf::Chromaticities());
    for (const auto& c : part.channels) {
        header.channels().insert(
            c.name, Imf::Channel(c.type == ExrChannel::Type::half ? Imf::HALF : Imf::FLOAT));
    }
    for (const auto& [name, value] : part.attributes) {
        if (const auto* s = std::get_if<std::string>(&value)) {
            header.insert(name, Imf::StringAttribute(*s));
        } else if (const auto* i = std::get_if<std::int64_t>(&value); i && name == "envmap") {
            Imf::addEnvmap(header, static_cast<Imf::Envmap>(*i));  // a type of its own
        } else if (i) {
            header.insert(name, Imf::IntAttribute(static_cast<int>(*i)));
        } else if (const auto* d = std::get_if<double>(&value)) {
            header.insert(name, Imf::DoubleAttribute(*d));
        } else if (const auto* v2 = std::get_if<glm::dvec2>(&value)) {
            header.insert(name, Imf::V2dAttribute(Imath::V2d(v2->x, v2->y)));
        } else if (const auto* v3 = std::get_if<glm::dvec3>(&value)) {
            header.insert(name, Imf::V3dAttribute(Imath::V3d(v3->x, v3->y, v3->z)));
        } else if (const auto* m = std::get_if<glm::dmat4>(&value)) {
            Imath::M44f f;
            for (int r = 0; r < 4; ++r) {
                for (int c = 0; c < 4; ++c) f[r][c] = static_cast<float>((*m)[r][c]);
            }
            header.insert(name, Imf::M44fAttribute(f));
        }
    }
    if (part.envmap != ExrPart::Envmap::none)
        header.insert("envmap", Imf::EnvmapAttribute(part.envmap == ExrPart::Envmap::cube
                                                         ? Imf::ENVMAP_CUBE
                                                         : Imf::ENVMAP_LATLONG));
    if (const auto seconds = sourceDate()) {
        Imf::addCapDate(header, exrDate(*seconds));
        Imf::addUtcOffset(header, 0.0f);
    }
    return header;
}

bool hasLongNames(const Imf::Header& header) {
    constexpr std::size_t kLongest = 31;
    for (auto it = header.begin(); it != header.end(); ++it)
        if (std::strlen(it.name()) > kLongest) return true;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
        if (std::strlen(it.name()) > kLongest) return true;
    return false;
}

void putNumber(exr::OutputStream& stream, std::int32_t value) {
    char bytes[4];
    std::memcpy(bytes, &value, 4);
    stream.write(bytes, 4);
}

void putOffsets(exr::OutputStream& stream, const std::vector<std::uint64_t>& offsets) {
    // In pieces, since streams count in ints.
    constexpr std::size_t kPiece = 1 << 16;
    for (std::size_t i = 0; i < offsets.size(); i += kPiece) {
        const std::size_t count = std::min(kPiece, offsets.size() - i);
        stream.write(reinterpret_cast<const char*>(offsets.data() + i),
                     static_cast<int>(count * sizeof(std::uint64_t)));
    }
}

int chunksOf(int rows) {
    return (rows + kZipRows - 1) / kZipRows;
}

/// A channel of the rows that are written.
struct Channel {
    const ExrConstPixels* pixels;
    bool half;
    std::size_t words;   ///< 16-bit ones, of a row
    std::size_t at = 0;  ///< where it begins in a row of the file, words
    int same = -1;       ///< an earlier channel that has the same values
};

/// Row `y` as it is in the file: words of the channel itself, or in `room`.
const std::uint16_t* wordsOf(const Channel& channel, std::size_t width, int y,
                             std::vector<std::uint16_t>& room) {
    const ExrConstPixels& p = *channel.pixels;
    const std::size_t first = static_cast<std::size_t>(y) * width;
    if (channel.half && p.halves) return p.halves + first;
    const float* from = p.values + first * p.stride;
    if (channel.half)
        exr::halvesFrom(from, p.stride, {room.data(), width});
    else if (p.stride == 1)
        std::memcpy(room.data(), from, width * sizeof(float));
    else
        for (std::size_t x = 0; x < width; ++x)
            std::memcpy(room.data() + 2 * x, from + x * p.stride, sizeof(float));
    return room.data();
}

/// The bytes of `count` rows from `first` on, in the order of splitAndSubtract().
void splitRows(std::span<const Channel> channels, std::size_t width, int first, int count,
               std::uint8_t* split) {
    const std::size_t rowWords = channels.back().at + channels.back().words;
    const std::size_t half = rowWords * static_cast<std::size_t>(count);
    struct Ends {
        std::uint16_t first, last;
    };
    std::vector<Ends> ends(channels.size());
    std::vector<std::uint16_t> room(2 * width);
    std::uint16_t before = 128;  // so that the first byte stays as it is
    for (int y = 0; y < count; ++y) {
        std::uint8_t* const low = split + rowWords * static_cast<std::size_t>(y);
        for (std::size_t k = 0; k < channels.size(); ++k) {
            const Channel& channel = channels[k];
            std::uint8_t* const to = low + channel.at;
            if (channel.same >= 0) {
                ends[k] = ends[channel.same];
                const std::uint8_t* from = low + channels[channel.same].at;
                std::copy_n(from, channel.words, to);
                std::copy_n(from + half, channel.words, to + half);
                splitAndSubtract({&ends[k].first, 1}, before, to, to + half);
            } else {
                const std::uint16_t* words = wordsOf(channel, width, first + y, room);
                ends[k] = {words[0], words[channel.words - 1]};
                splitAndSubtract({words, channel.words}, before, to, to + half);
            }
            before = ends[k].last;
        }
    }
    // The first high byte follows the last low one.
    split[half] = static_cast<std::uint8_t>(split[half] - before);
}

}  // namespace

struct ExrWriter::Impl {
    std::string where;
    std::vector<ExrPart> parts;
    std::unique_ptr<exr::OutputStream> stream;
    std::uint64_t tables = 0;                         ///< where the tables of offsets begin
    std::vector<std::vector<std::uint64_t>> offsets;  ///< of each part's chunks

    /// From the beginning of the file on, up to the tables.
    void writeHeaders();
    void writeChunk(int part, int chunk, const Bytes& bytes);
    [[nodiscard]] Result<void> writeRows(int part, int top, int rows,
                                         const std::vector<ExrConstPixels>& pixels);
};

void ExrWriter::Impl::writeHeaders() {
    std::vector<Imf::Header> headers;
    bool longNames = false;
    const bool multiPart = parts.size() > 1;
    std::set<std::string> names;
    for (const auto& part : parts) {
        headers.push_back(headerFrom(part));
        if (multiPart) headers.back().setChunkCount(chunksOf(part.height));
        headers.back().sanityCheck(false, multiPart);
        longNames = longNames || hasLongNames(headers.back());
        if (multiPart && !names.insert(part.name).second)
            throw std::invalid_argument(fmt::format("two parts are called '{}'", part.name));
        if (part.displayWidth != parts[0].displayWidth ||
            part.displayHeight != parts[0].displayHeight)
            throw std::invalid_argument("parts differ in their display windows");
    }
    putNumber(*stream, Imf::MAGIC);
    putNumber(*stream, Imf::EXR_VERSION | (longNames ? Imf::LONG_NAMES_FLAG : 0) |
                           (multiPart ? Imf::MULTI_PART_FILE_FLAG : 0));
    for (const auto& header : headers) header.writeTo(*stream);
    if (multiPart) stream->write("", 1);  // an empty header ends them
}

void ExrWriter::Impl::writeChunk(int part, int chunk, const Bytes& bytes) {
    offsets[part][chunk] = stream->tellp();
    if (parts.size() > 1) putNumber(*stream, part);
    putNumber(*stream, parts[part].originY + chunk * kZipRows);
    putNumber(*stream, static_cast<std::int32_t>(bytes.size()));
    stream->write(reinterpret_cast<const char*>(bytes.data()), static_cast<int>(bytes.size()));
}

/// `top` is the first row of a chunk.
Result<void> ExrWriter::Impl::writeRows(int index, int top, int rows,
                                        const std::vector<ExrConstPixels>& pixels) {
    const ExrPart& part = parts[index];
    const auto width = static_cast<std::size_t>(part.width);
    std::map<std::string_view, Channel> byName;  // in the order of the file
    std::size_t rowBytes = 0;
    for (const auto& p : pixels) {
        const auto* channel = part.channel(p.channel);
        if (!channel)
            return failAt(where, ErrorCode::failed, "part {} has no channel '{}'", index,
                          p.channel);
        const bool half = channel->type == ExrChannel::Type::half;
        if (byName.emplace(p.channel, Channel{&p, half, half ? width : 2 * width}).second)
            rowBytes += width * (half ? 2 : 4);
    }
    if (byName.size() != part.channels.size())
        return failAt(where, ErrorCode::failed, "part {} has {} channels, and {} are given", index,
                      part.channels.size(), byName.size());
    if (rowBytes * kZipRows > INT32_MAX)
        return failAt(where, ErrorCode::unsupported,
                      "part {} has rows of {} bytes; a chunk of {} rows has less than 2 GiB", index,
                      rowBytes, kZipRows);

    std::vector<Channel> channels;
    std::map<const void*, int> halves;  // by their first value
    std::size_t at = 0;
    for (auto& [name, channel] : byName) {
        channel.at = at;
        at += channel.words;
        if (channel.half) {
            const void* first = channel.pixels->halves
                                    ? static_cast<const void*>(channel.pixels->halves)
                                    : channel.pixels->values;
            const auto [same, isNew] = halves.emplace(first, static_cast<int>(channels.size()));
            if (!isNew) channel.same = same->second;
        }
        channels.push_back(channel);
    }

    std::vector<Bytes> chunks(static_cast<std::size_t>(chunksOf(rows)));
    parallelFor(0, chunks.size(), [&](std::int64_t i) {
        const int first = static_cast<int>(i) * kZipRows;
        const int count = std::min(kZipRows, rows - first);
        const auto split = std::make_unique_for_overwrite<std::uint8_t[]>(
            rowBytes * static_cast<std::size_t>(count));
        splitRows(channels, width, first, count, split.get());
        chunks[i] =
            exr::zipChunk({split.get(), rowBytes * static_cast<std::size_t>(count)}, part.zipLevel);
    });
    for (std::size_t i = 0; i < chunks.size(); ++i)
        writeChunk(index, top / kZipRows + static_cast<int>(i), chunks[i]);
    return {};
}

ExrWriter::ExrWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ExrWriter::ExrWriter(ExrWriter&&) noexcept = default;
ExrWriter& ExrWriter::operator=(ExrWriter&&) noexcept = default;
ExrWriter::~ExrWriter() = default;

Result<ExrWriter> ExrWriter::create(OutputFile& file, const std::vector<ExrPart>& parts) {
    auto impl = std::make_unique<Impl>();
    STX_TRY(const std::filesystem::path path, file.temporaryPath());
    impl->where = fmt::format("cannot write '{}'", shownName(path).string());
    impl->parts = parts;
    STX_CHECK(adapt(ErrorCode::io, impl->where, [&]() -> Result<void> {
        impl->stream = std::make_unique<exr::OutputStream>(path);
        impl->writeHeaders();
        impl->tables = impl->stream->tellp();
        for (const ExrPart& part : impl->parts)
            impl->offsets.emplace_back(static_cast<std::size_t>(chunksOf(part.height)));
        for (const auto& table : impl->offsets) putOffsets(*impl->stream, table);
        return {};
    }));
    return ExrWriter(std::move(impl));
}

Result<void> ExrWriter::writePart(int index, const std::vector<ExrConstPixels>& pixels) {
    const auto width = static_cast<std::size_t>(impl_->parts[index].width);
    return writePart(index, [&](int y, int) {
        auto rows = pixels;
        for (auto& p : rows) {
            const std::size_t first = static_cast<std::size_t>(y) * width;
            if (p.halves)
                p.halves += first;
            else
                p.values += first * p.stride;
        }
        return rows;
    });
}

Result<void> ExrWriter::writePart(int index, const Block& blockOf) {
    return adapt(ErrorCode::io, impl_->where, [&]() -> Result<void> {
        // In blocks of whole chunks, so that what is not yet in the file needs little memory.
        constexpr int kBlock = 16 * kZipRows;
        const int height = impl_->parts[index].height;
        for (int y = 0; y < height; y += kBlock) {
            const int rows = std::min(kBlock, height - y);
            STX_CHECK(impl_->writeRows(index, y, rows, blockOf(y, rows)));
        }
        return {};
    });
}

Result<void> ExrWriter::finish(const std::vector<ExrPart>& parts) {
    STX_CHECK(adapt(ErrorCode::io, impl_->where, [&]() -> Result<void> {
        impl_->parts = parts;
        impl_->stream->seekp(0);
        impl_->writeHeaders();
        if (impl_->stream->tellp() != impl_->tables)
            return failAt(impl_->where, ErrorCode::failed,
                          "the headers take {} bytes at the end and took {} at the beginning",
                          impl_->stream->tellp(), impl_->tables);
        return {};
    }));
    return finish();
}

Result<void> ExrWriter::finish() {
    return adapt(ErrorCode::io, impl_->where, [&]() -> Result<void> {
        for (std::size_t i = 0; i < impl_->parts.size(); ++i) {
            if (std::count(impl_->offsets[i].begin(), impl_->offsets[i].end(), 0u) > 0)
                return failAt(impl_->where, ErrorCode::failed, "part {} was not written", i);
        }
        impl_->stream->seekp(impl_->tables);
        for (const auto& table : impl_->offsets) putOffsets(*impl_->stream, table);
        impl_->stream->finish();
        return {};
    });
}

}  // namespace stx
