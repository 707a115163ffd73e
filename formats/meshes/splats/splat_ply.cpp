#include <algorithm>
#include <cmath>
#include <map>

#include "formats/meshes/ply_values.hpp"
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

/// Says what the file holds beside splats. Their normals mean nothing: INRIA's program writes
/// zeros.
void noteDropped(const PlyHeader& header, int rest, Job& job) {
    const auto names = unusedProperties(*verticesOf(header), [&](const PlyProperty& p) {
        const std::string_view n = p.name;
        return std::ranges::find(kNeeded, n) != std::end(kNeeded) || n == "nx" || n == "ny" ||
               n == "nz" || (n.starts_with("f_rest_") && rest > 0);
    });
    if (!names.empty()) job.note(fmt::format("dropped: PLY properties of vertices ({})", names));
    for (const PlyElement& element : header.elements)
        if (&element != verticesOf(header) && element.count > 0)
            job.note(fmt::format("dropped: PLY elements '{}' ({})", element.name, element.count));
}

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
    if (&vertices != &header.elements.front())
        return fail(ErrorCode::unsupported,
                    "element '{}' comes before the vertices; splats are expected first",
                    header.elements.front().name);
    std::map<std::string, std::size_t, std::less<>> places;
    std::size_t stride = 0;
    for (const PlyProperty& p : vertices.properties) {
        if (p.isList)
            return fail(ErrorCode::invalidInput,
                        "the splats have a list, '{}'; numbers are expected", p.name);
        places.emplace(p.name, static_cast<std::size_t>(&p - vertices.properties.data()));
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
    const std::size_t left = bytes.size() - header.dataOffset;
    if (header.coding != PlyCoding::ascii && count > left / stride)
        return fail(ErrorCode::invalidInput,
                    "the header says {} splats of {} bytes, but only {} bytes follow", count,
                    stride, left);
    SplatCloud cloud;
    STX_CHECK(cloud.resize(count, degree, job.limits));
    cloud.up = {0, -1, 0};
    std::vector<std::size_t> at, atRest;
    at.reserve(std::size(kNeeded));
    atRest.reserve(static_cast<std::size_t>(rest));
    for (const char* name : kNeeded) at.push_back(places.find(name)->second);
    for (int k = 0; k < rest; ++k)
        atRest.push_back(places.find(fmt::format("f_rest_{}", k))->second);
    const int coefficients = SplatCloud::coefficientCount(degree);
    PlyValues values(bytes, header.dataOffset, header.coding);
    std::vector<double> splat(vertices.properties.size());
    for (std::size_t i = 0; i < count; ++i) {
        values.beginElement();
        for (std::size_t k = 0; k < splat.size(); ++k) {
            const PlyProperty& p = vertices.properties[k];
            if (!values.next(p.type, splat[k]))
                return fail(
                    ErrorCode::invalidInput,
                    "splat {} of {} at byte {}: the file ends, or what follows is not a number", i,
                    count, values.offset());
        }
        values.endElement();
        const auto number = [&](std::size_t k) { return splat[at[k]]; };
        for (int k = 0; k < 3; ++k) {
            const auto part = static_cast<std::size_t>(k);
            cloud.positions[i][k] = static_cast<float>(number(part));
            cloud.scales[i][k] = static_cast<float>(std::exp(number(4 + part)));
            cloud.colours[i][k] = static_cast<float>(0.5 + kDegree0 * number(11 + part));
        }
        cloud.opacities[i] = static_cast<float>(1.0 / (1.0 + std::exp(-number(3))));
        // w comes first.
        cloud.rotations[i] = glm::vec4(number(8), number(9), number(10), number(7));
        for (int k = 0; k < rest; ++k)
            cloud.setHarmonic(i, k % coefficients, k / coefficients,
                              static_cast<float>(splat[atRest[k]]));
    }
    noteDropped(header, rest, job);
    return meshOfSplats(std::move(cloud), job);
}

}  // namespace stx
