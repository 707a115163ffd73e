#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <nlohmann/json.hpp>

#include "formats/files/deflate.hpp"
#include "formats/meshes/meshes.hpp"
#include "formats/meshes/splats/spz.hpp"
#include "lib/base/counted.hpp"
#include "lib/geometry/view_layout.hpp"
#include "lib/model/texture.hpp"
#include "lib/splats/transform.hpp"

namespace stx {
namespace {

using Json = nlohmann::ordered_json;

/// Opacities of 0 and 1 have no logit.
constexpr float kLeastOpacity = 1e-6f;
/// Sizes of 0 have no logarithm.
constexpr float kLeastSize = 1e-30f;

float coefficient(float colour) {
    return (colour - 0.5f) / static_cast<float>(spz::kDegree0);
}

float logSize(float size) {
    return std::log(std::max(size, kLeastSize));
}

/// Turns what is up in a cloud to where files of that kind have it.
void turnUp(SplatCloud& cloud, glm::vec3 habit, Job& job) {
    if (cloud.up == habit) return;
    const glm::dmat3 turn = turnOfUp(cloud.up, habit);
    // Of +Y the page of the formats says it.
    if (cloud.up != glm::vec3(0, 1, 0))
        job.note(
            fmt::format("the splats are turned, x y z to {}, so that {} is up, as it is in "
                        "such files",
                        turnedAxes(turn), habit.y < 0 ? "-Y" : "+Y"));
    transformSplats(cloud, 0, glm::dmat4(turn));
    cloud.up = habit;
}

Bytes encodePly(const SplatCloud& cloud) {
    const std::size_t count = cloud.positions.size();
    std::string header =
        fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", count);
    constexpr const char* kNames[] = {"x",      "y",       "z",       "f_dc_0",  "f_dc_1",
                                      "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                                      "rot_0",  "rot_1",   "rot_2",   "rot_3"};
    for (const char* name : kNames) header += fmt::format("property float {}\n", name);
    header += "end_header\n";
    Bytes bytes(header.size() + count * sizeof(float) * std::size(kNames));
    std::memcpy(bytes.data(), header.data(), header.size());
    std::byte* at = bytes.data() + header.size();
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 p = cloud.positions[i], s = cloud.scales[i], c = cloud.colours[i];
        const glm::vec4 q = cloud.rotations[i];
        const float opacity = std::clamp(cloud.opacities[i], kLeastOpacity, 1.0f - kLeastOpacity);
        const float values[] = {p.x,
                                p.y,
                                p.z,
                                coefficient(c.x),
                                coefficient(c.y),
                                coefficient(c.z),
                                std::log(opacity / (1.0f - opacity)),
                                logSize(s.x),
                                logSize(s.y),
                                logSize(s.z),
                                q.w,
                                q.x,
                                q.y,
                                q.z};
        static_assert(std::size(values) == std::size(kNames));
        std::memcpy(at, values, sizeof values);
        at += sizeof values;
    }
    return bytes;
}

std::byte byteOf(double value) {
    return static_cast<std::byte>(std::lround(std::clamp(value, 0.0, 255.0)));
}

void putWord(std::byte* at, std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) at[i] = static_cast<std::byte>(value >> (8 * i) & 255);
}

std::uint32_t smallestThree(glm::dvec4 q) {
    q = glm::normalize(q);
    std::uint32_t largest = 0;
    for (std::uint32_t k = 1; k < 4; ++k)
        if (std::abs(q[static_cast<int>(k)]) > std::abs(q[static_cast<int>(largest)])) largest = k;
    // q and -q are one rotation: the number that is left out is not below 0.
    if (q[static_cast<int>(largest)] < 0) q = -q;
    std::uint32_t packed = largest;
    for (std::uint32_t k = 0; k < 4; ++k) {
        if (k == largest) continue;
        const double value = q[static_cast<int>(k)];
        const auto magnitude = static_cast<std::uint32_t>(
            std::lround(std::min(1.0, std::abs(value) / spz::kMostOfSmall) * spz::kMagnitude));
        packed = packed << 10 | (value < 0 ? spz::kMagnitude + 1 : 0) | magnitude;
    }
    return packed;
}

Result<Bytes> encodeSpz(const SplatCloud& cloud, Job& job) {
    const std::size_t count = cloud.positions.size();
    float largest = 0;
    for (const glm::vec3 p : cloud.positions)
        largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    constexpr double kMost = (1 << (spz::kFixedBits - 1)) - 1;
    if (largest > kMost)
        return fail(ErrorCode::invalidInput,
                    "a splat is {:g} from 0 along an axis; the 24 bits of SPZ hold {:.0f} at most "
                    "(.ply and .glb hold any)",
                    largest, kMost);
    int fraction = 0;
    while (fraction < spz::kFixedBits - 1 && std::ldexp(largest, fraction + 1) <= kMost) ++fraction;
    Bytes bytes(spz::kHeaderBytes + 20 * count);
    putWord(bytes.data(), spz::kMagic, 4);
    putWord(bytes.data() + 4, 3, 4);
    putWord(bytes.data() + 8, static_cast<std::uint32_t>(count), 4);
    bytes[13] = static_cast<std::byte>(fraction);
    std::byte* const positions = bytes.data() + spz::kHeaderBytes;
    std::byte* const alphas = positions + 9 * count;
    std::byte* const colours = alphas + count;
    std::byte* const scales = colours + 3 * count;
    std::byte* const rotations = scales + 3 * count;
    std::size_t outside = 0;
    for (std::size_t i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) {
            const std::size_t at = 3 * i + static_cast<std::size_t>(k);
            const auto fixed = static_cast<std::int32_t>(
                std::lround(std::ldexp(static_cast<double>(cloud.positions[i][k]), fraction)));
            putWord(positions + 3 * at, static_cast<std::uint32_t>(fixed), 3);
            colours[at] =
                byteOf(255.0 * (0.5 + spz::kColourScale * coefficient(cloud.colours[i][k])));
            scales[at] = byteOf(16.0 * (logSize(cloud.scales[i][k]) + 10.0));
        }
        alphas[i] = byteOf(255.0 * cloud.opacities[i]);
        putWord(rotations + 4 * i, smallestThree(glm::dvec4(cloud.rotations[i])), 4);
        // The shortest axis of a disc may be any.
        glm::vec3 s = cloud.scales[i];
        const float middle = std::max(std::min(s.x, s.y), std::min(std::max(s.x, s.y), s.z));
        const float longest = std::max({s.x, s.y, s.z});
        if (logSize(middle) < -10.0f || logSize(longest) > 255.0f / 16.0f - 10.0f) ++outside;
    }
    job.note(fmt::format(
        "SPZ rounds positions by {:.2g} at most, colours by {:.2g} of 255 and sizes by {:.2g} %",
        std::ldexp(0.5, -fraction), 0.5 * spz::kDegree0 / spz::kColourScale,
        100 * std::expm1(0.5 / 16)));
    if (outside > 0)
        job.note(fmt::format(
            "{} of sizes that SPZ does not have (e^-10 to e^5.9) get the nearest that it has",
            counted(outside, "splat")));
    constexpr int kLevel = 6;
    return compressGzip(bytes, kLevel);
}

/// The arrays of a GLB file, one after the other.
class Arrays {
  public:
    Json accessors = Json::array(), views = Json::array();
    Bytes bytes;

    template <class T>
    std::size_t add(const std::vector<T>& values, const char* type, int component) {
        const auto raw = std::as_bytes(std::span(values));
        constexpr int kVertices = 34962;
        views.push_back({{"buffer", 0},
                         {"byteOffset", bytes.size()},
                         {"byteLength", raw.size()},
                         {"target", kVertices}});
        bytes.insert(bytes.end(), raw.begin(), raw.end());
        bytes.resize((bytes.size() + 3) / 4 * 4);
        accessors.push_back({{"bufferView", views.size() - 1},
                             {"componentType", component},
                             {"count", values.size()},
                             {"type", type}});
        return accessors.size() - 1;
    }
};

Result<Bytes> encodeGlb(const SplatCloud& cloud) {
    constexpr int kFloat = 5126, kUnsignedShort = 5123, kPoints = 0;
    Arrays arrays;
    Json attributes;
    const auto own = [](const char* name) {
        return fmt::format("KHR_gaussian_splatting:{}", name);
    };
    attributes["POSITION"] = arrays.add(cloud.positions, "VEC3", kFloat);
    glm::vec3 low = cloud.positions[0], high = low;
    for (const glm::vec3& p : cloud.positions) low = glm::min(low, p), high = glm::max(high, p);
    arrays.accessors[0]["min"] = {low.x, low.y, low.z};
    arrays.accessors[0]["max"] = {high.x, high.y, high.z};
    std::vector<glm::u16vec4> plain;
    std::vector<glm::vec3> coefficients;
    for (std::size_t i = 0; i < cloud.colours.size(); ++i) {
        const glm::vec3 c = cloud.colours[i];
        coefficients.emplace_back(coefficient(c.x), coefficient(c.y), coefficient(c.z));
        // Of viewers that know only points: linear light, as glTF has it.
        glm::vec4 light(glm::clamp(c, 0.0f, 1.0f), cloud.opacities[i]);
        for (int k = 0; k < 3 && !cloud.linear; ++k) light[k] = linearFromSrgb(light[k]);
        plain.emplace_back(light * 65535.0f + 0.5f);
    }
    const std::size_t colour = arrays.add(plain, "VEC4", kUnsignedShort);
    arrays.accessors[colour]["normalized"] = true;
    attributes["COLOR_0"] = colour;
    attributes[own("ROTATION")] = arrays.add(cloud.rotations, "VEC4", kFloat);
    attributes[own("SCALE")] = arrays.add(cloud.scales, "VEC3", kFloat);
    attributes[own("OPACITY")] = arrays.add(cloud.opacities, "SCALAR", kFloat);
    attributes[own("SH_DEGREE_0_COEF_0")] = arrays.add(coefficients, "VEC3", kFloat);
    const Json splats = {
        {"kernel", "ellipse"},
        {"colorSpace", cloud.linear ? "lin_rec709_display" : "srgb_rec709_display"},
        {"projection", "perspective"},
        {"sortingMethod", "cameraDistance"}};
    const Json primitive = {{"attributes", attributes},
                            {"mode", kPoints},
                            {"extensions", {{"KHR_gaussian_splatting", splats}}}};
    const Json root = {{"asset", {{"version", "2.0"}, {"generator", "stx"}}},
                       {"extensionsUsed", {"KHR_gaussian_splatting"}},
                       {"scene", 0},
                       {"scenes", {{{"nodes", {0}}}}},
                       {"nodes", {{{"name", "splats"}, {"mesh", 0}}}},
                       {"meshes", {{{"primitives", Json::array({primitive})}}}},
                       {"buffers", {{{"byteLength", arrays.bytes.size()}}}},
                       {"bufferViews", arrays.views},
                       {"accessors", arrays.accessors}};
    std::string text = root.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::uint64_t size = 28ull + text.size() + arrays.bytes.size();
    if (size > std::numeric_limits<std::uint32_t>::max())
        return fail(ErrorCode::invalidInput,
                    "the splats take {} bytes; a GLB file holds less than 2^32 (.ply holds any "
                    "number, --max-splats makes fewer)",
                    size);
    Bytes bytes(20);
    constexpr std::uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
    putWord(bytes.data(), kMagic, 4);
    putWord(bytes.data() + 4, 2, 4);
    putWord(bytes.data() + 8, static_cast<std::uint32_t>(size), 4);
    putWord(bytes.data() + 12, static_cast<std::uint32_t>(text.size()), 4);
    putWord(bytes.data() + 16, kJsonChunk, 4);
    bytes.reserve(size);
    const auto raw = std::as_bytes(std::span(text));
    bytes.insert(bytes.end(), raw.begin(), raw.end());
    std::byte chunk[8];
    putWord(chunk, static_cast<std::uint32_t>(arrays.bytes.size()), 4);
    putWord(chunk + 4, kBinaryChunk, 4);
    bytes.insert(bytes.end(), std::begin(chunk), std::end(chunk));
    bytes.insert(bytes.end(), arrays.bytes.begin(), arrays.bytes.end());
    return bytes;
}

}  // namespace

Result<void> writeSplats(const std::filesystem::path& path, SplatCloud cloud,
                         OutputFile::Options options, Job& job) {
    STX_CHECK(cloud.dropBroken(job));
    if (cloud.degree > 0) {
        job.note("harmonics are left out: each splat has one colour from all sides");
        cloud.degree = 0;
        cloud.harmonics = {};
    }
    auto ending = path.extension().string();
    for (char& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    turnUp(cloud, ending == ".ply" ? glm::vec3(0, -1, 0) : glm::vec3(0, 1, 0), job);
    // Arrays and the file that is made of them.
    STX_CHECK(job.limits.checkAllocation(cloud.positions.size(), ending == ".glb" ? 180 : 112,
                                         "the file of splats"));
    Result<Bytes> bytes =
        fail(ErrorCode::usage, "splats are written as .ply, .spz or .glb, not as '{}'",
             path.filename().string());
    if (ending == ".ply")
        bytes = encodePly(cloud);
    else if (ending == ".spz")
        bytes = encodeSpz(cloud, job);
    else if (ending == ".glb")
        bytes = encodeGlb(cloud);
    if (!bytes) return propagate(bytes);
    return writeFile(path, *bytes, options);
}

}  // namespace stx
