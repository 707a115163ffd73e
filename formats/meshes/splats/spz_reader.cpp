#include <zstd.h>

#include <algorithm>
#include <cmath>

#include "formats/files/deflate.hpp"
#include "formats/meshes/readers.hpp"
#include "formats/meshes/splats/spz.hpp"

namespace stx {
namespace {

std::uint32_t wordAt(const std::byte* from, int bytes) {
    std::uint32_t value = 0;
    for (int i = 0; i < bytes; ++i) value |= std::to_integer<std::uint32_t>(from[i]) << (8 * i);
    return value;
}

std::uint64_t longAt(const std::byte* from) {
    return wordAt(from, 4) | static_cast<std::uint64_t>(wordAt(from + 4, 4)) << 32;
}

float byteAt(const std::byte* from, std::size_t i) {
    return static_cast<float>(std::to_integer<int>(from[i]));
}

/// Versions 3 and 4: which number is the largest, and nine bits with a sign of each other one.
glm::vec4 smallestThree(std::uint32_t packed) {
    const int largest = static_cast<int>(packed >> 30);
    glm::dvec4 q(0.0);
    double squares = 0;
    for (int k = 3; k >= 0; --k) {
        if (k == largest) continue;
        q[k] = spz::kMostOfSmall * (packed & spz::kMagnitude) / spz::kMagnitude;
        if (packed & (spz::kMagnitude + 1)) q[k] = -q[k];
        squares += q[k] * q[k];
        packed >>= 10;
    }
    q[largest] = std::sqrt(std::max(0.0, 1.0 - squares));
    return glm::vec4(q);
}

/// Version 2: x, y and z, of a quaternion whose w is not below 0.
glm::vec4 firstThree(const std::byte* from) {
    glm::vec3 v;
    for (int k = 0; k < 3; ++k) v[k] = byteAt(from, static_cast<std::size_t>(k)) / 127.5f - 1.0f;
    return {v, std::sqrt(std::max(0.0f, 1.0f - glm::dot(v, v)))};
}

/// What a header says, and where each attribute of all splats begins in `bytes`.
struct Content {
    std::uint32_t version = 0, flags = 0;
    std::size_t count = 0;
    int degree = 0, fractionalBits = 0;
    std::size_t rotationBytes = 4, harmonicBytes = 0;  ///< of a splat
    Bytes bytes;
    std::size_t begin = 0;

    [[nodiscard]] std::size_t eachBytes() const { return 16 + rotationBytes + harmonicBytes; }
};

/// The header's first 16 bytes, which all versions have.
Result<Content> readHeader(ByteSpan bytes, std::uint32_t least, std::uint32_t most) {
    Content out;
    out.version = wordAt(bytes.data() + 4, 4);
    if (out.version < least || out.version > most)
        return fail(ErrorCode::unsupported,
                    "the SPZ file is of version {}; 2, 3 (in gzip) and 4 (without) are read here",
                    out.version);
    out.count = wordAt(bytes.data() + 8, 4);
    out.degree = std::to_integer<int>(bytes[12]);
    out.fractionalBits = std::to_integer<int>(bytes[13]);
    out.flags = wordAt(bytes.data() + 14, 1);
    if (out.degree > 3)
        return fail(ErrorCode::unsupported, "the splats have harmonics of degree {}; 3 is the most",
                    out.degree);
    if (out.fractionalBits >= spz::kFixedBits)
        return fail(ErrorCode::invalidInput, "{} of the {} bits of a coordinate are a fraction",
                    out.fractionalBits, spz::kFixedBits);
    out.rotationBytes = out.version == 2 ? 3 : 4;
    out.harmonicBytes = 3 * static_cast<std::size_t>(SplatCloud::coefficientCount(out.degree));
    return out;
}

bool isSpz(ByteSpan bytes, std::size_t headerBytes) {
    return bytes.size() >= headerBytes && wordAt(bytes.data(), 4) == spz::kMagic;
}

Result<Content> unpackGzip(ByteSpan file, const Limits& limits) {
    STX_TRY(Bytes bytes, gunzip(file, limits));
    if (!isSpz(bytes, spz::kHeaderBytes))
        return fail(ErrorCode::invalidInput,
                    "the gzip file does not hold SPZ, whose content begins with 'NGSP'");
    STX_TRY(Content out, readHeader(bytes, 2, 3));
    out.begin = spz::kHeaderBytes;
    if ((bytes.size() - out.begin) / out.eachBytes() < out.count)
        return fail(ErrorCode::invalidInput,
                    "the header says {} splats of {} bytes, but only {} bytes follow", out.count,
                    out.eachBytes(), bytes.size() - out.begin);
    out.bytes = std::move(bytes);
    return out;
}

/// Version 4: each attribute is a stream of zstd, whose sizes a table has.
Result<Content> unpackZstd(ByteSpan file, const Limits& limits) {
    STX_TRY(Content out, readHeader(file, 4, 4));
    std::vector<std::size_t> sizes = {9, 1, 3, 3, out.rotationBytes};
    if (out.degree > 0) sizes.push_back(out.harmonicBytes);
    const auto streams = std::to_integer<std::size_t>(file[15]);
    const std::size_t table = wordAt(file.data() + 16, 4);
    if (streams != sizes.size() || table < spz::kLongHeaderBytes || table > file.size() ||
        (file.size() - table) / spz::kEntryBytes < streams)
        return fail(ErrorCode::invalidInput,
                    "the header says {} streams with a table at byte {}; {} are expected for "
                    "degree {}, within {} bytes",
                    streams, table, sizes.size(), out.degree, file.size());
    std::vector<ByteSpan> packed;
    std::size_t from = table + streams * spz::kEntryBytes;
    for (std::size_t i = 0; i < streams; ++i) {
        const std::byte* const entry = file.data() + table + i * spz::kEntryBytes;
        const std::uint64_t bytes = longAt(entry), size = longAt(entry + 8);
        const std::size_t left = file.size() - from, wanted = out.count * sizes[i];
        if (size != wanted || bytes > left || size / spz::kMostOfZstd > bytes)
            return fail(ErrorCode::invalidInput,
                        "stream {} of {} bytes, {} unpacked, does not fit: {} splats take {}, and "
                        "{} bytes are left of the file",
                        i, bytes, size, out.count, wanted, left);
        packed.push_back(file.subspan(from, bytes));
        from += bytes;
    }
    STX_CHECK(limits.checkAllocation(out.count, out.eachBytes(), "the splats' bytes"));
    out.bytes.resize(out.count * out.eachBytes());
    std::size_t to = 0;
    for (std::size_t i = 0; i < streams; ++i) {
        const std::size_t wanted = out.count * sizes[i];
        const std::size_t done =
            ZSTD_decompress(out.bytes.data() + to, wanted, packed[i].data(), packed[i].size());
        if (ZSTD_isError(done) || done != wanted)
            return fail(ErrorCode::invalidInput, "stream {} is damaged: zstd says {}", i,
                        ZSTD_isError(done) ? ZSTD_getErrorName(done) : "that it ends too early");
        to += wanted;
    }
    return out;
}

Result<Content> unpackSpz(ByteSpan file, const Limits& limits) {
    if (isGzip(file)) return unpackGzip(file, limits);
    if (isSpz(file, spz::kLongHeaderBytes)) return unpackZstd(file, limits);
    return fail(ErrorCode::invalidInput,
                "the file is neither gzip, as SPZ of the versions 2 and 3 is, nor begins with "
                "'NGSP', as version 4 does");
}

void noteFlags(std::uint32_t flags, Job& job) {
    if (flags & spz::kAntialiased)
        job.note(
            "the SPZ header asks for antialiased drawing, which makes splats below a pixel "
            "fainter; they are drawn without it and may look too large");
    if (flags & spz::kExtensions) job.note("dropped: the extensions of the SPZ file");
    if (const std::uint32_t others = flags & ~(spz::kAntialiased | spz::kExtensions))
        job.note(fmt::format("flags of the SPZ header that are not known here are ignored: {:#04x}",
                             others));
}

}  // namespace

Result<Mesh> readSpz(ByteSpan file, Job& job) {
    STX_TRY(Content content, unpackSpz(file, job.limits));
    const std::size_t count = content.count;
    FileSplats splats;
    STX_CHECK(splats.resize(count, content.degree, job.limits));
    SplatCloud& cloud = splats.cloud;
    const std::byte* const positions = content.bytes.data() + content.begin;
    const std::byte* const alphas = positions + 9 * count;
    const std::byte* const colours = alphas + count;
    const std::byte* const scales = colours + 3 * count;
    const std::byte* const rotations = scales + 3 * count;
    const std::byte* const harmonics = rotations + content.rotationBytes * count;
    const double step = std::exp2(-content.fractionalBits);
    for (std::size_t i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) {
            const std::size_t at = 3 * i + static_cast<std::size_t>(k);
            // The sign is the highest of the 24 bits.
            const auto fixed = static_cast<std::int32_t>(wordAt(positions + 3 * at, 3) << 8) >> 8;
            splats.centres[i][k] = fixed * step;
            cloud.scales[i][k] = std::exp(byteAt(scales, at) / 16.0f - 10.0f);
            const float f = (byteAt(colours, at) / 255.0f - 0.5f) / spz::kColourScale;
            cloud.colours[i][k] = 0.5f + static_cast<float>(spz::kDegree0) * f;
        }
        cloud.opacities[i] = byteAt(alphas, i) / 255.0f;
        cloud.rotations[i] = content.version == 2 ? firstThree(rotations + 3 * i)
                                                  : smallestThree(wordAt(rotations + 4 * i, 4));
        const std::size_t all = content.harmonicBytes;
        for (std::size_t k = 0; k < all; ++k)
            cloud.setHarmonic(i, static_cast<int>(k / 3), static_cast<int>(k % 3),
                              (byteAt(harmonics, i * all + k) - 128.0f) / 128.0f);
    }
    content.bytes = {};
    noteFlags(content.flags, job);
    return meshOfSplats(std::move(splats), job);
}

}  // namespace stx
