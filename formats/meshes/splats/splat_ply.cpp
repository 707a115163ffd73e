#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>

#include "formats/meshes/readers.hpp"

namespace stx {
namespace {

constexpr float kDegree0 = 0.28209479177387814f;
constexpr const char* kNeeded[] = {"x",       "y",       "z",      "opacity", "scale_0",
                                   "scale_1", "scale_2", "rot_0",  "rot_1",   "rot_2",
                                   "rot_3",   "f_dc_0",  "f_dc_1", "f_dc_2"};

const PlyElement* verticesOf(const PlyHeader& header) {
    for (const PlyElement& element : header.elements)
        if (element.name == "vertex") return &element;
    return nullptr;
}

template <class T>
double load(const std::byte* at, bool swapped) {
    std::array<std::byte, sizeof(T)> raw;
    std::memcpy(raw.data(), at, sizeof(T));
    if (swapped) std::reverse(raw.begin(), raw.end());
    return static_cast<double>(std::bit_cast<T>(raw));
}

double valueAt(const std::byte* at, PlyType type, bool swapped) {
    switch (type) {
        case PlyType::int8:
            return load<std::int8_t>(at, swapped);
        case PlyType::uint8:
            return load<std::uint8_t>(at, swapped);
        case PlyType::int16:
            return load<std::int16_t>(at, swapped);
        case PlyType::uint16:
            return load<std::uint16_t>(at, swapped);
        case PlyType::int32:
            return load<std::int32_t>(at, swapped);
        case PlyType::uint32:
            return load<std::uint32_t>(at, swapped);
        case PlyType::float32:
            return load<float>(at, swapped);
        case PlyType::float64:
            break;
    }
    return load<double>(at, swapped);
}

/// Where a value of a vertex lies.
struct Place {
    std::size_t offset = 0;
    PlyType type = PlyType::float32;
};

}  // namespace

bool isSplatPly(const PlyHeader& header) {
    const PlyElement* vertices = verticesOf(header);
    if (!vertices) return false;
    return std::ranges::all_of(kNeeded, [&](std::string_view name) {
        return std::ranges::any_of(vertices->properties, [&](const PlyProperty& p) {
            return p.name == name && !p.isList;
        });
    });
}

Result<Mesh> readSplatPly(ByteSpan bytes, const PlyHeader& header, Job& job) {
    const PlyElement& vertices = *verticesOf(header);
    if (header.coding == PlyCoding::ascii)
        return fail(ErrorCode::unsupported,
                    "the splats are text; binary PLY is read (splat-transform rewrites it)");
    if (&vertices != &header.elements.front())
        return fail(ErrorCode::unsupported,
                    "element '{}' comes before the vertices; splats are expected first",
                    header.elements.front().name);
    std::map<std::string, Place, std::less<>> places;
    std::size_t stride = 0;
    for (const PlyProperty& p : vertices.properties) {
        if (p.isList)
            return fail(ErrorCode::invalidInput,
                        "the splats have a list, '{}'; numbers are expected", p.name);
        places[p.name] = {stride, p.type};
        stride += plySize(p.type);
    }
    int rest = 0;
    while (places.contains(fmt::format("f_rest_{}", rest))) ++rest;
    int degree = 0;
    while (degree < 3 && 3 * SplatCloud::coefficientCount(degree) < rest) ++degree;
    if (3 * SplatCloud::coefficientCount(degree) != rest)
        return fail(ErrorCode::invalidInput,
                    "the splats have {} values f_rest_*; 0, 9, 24 or 45 are expected (degree 0 to "
                    "3)",
                    rest);
    const auto count = static_cast<std::size_t>(vertices.count);
    const ByteSpan values = bytes.subspan(header.dataOffset);
    if (count > values.size() / stride)
        return fail(ErrorCode::invalidInput,
                    "the header says {} splats of {} bytes, but only {} bytes follow", count,
                    stride, values.size());
    SplatCloud cloud;
    STX_CHECK(cloud.resize(count, degree, job.limits));
    cloud.up = {0, -1, 0};
    std::vector<Place> at;
    for (const char* name : kNeeded) at.push_back(places.find(name)->second);
    std::vector<Place> atRest;
    for (int k = 0; k < rest; ++k)
        atRest.push_back(places.find(fmt::format("f_rest_{}", k))->second);
    const bool swapped =
        (header.coding == PlyCoding::bigEndian) != (std::endian::native == std::endian::big);
    const int coefficients = SplatCloud::coefficientCount(degree);
    for (std::size_t i = 0; i < count; ++i) {
        const std::byte* const splat = values.data() + i * stride;
        const auto get = [&](const Place& p) { return valueAt(splat + p.offset, p.type, swapped); };
        const auto number = [&](int k) { return get(at[static_cast<std::size_t>(k)]); };
        for (int k = 0; k < 3; ++k) {
            cloud.positions[i][k] = static_cast<float>(number(k));
            cloud.scales[i][k] = static_cast<float>(std::exp(number(4 + k)));
            cloud.colours[i][k] = static_cast<float>(0.5 + kDegree0 * number(11 + k));
        }
        cloud.opacities[i] = static_cast<float>(1.0 / (1.0 + std::exp(-number(3))));
        // w comes first.
        cloud.rotations[i] = glm::vec4(number(8), number(9), number(10), number(7));
        for (int k = 0; k < rest; ++k)
            cloud.setHarmonic(i, k % coefficients, k / coefficients,
                              static_cast<float>(get(atRest[static_cast<std::size_t>(k)])));
    }
    return meshOfSplats(std::move(cloud), job);
}

}  // namespace stx
