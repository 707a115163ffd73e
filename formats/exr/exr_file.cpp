#include "formats/exr/exr_file.hpp"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfEnvmapAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <system_error>

#include "formats/exr/exr_adapt.hpp"
#include "formats/exr/exr_chunks.hpp"
#include "formats/exr/exr_primaries.hpp"
#include "formats/exr/exr_streams.hpp"
#include "formats/exr/exr_zip.hpp"
#include "formats/files/file_stamp.hpp"
#include "lib/base/parallel.hpp"

namespace stx {

namespace {

using exr::adapt;

constexpr const char* kCompressions[] = {"none",  "rle", "zips", "zip",  "piz",
                                         "pxr24", "b44", "b44a", "dwaa", "dwab"};

template <class Attribute, class Value>
bool take(const Imf::Attribute& attribute, const std::string& name, ExrPart& part,
          const Value& convert) {
    const auto* typed = dynamic_cast<const Attribute*>(&attribute);
    if (typed) part.attributes[name] = convert(typed->value());
    return typed != nullptr;
}

template <class M>
glm::dmat4 matrixFrom(const M& from) {
    glm::dmat4 m;
    for (int r = 0; r < 4; ++r) {
        for (int c = 0; c < 4; ++c) m[r][c] = from[r][c];
    }
    return m;
}

void takeAttribute(const Imf::Attribute& a, const std::string& name, ExrPart& part) {
    const auto vec2 = [](const auto& v) { return glm::dvec2(v.x, v.y); };
    const auto vec3 = [](const auto& v) { return glm::dvec3(v.x, v.y, v.z); };
    const auto number = [](const auto& v) { return static_cast<double>(v); };
    const auto matrix = [](const auto& v) { return matrixFrom(v); };
    (void)(take<Imf::StringAttribute>(a, name, part, [](const std::string& v) { return v; }) ||
           take<Imf::EnvmapAttribute>(a, name, part,
                                      [](Imf::Envmap v) { return std::int64_t{v}; }) ||
           take<Imf::IntAttribute>(a, name, part, [](int v) { return std::int64_t{v}; }) ||
           take<Imf::FloatAttribute>(a, name, part, number) ||
           take<Imf::DoubleAttribute>(a, name, part, number) ||
           take<Imf::V2fAttribute>(a, name, part, vec2) ||
           take<Imf::V2dAttribute>(a, name, part, vec2) ||
           take<Imf::V3fAttribute>(a, name, part, vec3) ||
           take<Imf::V3dAttribute>(a, name, part, vec3) ||
           take<Imf::M44fAttribute>(a, name, part, matrix) ||
           take<Imf::M44dAttribute>(a, name, part, matrix));
}

void takePrimaries(const Imf::Header& header, ExrPart& part) {
    if (!Imf::hasChromaticities(header)) return;
    const Imf::Chromaticities c = Imf::chromaticities(header), rec709;
    const auto near = [](const Imath::V2f& a, const Imath::V2f& b) {
        return (a - b).length() < 2e-3f;
    };
    if (near(c.red, rec709.red) && near(c.green, rec709.green) && near(c.blue, rec709.blue) &&
        near(c.white, rec709.white))
        return;
    const auto vec2 = [](const Imath::V2f& v) { return glm::dvec2(v.x, v.y); };
    part.rec709FromRgb = rec709From({vec2(c.red), vec2(c.green), vec2(c.blue), vec2(c.white)});
    part.primariesNote = part.rec709FromRgb
                             ? "its chromaticities are not those of Rec. 709: colours are "
                               "converted to these"
                             : "its chromaticities are no primaries of a white: colours are taken "
                               "as they are";
}

ExrPart partFrom(const Imf::Header& header) {
    ExrPart part;
    if (header.hasName()) part.name = header.name();
    if (header.hasView()) part.view = header.view();
    const auto &data = header.dataWindow(), &display = header.displayWindow();
    part.originX = data.min.x - display.min.x;
    part.originY = data.min.y - display.min.y;
    part.width = data.max.x - data.min.x + 1;
    part.height = data.max.y - data.min.y + 1;
    part.displayWidth = display.max.x - display.min.x + 1;
    part.displayHeight = display.max.y - display.min.y + 1;
    part.pixelAspectRatio = header.pixelAspectRatio();
    part.screenWindowCenter = {header.screenWindowCenter().x, header.screenWindowCenter().y};
    part.screenWindowWidth = header.screenWindowWidth();
    part.deep = header.hasType() && !Imf::isImage(header.type());
    takePrimaries(header, part);
    if (const auto* envmap = header.findTypedAttribute<Imf::EnvmapAttribute>("envmap")) {
        if (envmap->value() == Imf::ENVMAP_LATLONG) part.envmap = ExrPart::Envmap::latlong;
        if (envmap->value() == Imf::ENVMAP_CUBE) part.envmap = ExrPart::Envmap::cube;
    }
    const int compression = header.compression();
    if (compression >= 0 && compression < 10) part.compression = kCompressions[compression];
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
        const auto type = it.channel().type;
        part.channels.push_back({it.name(),
                                 type == Imf::HALF    ? ExrChannel::Type::half
                                 : type == Imf::FLOAT ? ExrChannel::Type::float32
                                                      : ExrChannel::Type::uint32,
                                 it.channel().xSampling, it.channel().ySampling});
    }
    for (auto it = header.begin(); it != header.end(); ++it)
        takeAttribute(it.attribute(), it.name(), part);
    return part;
}

/// Sizes of windows are held against the limits before anything is computed from them.
Result<void> checkWindows(const Imf::Header& header, const Limits& limits, int index) {
    for (const auto& box : {header.dataWindow(), header.displayWindow()}) {
        const std::int64_t width = std::int64_t{box.max.x} - box.min.x + 1;
        const std::int64_t height = std::int64_t{box.max.y} - box.min.y + 1;
        if (width < 1 || height < 1 || width > limits.maxImageSide || height > limits.maxImageSide)
            return fail(ErrorCode::invalidInput,
                        "part {} has a window of {}x{} pixels; 1 to {} a side are read", index,
                        width, height, limits.maxImageSide);
        for (const int v : {box.min.x, box.min.y}) {
            if (std::abs(std::int64_t{v}) > (1 << 28))
                return fail(ErrorCode::invalidInput, "part {} has a window that starts at {}",
                            index, v);
        }
    }
    return {};
}

}  // namespace

const ExrChannel* ExrPart::channel(std::string_view wanted) const {
    for (const auto& c : channels) {
        if (c.name == wanted) return &c;
    }
    return nullptr;
}

struct ExrReader::Impl {
    /// From row `y` on; they begin where a chunk does.
    struct Rows {
        int y = 0, count = 0;
    };

    std::string where, name;
    ByteSpan bytes;
    Descriptor fd;
    std::uint64_t size = 0;
    FileStamp stamp;
    std::unique_ptr<Imf::IStream> stream;
    std::unique_ptr<Imf::MultiPartInputFile> file;
    std::vector<ExrPart> parts;
    std::vector<ExrChunks> chunks;  ///< of each part; empty when they were not found

    Result<void> readHeaders(const Limits& limits);
    /// Rows of a part of scan lines and zip compression, without the library, whose zlib would take
    /// most of the time. False, and anything in `pixels`, for other parts and for whatever is wrong
    /// with this one: the library says what.
    bool readZipped(int index, Rows at, const std::vector<ExrPixels>& pixels) const;
    bool readZippedChunk(int index, std::size_t chunk, Rows at,
                         const std::vector<ExrPixels>& pixels) const;
    exr::ChunkLayout layoutOf(int index) const;
    /// Rows of a chunk.
    std::int64_t stepOf(int index) const;
    Result<void> checkChunks(int index) const;
    Result<void> checkPlausible(int index) const;
    /// All rows, at most `rows` at a time, which is a multiple of a chunk's.
    Result<void> readRows(int index, int rows, const Place& place, const Take& take) const;
    Result<void> readAllRows(int index, int rows, const Place& place, const Take& take) const;
    bool readAt(std::uint64_t offset, void* to, std::size_t count) const {
        if (offset > size || count > size - offset) return false;
        if (!stream->isMemoryMapped())
            return ::pread(fd.get(), to, count, static_cast<off_t>(offset)) ==
                   static_cast<ssize_t>(count);
        std::memcpy(to, bytes.data() + offset, count);
        return true;
    }
};

bool ExrReader::Impl::readZippedChunk(int index, std::size_t chunk, Rows at,
                                      const std::vector<ExrPixels>& pixels) const {
    const ExrPart& part = parts[index];
    const auto width = static_cast<std::size_t>(part.width);
    const int lines = exr::linesOfChunk(part.compression);
    const int top = static_cast<int>(chunk) * lines;
    const int rows = std::min(lines, part.height - top);
    std::size_t rowBytes = 0;
    for (const auto& c : part.channels)
        rowBytes += width * (c.type == ExrChannel::Type::half ? 2 : 4);
    // Of several parts each chunk says whose it is; then its first line, its size.
    std::int32_t head[3] = {};
    const std::size_t numbers = parts.size() > 1 ? 3 : 2;
    const std::uint64_t offset = chunks[index].offsets[chunk];
    if (!readAt(offset, head, 4 * numbers)) return false;
    if (numbers == 3 && head[0] != index) return false;
    const int first = file->header(index).dataWindow().min.y + top;
    const std::int32_t stored = head[numbers - 1];
    if (head[numbers - 2] != first || stored < 1) return false;
    // Deflate gives at most 1032 bytes for one; memory is taken for no more.
    const std::size_t rawBytes = rowBytes * static_cast<std::size_t>(rows);
    if (static_cast<std::size_t>(stored) > rawBytes ||
        rawBytes / 1032 > static_cast<std::size_t>(stored))
        return false;
    const auto raw = std::make_unique_for_overwrite<std::uint16_t[]>(rawBytes / 2);
    const auto packed =
        std::make_unique_for_overwrite<std::byte[]>(static_cast<std::size_t>(stored));
    if (!readAt(offset + 4 * numbers, packed.get(), static_cast<std::size_t>(stored)) ||
        !exr::unzipChunk({packed.get(), static_cast<std::size_t>(stored)},
                         {reinterpret_cast<std::uint8_t*>(raw.get()), rawBytes}))
        return false;
    for (const auto& p : pixels) {
        std::size_t before = 0;  // 16-bit words of a row
        const ExrChannel* channel = nullptr;
        for (const auto& c : part.channels) {
            if (c.name == p.channel) {
                channel = &c;
                break;
            }
            before += width * (c.type == ExrChannel::Type::half ? 1 : 2);
        }
        if (!channel) continue;
        for (int y = 0; y < rows; ++y) {
            const std::uint16_t* from =
                raw.get() + static_cast<std::size_t>(y) * rowBytes / 2 + before;
            float* to = p.values + static_cast<std::size_t>(top - at.y + y) * width * p.stride;
            if (channel->type == ExrChannel::Type::half)
                exr::floatsFrom({from, width}, to, p.stride);
            else
                for (std::size_t x = 0; x < width; ++x)
                    std::memcpy(to + x * p.stride, from + 2 * x, sizeof(float));
        }
    }
    return true;
}

bool ExrReader::Impl::readZipped(int index, Rows at, const std::vector<ExrPixels>& pixels) const {
    const ExrPart& part = parts[index];
    const Imf::Header& header = file->header(index);
    if (header.hasTileDescription() || (header.hasType() && header.type() != Imf::SCANLINEIMAGE) ||
        (part.compression != "zip" && part.compression != "zips"))
        return false;
    const int lines = exr::linesOfChunk(part.compression);
    const auto count = static_cast<std::size_t>((part.height + lines - 1) / lines);
    if (static_cast<std::size_t>(index) >= chunks.size() || chunks[index].offsets.size() != count)
        return false;
    for (const auto& c : part.channels) {
        if (c.xSampling != 1 || c.ySampling != 1 || c.type == ExrChannel::Type::uint32)
            return false;
    }
    // Of a file that is damaged most chunks are not worth the work.
    std::atomic<bool> whole = true;
    parallelFor(at.y / lines, (at.y + at.count + lines - 1) / lines, [&](std::size_t i) {
        if (whole && !readZippedChunk(index, i, at, pixels)) whole = false;
    });
    return whole;
}

exr::ChunkLayout ExrReader::Impl::layoutOf(int index) const {
    const Imf::Header& header = file->header(index);
    exr::ChunkLayout layout;
    layout.firstX = header.dataWindow().min.x;
    layout.firstY = header.dataWindow().min.y;
    if (parts.size() > 1) layout.part = index;
    // The type decides where there is one, as for the library.
    if (header.hasType() ? header.type() == Imf::TILEDIMAGE : header.hasTileDescription()) {
        constexpr auto kMost = static_cast<unsigned>(std::numeric_limits<int>::max());
        layout.tileWidth = static_cast<int>(std::min(header.tileDescription().xSize, kMost));
        layout.tileHeight = static_cast<int>(std::min(header.tileDescription().ySize, kMost));
    }
    return layout;
}

std::int64_t ExrReader::Impl::stepOf(int index) const {
    const ExrPart& part = parts[index];
    const int tile = layoutOf(index).tileHeight;
    // A compression of later days: whatever its chunks are.
    const int lines = tile > 0 ? tile : exr::linesOfChunk(part.compression);
    return lines > 0 ? lines : part.height;
}

Result<void> ExrReader::Impl::checkChunks(int index) const {
    const auto at = static_cast<std::size_t>(index);
    return exr::checkChunks(parts[at], layoutOf(index),
                            at < chunks.size() ? chunks[at] : ExrChunks(),
                            [this](std::uint64_t offset, void* to, std::size_t count) {
                                return readAt(offset, to, count);
                            });
}

ExrReader::ExrReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ExrReader::ExrReader(ExrReader&&) noexcept = default;
ExrReader& ExrReader::operator=(ExrReader&&) noexcept = default;
ExrReader::~ExrReader() = default;

const std::vector<ExrPart>& ExrReader::parts() const {
    return impl_->parts;
}
const std::string& ExrReader::where() const {
    return impl_->where;
}

Result<void> ExrReader::Impl::readHeaders(const Limits& limits) {
    return adapt(ErrorCode::invalidInput, where, [&]() -> Result<void> {
        char head[8] = {};
        if (!readAt(0, head, 8) || std::memcmp(head, "\x76\x2f\x31\x01", 4) != 0)
            return failAt(where, ErrorCode::invalidInput, "it is not an OpenEXR file");
        if (auto ok =
                checkExrHeaders([this](std::uint64_t offset, void* to,
                                       std::size_t count) { return readAt(offset, to, count); },
                                size);
            !ok)
            return tl::unexpected(ok.error().at(where));
        // The table of offsets is rebuilt by nobody: a file without one is incomplete.
        file = std::make_unique<Imf::MultiPartInputFile>(*stream, 0, false);
        if (file->parts() < 1 || file->parts() > limits.maxViews)
            return failAt(where, ErrorCode::invalidInput, "it has {} parts; 1 to {} are read",
                          file->parts(), limits.maxViews);
        for (int i = 0; i < file->parts(); ++i) {
            STX_CHECK(within(where, checkWindows(file->header(i), limits, i)));
            parts.push_back(partFrom(file->header(i)));
        }
        chunks = exrChunksOfParts([this](std::uint64_t offset, void* to,
                                         std::size_t count) { return readAt(offset, to, count); },
                                  size);
        for (std::size_t i = 0; i < std::min(parts.size(), chunks.size()); ++i)
            parts[i].bytes = chunks[i].bytes;
        return {};
    });
}

Result<ExrReader> ExrReader::open(ByteSpan bytes, std::string_view name, const Limits& limits) {
    auto impl = std::make_unique<Impl>();
    impl->where = fmt::format("'{}'", name);
    impl->bytes = bytes;
    impl->size = bytes.size();
    impl->stream = std::make_unique<exr::MemoryStream>(bytes, impl->where.c_str());
    STX_CHECK(impl->readHeaders(limits));
    return ExrReader(std::move(impl));
}

Result<ExrReader> ExrReader::open(const std::filesystem::path& path, const Limits& limits) {
    auto impl = std::make_unique<Impl>();
    impl->where = fmt::format("'{}'", path.string());
    impl->name = path.string();
    impl->fd = Descriptor(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    struct stat info = {};
    if (impl->fd.get() < 0 || ::fstat(impl->fd.get(), &info) != 0)
        return fail(ErrorCode::io, "cannot open {}: {}", impl->where,
                    std::generic_category().message(errno));
    if (!S_ISREG(info.st_mode))
        return fail(ErrorCode::io, "cannot read {}: it is not a file", impl->where);
    impl->size = static_cast<std::uint64_t>(info.st_size);
    impl->stamp = FileStamp::of(info);
    impl->stream =
        std::make_unique<exr::FileStream>(impl->fd.get(), impl->size, impl->where.c_str());
    STX_CHECK(impl->readHeaders(limits));
    return ExrReader(std::move(impl));
}

Result<void> ExrReader::checkPlausible(int index) const {
    return impl_->checkPlausible(index);
}

Result<void> ExrReader::Impl::checkPlausible(int index) const {
    const ExrPart& part = parts[index];
    const auto values = static_cast<std::uint64_t>(part.width) * part.height * part.channels.size();
    const std::uint64_t stored = part.bytes ? part.bytes : size;
    // Deflate over runs gives at most some thousand for one; small claims hurt nobody.
    if (values <= (16u << 20) || values / 8192 <= stored) return {};
    return failAt(where, ErrorCode::invalidInput,
                  "part {} claims {}x{} pixels of {} channels, more than its {} bytes can hold",
                  index, part.width, part.height, part.channels.size(), stored);
}

Result<void> ExrReader::readPart(int index, const std::vector<ExrPixels>& pixels) const {
    const ExrPart& part = parts()[index];
    return impl_->readRows(
        index, part.height, [&](int, int) { return pixels; }, [](int, int) {});
}

Result<void> ExrReader::readPart(int index, const Place& place, const Take& take) const {
    const ExrPart& part = parts()[index];
    // Enough for all threads, but for wide pictures on many processors no large part of them.
    constexpr std::int64_t kMostPixels = 1 << 21;
    const std::int64_t step = impl_->stepOf(index);
    const std::int64_t most = std::max<std::int64_t>(kMostPixels / part.width / step, 1);
    const std::int64_t rows = step * std::min<std::int64_t>(4 * threadCount(), most);
    return impl_->readRows(index, static_cast<int>(std::min<std::int64_t>(rows, part.height)),
                           place, take);
}

Result<void> ExrReader::Impl::readRows(int index, int rows, const Place& place,
                                       const Take& take) const {
    auto done = readAllRows(index, rows, place, take);
    // What went wrong then is not what the file held.
    if (fd.get() >= 0 && !stamp.holds(fd.get())) return changedError(name);
    return done;
}

Result<void> ExrReader::Impl::readAllRows(int index, int rows, const Place& place,
                                          const Take& take) const {
    const ExrPart& part = parts[index];
    if (part.deep)
        return failAt(where, ErrorCode::unsupported,
                      "part {} has deep pixels, which are not supported", index);
    STX_CHECK(checkPlausible(index));
    return adapt(ErrorCode::invalidInput, where, [&]() -> Result<void> {
        // Only where it is needed: the library keeps lines of each part that it was asked for.
        std::optional<Imf::InputPart> in;
        auto window = file->header(index).dataWindow();
        const int top = window.min.y;
        const auto& channels = file->header(index).channels();
        bool zipped = true, checked = false;
        for (int y = 0; y < part.height; y += rows) {
            const Rows at{y, std::min(rows, part.height - y)};
            window.min.y = top + y;
            const auto pixels = place(at.y, at.count);
            Imf::FrameBuffer buffer;
            for (const auto& p : pixels) {
                const auto* channel = channels.findChannel(p.channel);
                if (!channel) {
                    const auto count = static_cast<std::size_t>(part.width) * at.count;
                    for (std::size_t i = 0; i < count; ++i) p.values[i * p.stride] = 0.0f;
                    continue;
                }
                if (channel->xSampling != 1 || channel->ySampling != 1)
                    return failAt(where, ErrorCode::unsupported,
                                  "channel '{}' of part {} is subsampled, which is not supported",
                                  p.channel, index);
                buffer.insert(p.channel, Imf::Slice::Make(Imf::FLOAT, p.values, window,
                                                          p.stride * sizeof(float),
                                                          p.stride * sizeof(float) * part.width));
            }
            if (buffer.begin() != buffer.end()) {
                zipped = zipped && readZipped(index, at, pixels);
                if (!zipped && !checked) {
                    STX_CHECK(within(where, checkChunks(index)));
                    checked = true;
                }
                if (!zipped) {
                    if (!in) in.emplace(*file, index);
                    in->setFrameBuffer(buffer);
                    in->readPixels(window.min.y, window.min.y + at.count - 1);
                }
            }
            take(at.y, at.count);
        }
        return {};
    });
}

}  // namespace stx
