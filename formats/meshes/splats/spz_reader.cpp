#include <algorithm>
#include <array>
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

float byteAt(const std::byte* from, std::size_t i) {
    return static_cast<float>(std::to_integer<int>(from[i]));
}

/// Version 3: which number is the largest, and nine bits with a sign of each other one.
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

}  // namespace

Result<Mesh> readSpz(ByteSpan file, Job& job) {
    if (!isGzip(file))
        return fail(ErrorCode::invalidInput,
                    "the file is not gzip; SPZ of the versions 2 and 3 is (splat-transform and spz "
                    "make version 3 of a newer one)");
    STX_TRY(Bytes bytes, gunzip(file, job.limits));
    if (bytes.size() < spz::kHeaderBytes || wordAt(bytes.data(), 4) != spz::kMagic)
        return fail(ErrorCode::invalidInput,
                    "the gzip file does not hold SPZ, whose content begins with 'NGSP'");
    const std::uint32_t version = wordAt(bytes.data() + 4, 4);
    if (version != 2 && version != 3)
        return fail(ErrorCode::unsupported, "the SPZ file is of version {}; 2 and 3 are read here",
                    version);
    const std::size_t count = wordAt(bytes.data() + 8, 4);
    const int degree = std::to_integer<int>(bytes[12]);
    const int fractionalBits = std::to_integer<int>(bytes[13]);
    if (degree > 3)
        return fail(ErrorCode::unsupported, "the splats have harmonics of degree {}; 3 is the most",
                    degree);
    if (fractionalBits >= spz::kFixedBits)
        return fail(ErrorCode::invalidInput, "{} of the {} bits of a coordinate are a fraction",
                    fractionalBits, spz::kFixedBits);
    const int coefficients = SplatCloud::coefficientCount(degree);
    const std::size_t rotationBytes = version == 3 ? 4 : 3;
    const std::size_t each = 16 + rotationBytes + 3 * static_cast<std::size_t>(coefficients);
    if ((bytes.size() - spz::kHeaderBytes) / each < count)
        return fail(ErrorCode::invalidInput,
                    "the header says {} splats of {} bytes, but only {} bytes follow", count, each,
                    bytes.size() - spz::kHeaderBytes);
    SplatCloud cloud;
    STX_CHECK(cloud.resize(count, degree, job.limits));
    const std::byte* const positions = bytes.data() + spz::kHeaderBytes;
    const std::byte* const alphas = positions + 9 * count;
    const std::byte* const colours = alphas + count;
    const std::byte* const scales = colours + 3 * count;
    const std::byte* const rotations = scales + 3 * count;
    const std::byte* const harmonics = rotations + rotationBytes * count;
    const double step = std::exp2(-fractionalBits);
    for (std::size_t i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) {
            const std::size_t at = 3 * i + static_cast<std::size_t>(k);
            // The sign is the highest of the 24 bits.
            const auto fixed = static_cast<std::int32_t>(wordAt(positions + 3 * at, 3) << 8) >> 8;
            cloud.positions[i][k] = static_cast<float>(fixed * step);
            cloud.scales[i][k] = std::exp(byteAt(scales, at) / 16.0f - 10.0f);
            const float f = (byteAt(colours, at) / 255.0f - 0.5f) / spz::kColourScale;
            cloud.colours[i][k] = 0.5f + static_cast<float>(spz::kDegree0) * f;
        }
        cloud.opacities[i] = byteAt(alphas, i) / 255.0f;
        cloud.rotations[i] = version == 3 ? smallestThree(wordAt(rotations + 4 * i, 4))
                                          : firstThree(rotations + 3 * i);
        const auto all = 3 * static_cast<std::size_t>(coefficients);
        for (std::size_t k = 0; k < all; ++k)
            cloud.setHarmonic(i, static_cast<int>(k / 3), static_cast<int>(k % 3),
                              (byteAt(harmonics, i * all + k) - 128.0f) / 128.0f);
    }
    bytes = {};
    return meshOfSplats(std::move(cloud), job);
}

}  // namespace stx
