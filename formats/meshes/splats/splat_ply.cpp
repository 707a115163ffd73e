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

/// Begins the names of harmonics; a number from 0 on follows.
constexpr std::string_view kRest = "f_rest_";

const PlyElement* verticesOf(const PlyHeader& header) {
    for (const PlyElement& element : header.elements)
        if (element.name == "vertex") return &element;
    return nullptr;
}

bool hasNumber(const PlyElement& element, std::string_view name) {
    return std::ranges::any_of(element.properties,
                               [&](const PlyProperty& p) { return p.name == name && !p.isList; });
}

using Places = std::map<std::string, std::size_t, std::less<>>;

/// The places of the harmonics among the properties, by their numbers.
Result<std::vector<std::size_t>> placesOfRest(const Places& places) {
    const auto count = static_cast<std::size_t>(std::ranges::count_if(
        places, [](const auto& place) { return place.first.starts_with(kRest); }));
    if (count != 0 && count != 9 && count != 24 && count != 45)
        return fail(ErrorCode::invalidInput,
                    "the splats have {} values f_rest_*; 0, 9, 24 or 45 are expected (degree 0 to "
                    "3)",
                    count);
    std::vector<std::size_t> out;
    for (std::size_t k = 0; k < count; ++k) {
        const auto place = places.find(fmt::format("{}{}", kRest, k));
        if (place == places.end())
            return fail(ErrorCode::invalidInput,
                        "the splats have {} values f_rest_*, but no f_rest_{}; f_rest_0 to "
                        "f_rest_{} are expected",
                        count, k, count - 1);
        out.push_back(place->second);
    }
    return out;
}

/// Says what the file holds beside splats. Their normals mean nothing: INRIA's program writes
/// zeros.
void noteDropped(const PlyHeader& header, Job& job) {
    const auto names = unusedProperties(*verticesOf(header), [&](const PlyProperty& p) {
        const std::string_view n = p.name;
        return std::ranges::find(kNeeded, n) != std::end(kNeeded) || n == "nx" || n == "ny" ||
               n == "nz" || n.starts_with(kRest);
    });
    if (!names.empty()) job.note(fmt::format("dropped: PLY properties of vertices ({})", names));
    for (const PlyElement& element : header.elements)
        if (&element != verticesOf(header) && element.count > 0)
            job.note(fmt::format("dropped: PLY elements '{}' ({})", element.name, element.count));
}

}  // namespace

bool isSplatPly(const PlyHeader& header) {
    const PlyElement* vertices = verticesOf(header);
    return vertices && std::ranges::all_of(kNeeded, [&](std::string_view name) {
               return hasNumber(*vertices, name);
           });
}

bool isPackedSplatPly(const PlyHeader& header) {
    const PlyElement* vertices = verticesOf(header);
    return vertices && hasNumber(*vertices, "packed_position");
}

Result<Mesh> readSplatPly(ByteSpan bytes, const PlyHeader& header, Job& job) {
    const PlyElement& vertices = *verticesOf(header);
    if (&vertices != &header.elements.front())
        return fail(ErrorCode::unsupported,
                    "element '{}' comes before the vertices; splats are expected first",
                    header.elements.front().name);
    Places places;
    std::size_t stride = 0;
    for (const PlyProperty& p : vertices.properties) {
        if (p.isList)
            return fail(ErrorCode::invalidInput,
                        "the splats have a list, '{}'; numbers are expected", p.name);
        places.emplace(p.name, static_cast<std::size_t>(&p - vertices.properties.data()));
        stride += plySize(p.type);
    }
    STX_TRY(const std::vector<std::size_t> atRest, placesOfRest(places));
    int degree = 0;
    while (3 * SplatCloud::coefficientCount(degree) < std::ssize(atRest)) ++degree;
    const auto count = static_cast<std::size_t>(vertices.count);
    const std::size_t left = bytes.size() - header.dataOffset;
    if (header.coding != PlyCoding::ascii && count > left / stride)
        return fail(ErrorCode::invalidInput,
                    "the header says {} splats of {} bytes, but only {} bytes follow", count,
                    stride, left);
    FileSplats splats;
    STX_CHECK(splats.resize(count, degree, job.limits));
    SplatCloud& cloud = splats.cloud;
    cloud.up = {0, -1, 0};
    std::vector<std::size_t> at;
    at.reserve(std::size(kNeeded));
    for (const char* name : kNeeded) at.push_back(places.find(name)->second);
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
            splats.centres[i][k] = number(part);
            cloud.scales[i][k] = static_cast<float>(std::exp(number(4 + part)));
            cloud.colours[i][k] = static_cast<float>(0.5 + kDegree0 * number(11 + part));
        }
        cloud.opacities[i] = static_cast<float>(1.0 / (1.0 + std::exp(-number(3))));
        // w comes first.
        cloud.rotations[i] = glm::vec4(number(8), number(9), number(10), number(7));
        for (int k = 0; k < std::ssize(atRest); ++k)
            cloud.setHarmonic(i, k % coefficients, k / coefficients,
                              static_cast<float>(splat[atRest[k]]));
    }
    if (&vertices == &header.elements.back() && values.beginElement())
        job.note(fmt::format("the header says {} splats: what follows them is ignored ({} bytes)",
                             count, bytes.size() - values.offset()));
    noteDropped(header, job);
    return meshOfSplats(std::move(splats), job);
}

}  // namespace stx
